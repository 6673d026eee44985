"""What the artist chose: objects by selection, the rest in the panel, or as it was kept on an image."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import bpy

from ...core.base.errors import InputError
from ...core.base.foreign_text import json_object
from ...core.charts.udim import Udim
from ...core.options.values import settings_of_panel
from ..charts.chart_request import CHARTS, SMART
from ..job.bake_job import BakeJob, Layout
from ..output.destination import CHANNEL, COLOURS, Destination
from ..output.ownership import owners_of
from ..read.blender_state import synced
from ..read.block_ref import BlockRef, find, refs_of
from ..read.high_low_pairs import Pairing, paired_by_name, paired_with
from ..read.occluder_filter import OccluderFilter
from ..read.roles import roles_from_json, roles_to_json, with_target
from ..typed import view_layer_in
from .properties import are_settings, plain_settings, settings_in

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

    def kept(self, targets: Sequence[BlockRef]) -> str:
        """As it is kept on an image of these targets."""
        highs = {ref: self.job.highs[ref] for ref in targets if ref in self.job.highs}
        return json.dumps({"panel": self.panel, "roles": roles_to_json(targets, highs, self.job.occluding)})


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


def check_occluders(context: bpy.types.Context) -> None:
    """Raises InputError where the panel does not say who they are."""
    chosen = settings_in(context)
    if chosen.occluders == "COLLECTION" and chosen.collection is None:
        raise InputError("Occluders: no collection is chosen; choose one, or Scene")


def request_from_panel(context: bpy.types.Context) -> BakeRequest:
    """The panel's settings for the chosen meshes. Raises InputError."""
    refs = tuple(refs_of(obj for obj in chosen_objects(context) if obj.type == "MESH"))
    if not refs:
        raise InputError("no mesh object is selected; select one")
    chosen, found = settings_in(context), chosen_occluders(context)
    occluders = None if found is None else frozenset(obj.session_uid for obj in found)
    pairing = _pairing(context, refs)
    occluding = OccluderFilter(occluders, chosen.occluders == "SELF", chosen.use_ground, pairing.excluded)
    return _request(pairing, plain_settings(chosen), occluding, chosen.image)


def _pairing(context: bpy.types.Context, refs: tuple[BlockRef, ...]) -> Pairing:
    """Who is baked of the chosen meshes, and from what. Raises InputError."""
    chosen, active = settings_in(context), view_layer_in(context).objects.active
    extrusion = chosen.extrusion or None
    if chosen.source == "NAMES":
        return paired_by_name(synced(view_layer_in(context)), refs, extrusion)
    if chosen.source == "SELF":
        return Pairing(refs)
    if active is None or active.type != "MESH":
        raise InputError("Selected to Active: the active object is no mesh; select the one to bake last")
    low, *cage = refs_of([active, chosen.cage] if chosen.cage is not None else [active])
    return paired_with(low, refs, next(iter(cage), None), extrusion)


def store_request(request: BakeRequest, targets: Sequence[BlockRef], images: Mapping[str, bpy.types.Image]) -> None:
    """Let images tell how they were baked."""
    kept = request.kept(targets)
    for image in images.values():
        image[KEPT] = kept


def is_ours(image: Any) -> bool:
    """Whether an image tells how it was baked."""
    return image is not None and KEPT in image


def request_from_image(view_layer: bpy.types.ViewLayer, image: bpy.types.Image) -> BakeRequest:
    """What an image was baked by. Raises InputError where it does not say so, or its object is not there."""
    kept = json_object(image.get(KEPT))
    panel = kept.get("panel")
    if not isinstance(panel, dict):
        raise InputError(f"{image.name}: it does not tell how it was baked; bake its object anew")
    other = InputError(f"{image.name}: it was baked by another version; bake its object anew")
    if not are_settings(panel):
        raise other
    try:
        roles, owners = kept["roles"], owners_of(image)
        if len(owners) == len(roles["targets"]) == 1:  # who holds it is surer than who was called so
            roles = with_target(roles, owners[0].session_uid)
        pairing, occluding = roles_from_json(roles)
    except (AttributeError, LookupError, TypeError, ValueError):
        raise other from None
    request = _request(pairing, panel, occluding, None)
    there = synced(view_layer)
    if missing := [ref.label for ref in pairing.targets if find(there, ref) is None]:
        raise InputError(f"{image.name}: its object {missing[0]} is not in this view layer; bake another")
    return request


def _request(pairing: Pairing, panel: dict[str, Any], occluding: OccluderFilter, image: Any) -> BakeRequest:
    chosen: Any = SimpleNamespace(**panel)
    corners = chosen.output == COLOURS
    atlas = (chosen.atlas.strip() or "Atlas") if chosen.layout == "ATLAS" and not corners else ""
    job = BakeJob(
        pairing.targets,
        settings_of_panel(chosen),
        {"CHARTS": CHARTS, "SMART": SMART}.get(chosen.uv),
        occluding,
        pairing.highs,
        Layout(atlas, Udim.STACKED if chosen.output == CHANNEL and not atlas else Udim[chosen.udim], corners),
    )
    depth, kind = int(chosen.depth), chosen.format.lower()
    into = BlockRef(image.session_uid, image.name) if image is not None else None
    destination = Destination(chosen.output, chosen.path.strip(), kind, depth, chosen.use_dither, into, chosen.channel)
    return BakeRequest(job, destination, chosen.use_material, chosen.use_gltf, panel)
