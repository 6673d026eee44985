"""Which objects are charted, from which of their UV maps, and which of them together."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import bpy

from ...core.base.errors import InputError
from ..read.block_ref import BlockRef
from ..read.rendered_maps import Objects, RenderedMaps, lays_out, refused_without_faces, rendered_maps
from ..typed import mesh_of
from .chart_marks import ATLAS_MAP, is_ours, mark_of
from .chart_parts import Wanted
from .chart_request import ChartRequest
from .chart_survival import refused_charts, refused_map
from .shared_image import leave_room


@dataclass
class ChartPlan:
    """groups: what is laid out together, each mesh by the first object that has it. sharing: the objects of each of
    these meshes. maps: the UV maps that objects are baked onto, where those are not the active ones. refused: why an
    object cannot be baked."""

    groups: list[Wanted] = field(default_factory=list)
    sharing: dict[BlockRef, list[BlockRef]] = field(default_factory=dict)
    maps: dict[BlockRef, str] = field(default_factory=dict)
    refused: dict[BlockRef, InputError] = field(default_factory=dict)


def chart_plan(context: bpy.types.Context, objects: Objects, request: ChartRequest) -> ChartPlan:
    """By objects' meshes as they render; those are refused that cannot be baked for want of faces or of a UV map, or
    share a mesh in an atlas. Within `object_mode`."""
    plan, rendered = ChartPlan(), rendered_maps(context, objects)
    found = {ref: obj for ref, obj in objects.items() if rendered[ref].has_faces}
    plan.refused |= refused_without_faces(context, {ref: obj for ref, obj in objects.items() if ref not in found})
    if request.uv is not None and not request.anew:
        plan.maps = dict.fromkeys(found, request.uv)
        plan.refused |= refused_map(context, found, request.uv, rendered)
        return plan
    own = {} if request.anew else _own_maps(found, rendered, request)
    wanted = _wanted(context, found, own, request)
    plan.maps = {ref: name for ref, name in own.items() if name != rendered[ref].active}
    plan.maps |= dict.fromkeys(wanted, request.layer)
    plan.refused |= refused_charts(context, {ref: found[ref] for ref in wanted}, request.layer, rendered)
    left = {ref: source for ref, source in wanted.items() if ref not in plan.refused}
    plan.sharing = _by_mesh(found, left)
    firsts = {ref: left[ref] for ref in plan.sharing}
    if not request.atlas:
        plan.groups = [{ref: source} for ref, source in firsts.items()]
    elif firsts:
        plan.groups = [firsts]
        plan.refused |= _refused_twins(plan.sharing)
    return plan


def _wanted(
    context: bpy.types.Context, objects: Objects, own: Mapping[BlockRef, str], request: ChartRequest
) -> dict[BlockRef, str]:
    """The objects that are to have charts, and the UV map whose charts each keeps; empty for none."""
    wanted = {ref: "" for ref in objects if ref not in own}
    if not request.atlas or not objects:
        return wanted
    if not wanted and leave_room(context, objects, own, request.size, request.udim):
        return {}
    return {ref: own[ref] if ref in own and lays_out(mesh_of(obj), own[ref]) else "" for ref, obj in objects.items()}


def _own_maps(
    objects: Objects, rendered: Mapping[BlockRef, RenderedMaps], request: ChartRequest
) -> dict[BlockRef, str]:
    """The UV maps of their own that objects are baked onto, not those of ours that are as we left them."""
    own = {}
    for ref, obj in objects.items():
        active, mesh = rendered[ref].active, mesh_of(obj)
        mark = mark_of(mesh, ATLAS_MAP) if active == ATLAS_MAP else None
        if mark is not None and (request.atlas or is_ours(mesh, ATLAS_MAP)):
            active = mark.source if mark.source in rendered[ref].names else None  # whose charts were laid out in it
        if active is not None and not is_ours(mesh, active):
            own[ref] = active
    return own


def _by_mesh(objects: Objects, refs: Iterable[BlockRef]) -> dict[BlockRef, list[BlockRef]]:
    """Objects that share a mesh, by the first of them."""
    groups: dict[int, list[BlockRef]] = {}
    for ref in refs:
        groups.setdefault(mesh_of(objects[ref]).as_pointer(), []).append(ref)
    return {group[0]: group for group in groups.values()}


def _refused_twins(sharing: Mapping[BlockRef, list[BlockRef]]) -> dict[BlockRef, InputError]:
    """What to say in an atlas of those whose mesh another has, too."""
    return {
        ref: InputError(
            f"{ref.label}: it shares its mesh with {first.label}, and in an atlas each needs UVs of its own; make it a "
            "single user (Object > Relations > Make Single User > Object & Data)"
        )
        for first, group in sharing.items()
        for ref in group[1:]
    }
