"""What the artist chose: objects by selection, the rest in the panel, or as it was kept on an image."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from types import SimpleNamespace
from typing import Any

import bpy

from ...core.base.errors import InputError
from ...core.charts.udim import Udim
from ...core.options.values import settings_of_panel
from ..charts.chart_job import CHARTS, SMART
from ..job.bake_job import BakeJob, Layout
from ..output.blender_images import MARK
from ..output.destination import CHANNEL, COLOURS, Destination
from ..read.blender_state import synced
from ..read.high_low_pairs import HighNames, Pairing, paired_by_name, paired_with
from ..read.occluder_filter import OccluderFilter, arguments_of, named
from ..typed import view_layer_in
from .properties import plain_settings, settings_in

KEPT = "occlusion_bake_settings"  # on an image of ours: the order that it was baked by, as JSON


@dataclass(frozen=True)
class BakeRequest:
    """One press of the button. preview, gltf: whether the images go into materials. panel: the settings as they were
    set."""

    job: BakeJob
    destination: Destination
    preview: bool
    gltf: bool
    panel: dict[str, Any]

    def kept(self) -> str:
        """As it is kept on an image."""
        occluding, highs = self.job.occluding, self.job.highs
        return json.dumps(
            {
                "objects": self.job.objects,
                "panel": self.panel,
                "occluders": arguments_of(occluding),
                "less": sorted(occluding.excluded),
                "highs": {name: asdict(each) for name, each in highs.items()},
                "image": self.destination.image,
            }
        )


def chosen_objects(context: bpy.types.Context) -> list[bpy.types.Object]:
    """The selected objects, or the active one where none is."""
    selected = list(context.selected_objects)
    active = view_layer_in(context).objects.active
    return selected or ([active] if active is not None else [])


def chosen_occluders(context: bpy.types.Context) -> list[bpy.types.Object] | None:
    """The objects that may block light beside the one that is baked; None: all that render."""
    chosen = settings_in(context)
    if chosen.occluders == "COLLECTION":
        return list(chosen.collection.all_objects) if chosen.collection is not None else []
    if chosen.occluders == "SELECTED":
        return chosen_objects(context)
    return [] if chosen.occluders == "SELF" else None


def request_from_panel(context: bpy.types.Context) -> BakeRequest:
    """The panel's settings for the chosen meshes. Raises InputError."""
    names = tuple(obj.name for obj in chosen_objects(context) if obj.type == "MESH")
    if not names:
        raise InputError("no mesh object is selected; select one")
    chosen = settings_in(context)
    if chosen.occluders == "COLLECTION" and chosen.collection is None:
        raise InputError("Occluders: no collection is chosen; choose one, or Scene")
    found = chosen_occluders(context)
    occluders = None if found is None else frozenset(obj.name for obj in found)
    pairing = _pairing(context, names)
    occluding = OccluderFilter(occluders, chosen.occluders == "SELF", chosen.use_ground, pairing.excluded)
    image = chosen.image.name if chosen.image is not None else ""
    return _request(pairing, plain_settings(chosen), occluding, image)


def _pairing(context: bpy.types.Context, names: tuple[str, ...]) -> Pairing:
    """Who is baked of the chosen meshes, and from what. Raises InputError."""
    chosen, active = settings_in(context), view_layer_in(context).objects.active
    extrusion = chosen.extrusion or None
    if chosen.source == "NAMES":
        return paired_by_name(synced(view_layer_in(context)), names, extrusion)
    if chosen.source == "SELF":
        return Pairing(names)
    if active is None or active.type != "MESH":
        raise InputError("Selected to Active: the active object is no mesh; select the one to bake last")
    cage = chosen.cage.name if chosen.cage is not None else ""
    return paired_with(active.name, names, cage, extrusion)


def store_request(request: BakeRequest, images: Mapping[str, bpy.types.Image]) -> None:
    """Let images tell how they were baked."""
    for image in images.values():
        image[KEPT] = request.kept()


def is_ours(image: Any) -> bool:
    """Whether an image tells how it was baked."""
    return image is not None and KEPT in image


def request_from_image(view_layer: bpy.types.ViewLayer, image: bpy.types.Image) -> BakeRequest:
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
        occluding = replace(named(words, ground=panel["use_ground"]), excluded=pairing.excluded)
        request = _request(pairing, panel, occluding, kept["image"])
    except (AttributeError, KeyError, TypeError):  # kept by another version
        raise InputError(f"{image.name}: it was baked by another version; bake its object anew") from None
    if missing := [name for name in names if name not in synced(view_layer)]:
        raise InputError(f"{image.name}: its object {missing[0]} is not in this view layer; bake another")
    return request


def _request(pairing: Pairing, panel: dict[str, Any], occluding: OccluderFilter, image: str) -> BakeRequest:
    chosen: Any = SimpleNamespace(**panel)
    corners = chosen.output == COLOURS
    atlas = (chosen.atlas.strip() or "Atlas") if chosen.layout == "ATLAS" and not corners else ""
    job = BakeJob(
        pairing.targets,
        settings_of_panel(chosen),
        {"CHARTS": CHARTS, "SMART": SMART}.get(chosen.uv),
        occluding,
        pairing.highs,
        Layout(atlas, Udim.STACKED if chosen.output == CHANNEL else Udim[chosen.udim], corners),
    )
    depth, kind = int(chosen.depth), chosen.format.lower()
    destination = Destination(chosen.output, chosen.path, kind, depth, chosen.use_dither, image, chosen.channel)
    return BakeRequest(job, destination, chosen.use_material, chosen.use_gltf, panel)
