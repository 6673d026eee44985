"""What the artist chose: objects by selection, the rest in the panel."""

from __future__ import annotations

import bpy

from ..core.errors import InputError
from .job import CHARTS, Options
from .occluding import Occluding
from .settings import core_settings


def chosen_objects(context: bpy.types.Context) -> list[bpy.types.Object]:
    """The selected objects, or the active one where none is."""
    selected = list(context.selected_objects)
    active = context.view_layer.objects.active
    return selected or ([active] if active is not None else [])


def chosen_occluders(context: bpy.types.Context) -> list[bpy.types.Object] | None:
    """The objects that may block light beside the one that is baked; None: all that render."""
    chosen = context.scene.occlusion_bake
    if chosen.occluders == "COLLECTION":
        return list(chosen.collection.all_objects) if chosen.collection is not None else []
    if chosen.occluders == "SELECTED":
        return chosen_objects(context)
    return [] if chosen.occluders == "SELF" else None


def options_of(context: bpy.types.Context) -> Options:
    """The panel's settings for the chosen meshes. Raises InputError."""
    names = tuple(obj.name for obj in chosen_objects(context) if obj.type == "MESH")
    if not names:
        raise InputError("no mesh object is selected; select one")
    chosen = context.scene.occlusion_bake
    if chosen.occluders == "COLLECTION" and chosen.collection is None:
        raise InputError("Occluders: no collection is chosen; choose one, or Scene")
    found = chosen_occluders(context)
    occluders = None if found is None else frozenset(obj.name for obj in found)
    occluding = Occluding(occluders, chosen.occluders == "SELF", chosen.use_ground)
    return Options(names, core_settings(context.scene), CHARTS if chosen.uv == "CHARTS" else None, occluding)
