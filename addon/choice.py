"""What the artist chose: objects by selection, the rest in the panel, or as it was kept on an image."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import bpy

from ..core.errors import InputError
from .extract import synced
from .images import MARK
from .job import CHARTS, Options
from .occluding import Occluding, named, words_of
from .outputs import COLOURS, Output
from .settings import core_settings, plain_settings

KEPT = "occlusion_bake_settings"  # on an image of ours: the order that it was baked by, as JSON


@dataclass(frozen=True)
class Order:
    """One press of the button. preview, gltf: whether the images go into materials. panel: the settings as they were
    set."""

    options: Options
    output: Output
    preview: bool
    gltf: bool
    panel: dict[str, Any]

    def kept(self) -> str:
        """As it is kept on an image."""
        occluding = self.options.occluding
        return json.dumps({"panel": self.panel, "occluders": words_of(occluding), "image": self.output.image})


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


def order_of(context: bpy.types.Context) -> Order:
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
    image = chosen.image.name if chosen.image is not None else ""
    return _order(names, plain_settings(chosen), occluding, image)


def keep_order(order: Order, images: Mapping[str, bpy.types.Image]) -> None:
    """Let images tell how they were baked."""
    for image in images.values():
        image[KEPT] = order.kept()


def is_ours(image: bpy.types.Image | None) -> bool:
    """Whether an image tells how it was baked."""
    return image is not None and KEPT in image


def order_again(view_layer: bpy.types.ViewLayer, image: bpy.types.Image) -> Order:
    """What an image was baked by. Raises InputError where it does not say so, or its object is not there."""
    try:
        kept = json.loads(image[KEPT])
        owner = image[MARK].rpartition("/")[0]
        panel, words = dict(kept["panel"]), list(kept["occluders"])
    except (KeyError, ValueError, TypeError):
        raise InputError(f"{image.name}: it does not tell how it was baked; bake its object anew") from None
    if owner not in synced(view_layer):
        raise InputError(f"{image.name}: its object {owner} is not in this view layer; bake another")
    try:
        return _order((owner,), panel, named(words, ground=panel["use_ground"]), kept.get("image", ""))
    except (AttributeError, KeyError):  # kept by another version
        raise InputError(f"{image.name}: it was baked by another version; bake its object anew") from None


def _order(names: tuple[str, ...], panel: dict[str, Any], occluding: Occluding, image: str) -> Order:
    chosen: Any = SimpleNamespace(**panel)
    uv = CHARTS if chosen.uv == "CHARTS" else None
    options = Options(names, core_settings(chosen), uv, occluding, chosen.output == COLOURS)
    depth, kind = int(chosen.depth), chosen.format.lower()
    output = Output(chosen.output, chosen.path, kind, depth, chosen.use_dither, image, chosen.channel)
    return Order(options, output, chosen.use_material, chosen.use_gltf, panel)
