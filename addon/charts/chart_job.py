"""UV charts for the meshes that need them, in a UV map of their own: each mesh's, or those of all in one atlas."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import bpy

from ...core.base.errors import InputError
from ...core.base.timing import Stopwatch
from ...core.charts.figures import ChartFigures
from ...core.progress import Progress
from ..read.blender_state import object_mode, synced
from ..read.block_ref import BlockRef, find
from ..read.rendered_maps import Objects, RenderedMaps, lays_out, refused_without_faces, rendered_maps
from ..typed import library_of, mesh_of, view_layer_in
from .chart_layout import ChartLayout, layout_steps
from .chart_marks import ATLAS_MAP, OUR_NAMES, is_ours, mark_of, set_mark
from .chart_parts import Part, Wanted, fingerprint, parts_of
from .chart_request import ChartRequest, layer_of
from .chart_survival import refused_charts, refused_map
from .shared_image import leave_room
from .uv_maps import check_room, write_uv

_Steps = Generator[Callable[[], Any], Any, None]


@dataclass
class ChartJob:
    """What became of a request for charts, filled while the work goes on.

    layer: the UV map to bake onto, None for each mesh's active one. made: the objects whose mesh was given charts, and
    figures of the layout. refused: why an object cannot have any. clock: tells how long each layout took.
    """

    request: ChartRequest = field(default_factory=ChartRequest)
    layer: str | None = None
    made: dict[BlockRef, ChartFigures] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    refused: dict[BlockRef, InputError] = field(default_factory=dict)
    clock: Stopwatch = field(default_factory=Stopwatch)


def chart_steps(
    context: bpy.types.Context, refs: Sequence[BlockRef], charting: ChartJob, progress: Progress, then: int = 0
) -> _Steps:
    """Give chart UVs to the objects' meshes that need them; for a `Runner`. then: how many objects are baked after
    that. Raises Cancelled."""
    charting.layer = layer_of(charting.request.uv)
    objects = synced(view_layer_in(context))
    found = {ref: obj for ref in refs if (obj := find(objects, ref)) is not None and obj.type == "MESH"}
    with object_mode(context):  # once: each way there and back is two steps of undo
        wanted = _wanted(context, found, charting)
        layouts = _layouts(context, {ref: found[ref] for ref in wanted}, wanted, charting)
    if charting.request.atlas and wanted:
        charting.layer = charting.request.layer
    for done, layout in enumerate(layouts):
        progress.expect(len(layouts) - done + then)
        yield from _charts_of(context, layout, charting, progress)
    progress.expect(then)


def _wanted(context: bpy.types.Context, objects: Objects, charting: ChartJob) -> dict[BlockRef, str]:
    """The objects that are to have charts, by their meshes as they render, and the UV map whose charts they keep; those
    that cannot be baked for want of faces or of a UV map are refused."""
    request, rendered = charting.request, rendered_maps(context, objects)
    found = {ref: obj for ref, obj in objects.items() if rendered[ref].has_faces}
    bare = {ref: obj for ref, obj in objects.items() if ref not in found}
    charting.refused |= refused_without_faces(context, bare)
    if request.uv is not None and not request.anew:
        charting.refused |= refused_map(context, found, request.uv, rendered)
        return {}
    own = {} if request.anew else _own_maps(found, rendered, request)
    wanted = {ref: "" for ref in found if ref not in own}
    if request.atlas and found:
        mapped = {ref: found[ref] for ref in own}
        if wanted or not leave_room(context, mapped, own, request.size, request.udim):
            wanted = {
                ref: own[ref] if ref in own and lays_out(mesh_of(obj), own[ref]) else "" for ref, obj in found.items()
            }
    charting.refused |= refused_charts(context, {ref: found[ref] for ref in wanted}, request.layer, rendered)
    return {ref: source for ref, source in wanted.items() if ref not in charting.refused}


def _own_maps(
    objects: Objects, rendered: Mapping[BlockRef, RenderedMaps], request: ChartRequest
) -> dict[BlockRef, str]:
    """The UV maps of their own that objects are baked onto, not those of ours that are as we left them."""
    own = {}
    for ref, obj in objects.items():
        active, mesh = rendered[ref].active, mesh_of(obj)
        if request.atlas and active == ATLAS_MAP and (mark := mark_of(mesh, ATLAS_MAP)) is not None:
            active = mark.source if mark.source in mesh.uv_layers else None  # whose charts were laid out in it
        if active is not None and not is_ours(mesh, active):
            own[ref] = active
    return own


def _layouts(context: bpy.types.Context, objects: Objects, wanted: Wanted, charting: ChartJob) -> list[Wanted]:
    """What is laid out together: in an atlas all that fit into it, else objects that share a mesh."""
    if charting.request.atlas:
        fit = _fit_for_atlas(context, objects, wanted, charting)
        return [fit] if fit else []
    layouts: dict[int, dict[BlockRef, str]] = {}
    for ref, obj in objects.items():
        layouts.setdefault(mesh_of(obj).as_pointer(), {})[ref] = wanted[ref]
    return list(layouts.values())


def _fit_for_atlas(
    context: bpy.types.Context, objects: Objects, wanted: Wanted, charting: ChartJob
) -> dict[BlockRef, str]:
    """The objects whose meshes can have charts in it; the others are refused."""
    fit: dict[BlockRef, str] = {}
    taken: dict[int, BlockRef] = {}
    for ref, obj in objects.items():
        try:
            _refuse_linked(obj, ref)
            if (other := taken.setdefault(mesh_of(obj).as_pointer(), ref)) != ref:
                raise InputError(
                    f"{ref.label}: it shares its mesh with {other.label}, and in an atlas each needs UVs of its "
                    "own; make it a single user (Object > Relations > Make Single User > Object & Data)"
                )
            parts_of(context, {ref: wanted[ref]}, in_world=True)
            check_room(obj, charting.request.layer)
        except InputError as refusal:
            charting.refused[ref] = refusal
        else:
            fit[ref] = wanted[ref]
    return fit


def _charts_of(context: bpy.types.Context, wanted: Wanted, charting: ChartJob, progress: Progress) -> _Steps:
    """Charts for objects of one mesh, or of an atlas; where they cannot have any, those are refused."""
    request, refs = charting.request, list(wanted)
    title = request.atlas or refs[0].label
    progress.enter(f"{title}: making UV charts", (0.0, 1.0))
    try:
        with charting.clock.stage(f"charts of {title}"):
            parts = _parts(context, wanted if request.atlas else {refs[0]: wanted[refs[0]]}, request)
            stand = _stand(parts, request)
            if not stand and request.atlas:
                parts = _without_edited(context, parts, charting)
                stand = _stand(parts, request)
            if not stand:
                layout = yield from _make(context, title, parts, request, progress)
    except InputError as refusal:
        charting.refused.update({ref: refusal for ref in refs if ref not in charting.refused})
        return
    refs = [ref for ref in refs if ref not in charting.refused]
    if not stand:
        charting.made.update(dict.fromkeys(refs, layout.figures))
        charting.notes.append(f"{title}: {_told(layout.figures, parts, request)}")
        progress.finish_object()
        return
    for part in parts:
        _prefer(context, part.mesh, request.layer)


def _parts(context: bpy.types.Context, wanted: Wanted, request: ChartRequest) -> list[Part]:
    return parts_of(context, wanted, in_world=bool(request.atlas))


def _without_edited(context: bpy.types.Context, parts: Sequence[Part], charting: ChartJob) -> list[Part]:
    """Those of an atlas that can be laid out anew; the others are refused. Raises InputError where none is left."""
    left = []
    with object_mode(context):
        for part in parts:
            try:
                _refuse_edited(part, charting.request.layer)
            except InputError as refusal:
                charting.refused[part.ref] = refusal
            else:
                left.append(part)
    if not left:
        raise charting.refused[parts[0].ref]
    return left


def _told(figures: ChartFigures, parts: Sequence[Part], request: ChartRequest) -> str:
    """What was made, in a line."""
    kept, how = sum(part.own is not None for part in parts), " by Smart UV Project" if request.by_blender else ""
    if kept == len(parts):
        how = ", those of their own UV maps side by side,"
    elif kept:
        how = f", those of {kept} of {len(parts)} UV maps beside new ones{how},"
    return f"{figures.count} charts{how} in the UV map {request.layer}, {figures.in_words()}"


def _stand(parts: Sequence[Part], request: ChartRequest) -> bool:
    """Whether charts made before still fit. An artist may have been at them."""
    marks = [mark_of(part.mesh, request.layer) for part in parts]
    if None in marks:
        return False
    made_for = [fingerprint(parts, request, by_blender=by_blender) for by_blender in request.accepted]
    return any(all(mark and mark.made_for == f"{each}{i}" for i, mark in enumerate(marks)) for each in made_for)


def _make(
    context: bpy.types.Context, title: str, parts: Sequence[Part], request: ChartRequest, progress: Progress
) -> Generator[Callable[[], Any], Any, ChartLayout]:
    """One layout for these meshes, written into them."""
    with object_mode(context):
        for part in parts:
            _refuse_linked(part.obj, part.ref)
            _refuse_edited(part, request.layer)
    made_for = fingerprint(parts, request, by_blender=request.by_blender)
    wanted = {part.ref: part.source for part in parts}
    layout = yield from layout_steps(context, title, parts, request, progress)
    again = _parts(context, wanted, request)  # the artist, or an undo, may have been at it
    if fingerprint(again, request, by_blender=request.by_blender) != made_for:
        raise InputError(f"{title}: it was changed while its charts were made; start again")
    with object_mode(context):
        for part in again:
            _refuse_edited(part, request.layer)
        for i, (part, uv) in enumerate(zip(again, layout.uv, strict=True)):
            write_uv(context, part.obj, request.layer, uv, part.base.loops)
            set_mark(part.mesh, request.layer, f"{made_for}{i}", part.source)
            _prefer(context, part.mesh, request.layer)
    return layout


def _prefer(context: bpy.types.Context, mesh: bpy.types.Mesh, name: str) -> None:
    """Of our own maps the last that was baked onto is active; an artist's stays so."""
    active = mesh.uv_layers.active
    if library_of(mesh) is not None or active is None or active.name == name or active.name not in OUR_NAMES:
        return
    with object_mode(context):
        if is_ours(mesh, active.name):
            mesh.uv_layers.active = mesh.uv_layers[name]


def _refuse_linked(obj: bpy.types.Object, ref: BlockRef) -> None:
    """Before minutes of unwrapping, what `write_uv` would say after."""
    if (library := library_of(mesh_of(obj))) is not None:
        where = library.filepath
        raise InputError(
            f"{ref.label}: its mesh is linked from {where} and can be given no UV map; make it local or unwrap it there"
        )


def _refuse_edited(part: Part, layer: str) -> None:
    """What an artist has made, or been at, is never written over."""
    if layer in part.mesh.uv_layers and not is_ours(part.mesh, layer):
        raise InputError(
            f"{part.ref.label}: new charts would take the place of its UV map {layer}, which was made or edited by "
            "hand; rename it to keep it, or remove it"
        )
