"""What the artist chose: objects by selection, the rest in the panel, or as it was kept on an image."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from types import SimpleNamespace
from typing import Any

import bpy

from ...core.base.errors import InputError
from ..charts.chart_job import CHARTS, SMART
from ..job.bake_job import Options
from ..output.blender_images import MARK
from ..output.destination import CHANNEL, COLOURS, Output
from ..read.high_low_pairs import HighNames, Pairing, paired_by_name, paired_with
from ..read.occluder_filter import Occluding, named, words_of
from ..read.scene_reader import synced
from .properties import core_settings, plain_settings

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
        occluding, highs = self.options.occluding, self.options.highs
        return json.dumps(
            {
                "objects": self.options.objects,
                "panel": self.panel,
                "occluders": words_of(occluding),
                "less": sorted(occluding.less),
                "highs": {name: asdict(each) for name, each in highs.items()},
                "image": self.output.image,
            }
        )


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
    pairing = _pairing(context, names)
    occluding = Occluding(occluders, chosen.occluders == "SELF", chosen.use_ground, pairing.less)
    image = chosen.image.name if chosen.image is not None else ""
    return _order(pairing, plain_settings(chosen), occluding, image)


def _pairing(context: bpy.types.Context, names: tuple[str, ...]) -> Pairing:
    """Who is baked of the chosen meshes, and from what. Raises InputError."""
    chosen, active = context.scene.occlusion_bake, context.view_layer.objects.active
    extrusion = chosen.extrusion or None
    if chosen.source == "NAMES":
        return paired_by_name(synced(context.view_layer), names, extrusion)
    if chosen.source == "SELF":
        return Pairing(names)
    if active is None or active.type != "MESH":
        raise InputError("Selected to Active: the active object is no mesh; select the one to bake last")
    cage = chosen.cage.name if chosen.cage is not None else ""
    return paired_with(active.name, names, cage, extrusion)


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
    try:
        names = tuple(kept["objects"]) if panel["layout"] == "ATLAS" else (owner,)
        highs = {name: HighNames(**{**each, "names": tuple(each["names"])}) for name, each in kept["highs"].items()}
        pairing = Pairing(names, {name: highs[name] for name in names if name in highs}, frozenset(kept["less"]))
        occluding = replace(named(words, ground=panel["use_ground"]), less=pairing.less)
        order = _order(pairing, panel, occluding, kept["image"])
    except (AttributeError, KeyError, TypeError):  # kept by another version
        raise InputError(f"{image.name}: it was baked by another version; bake its object anew") from None
    if missing := [name for name in names if name not in synced(view_layer)]:
        raise InputError(f"{image.name}: its object {missing[0]} is not in this view layer; bake another")
    return order


def _order(pairing: Pairing, panel: dict[str, Any], occluding: Occluding, image: str) -> Order:
    chosen: Any = SimpleNamespace(**panel)
    colours = chosen.output == COLOURS
    atlas = chosen.atlas.strip() or "Atlas"
    options = Options(
        pairing.targets,
        core_settings(chosen),
        {"CHARTS": CHARTS, "SMART": SMART}.get(chosen.uv),
        occluding,
        colours,
        pairing.highs,
        atlas if chosen.layout == "ATLAS" and not colours else "",
        chosen.use_udim and chosen.output != CHANNEL,
    )
    depth, kind = int(chosen.depth), chosen.format.lower()
    output = Output(chosen.output, chosen.path, kind, depth, chosen.use_dither, image, chosen.channel)
    return Order(options, output, chosen.use_material, chosen.use_gltf, panel)
