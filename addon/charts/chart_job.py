"""UV charts for the meshes that need them, in a UV map of their own: each mesh's, or those of all in one atlas."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, field
from typing import Any

import bpy
import numpy as np

from ...core.base.arrays import Doubles, Flags, Floats
from ...core.base.errors import InputError, NoUnwrapper
from ...core.base.timing import Stopwatch
from ...core.charts.unwrap import Charts, has_unwrapper
from ...core.charts.unwrap_process import unwrap_in_process
from ...core.progress import Progress
from ..read.blender_state import object_mode, synced
from ..read.block_ref import BlockRef, find
from ..read.rendered_maps import Objects, refused_without_faces, rendered_maps
from ..read.scene_reader import matrix_of
from ..typed import library_of, mesh_of, view_layer_in
from .base_mesh import BaseTriangles, base_triangles
from .chart_survival import refused_charts, refused_map
from .smart_project import smart_unwrap
from .uv_maps import check_room, write_uv

CHARTS, SMART = "charts", "smart"  # as the UV map of the options: make one, by xatlas or by Blender
CHART_MAP, ATLAS_MAP = "Occlusion Bake", "Occlusion Bake Atlas"  # and what it is called
MARKS = {CHART_MAP: "occlusion_bake_charts", ATLAS_MAP: "occlusion_bake_atlas"}  # on a mesh: what a map was made for
_PADDING = 4
_ROUNDED = 1e-5  # of an object's scale: float32 matrices that are turned differ by less


def layer_of(uv: str | None) -> str | None:
    """The UV map that an object alone is baked onto, by the job's options; None: the active one."""
    return CHART_MAP if uv in (CHARTS, SMART) else uv


_Unwraps = Generator[Callable[[], Any], Any, None]


@dataclass(frozen=True)
class ChartRequest:
    """What charts to make. uv: as in the job's options. atlas: its name, or empty. smart: by Blender, as xatlas makes
    none. size: of the image."""

    uv: str | None = None
    atlas: str = ""
    smart: bool = False
    size: tuple[int, int] = (1024, 1024)

    @property
    def by_blender(self) -> bool:
        """Whether Blender unwraps."""
        return self.uv == SMART or self.smart

    @property
    def layer(self) -> str:
        """The UV map for charts."""
        return ATLAS_MAP if self.atlas else CHART_MAP


@dataclass
class ChartJob:
    """What became of a request for charts, filled while the work goes on.

    layer: the UV map to bake onto, None for each mesh's active one. made: the objects whose mesh was given charts.
    refused: why an object cannot have any. clock: tells how long each layout took.
    """

    request: ChartRequest = ChartRequest()
    layer: str | None = None
    made: list[BlockRef] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    refused: dict[BlockRef, InputError] = field(default_factory=dict)
    clock: Stopwatch = field(default_factory=Stopwatch)


def chart_steps(
    context: bpy.types.Context, refs: Sequence[BlockRef], charting: ChartJob, progress: Progress
) -> _Unwraps:
    """Give chart UVs to the objects' meshes that need them; for a `Runner`. Raises Cancelled."""
    charting.layer = layer_of(charting.request.uv)
    objects = synced(view_layer_in(context))
    found = {ref: obj for ref in refs if (obj := find(objects, ref)) is not None and obj.type == "MESH"}
    with object_mode(context):  # once: each way there and back is two steps of undo
        wanting = _wanting(context, found, charting)
    if charting.request.atlas and wanting:
        charting.layer = charting.request.layer
        yield from _charts_of(context, _fit_for_atlas(context, wanting, charting), charting, progress)
    elif not charting.request.atlas:
        for sharing in _by_mesh(wanting):
            yield from _charts_of(context, sharing, charting, progress)


def _wanting(context: bpy.types.Context, objects: Objects, charting: ChartJob) -> Objects:
    """The objects that are to have charts, by their meshes as they render; those that cannot be baked for want of faces
    or of a UV map are refused."""
    request, rendered = charting.request, rendered_maps(context, objects)
    found = {ref: obj for ref, obj in objects.items() if rendered[ref].has_faces}
    bare = {ref: obj for ref, obj in objects.items() if ref not in found}
    charting.refused |= refused_without_faces(context, bare)
    if request.uv not in (None, CHARTS, SMART):
        charting.refused |= refused_map(context, found, request.uv, rendered)
        return {}
    wanting = {ref: obj for ref, obj in found.items() if request.uv or rendered[ref].active in (None, *MARKS)}
    if request.atlas and wanting:  # one is enough: the maps of the others leave no room for its charts
        wanting = found
    charting.refused |= refused_charts(context, wanting, request.layer, rendered)
    return {ref: obj for ref, obj in wanting.items() if ref not in charting.refused}


def _by_mesh(objects: Objects) -> list[list[BlockRef]]:
    """The objects; those that share a mesh together."""
    found: dict[int, list[BlockRef]] = {}
    for ref, obj in objects.items():
        found.setdefault(mesh_of(obj).as_pointer(), []).append(ref)
    return list(found.values())


def _charts_of(context: bpy.types.Context, refs: list[BlockRef], charting: ChartJob, progress: Progress) -> _Unwraps:
    """Charts for objects of one mesh, or of an atlas; where they cannot have any, those are refused."""
    if not refs:
        return
    title = charting.request.atlas or refs[0].label
    progress.enter(f"{title}: making UV charts", (0.0, 1.0))
    try:
        with charting.clock.stage(f"charts of {title}"):
            said = yield from _make(
                context, title, refs if charting.request.atlas else refs[:1], charting.request, progress
            )
    except InputError as refusal:
        charting.refused.update(dict.fromkeys(refs, refusal))
        return
    if said:
        charting.made += refs
        charting.notes.append(said)


def _make(
    context: bpy.types.Context, title: str, refs: list[BlockRef], request: ChartRequest, progress: Progress
) -> Generator[Callable[[], Any], Any, str]:
    """One layout for the meshes of these objects. Returns what to say of it, nothing where one made before fits."""
    parts = _parts(context, refs, request)
    for by_blender in _accepted(request):
        mark = _fingerprint(parts, request, by_blender)
        if all(_fits(part.mesh, request, f"{mark}{i}") for i, part in enumerate(parts)):
            for part in parts:
                _prefer(part.mesh, request.layer)
            return ""
    for part in parts:
        _refuse_linked(part.obj, part.ref)
    mark = _fingerprint(parts, request, request.by_blender)
    if request.by_blender:
        margin = _PADDING / min(request.size)
        layouts = smart_unwrap(context, [part.obj for part in parts], margin, in_world=bool(request.atlas))
        said = f"charts by Smart UV Project in the UV map {request.layer}"
    else:
        charts = yield from _unwrapped(title, parts, request, progress)
        layouts = np.split(charts.uv, np.cumsum([len(part.base.triangles) for part in parts])[:-1])
        said = (
            f"{charts.count} charts in the UV map {request.layer}, stretch {charts.stretch.l2:.3f}, "
            f"{100.0 * charts.utilisation:.0f} % of the image used"
        )
    again = _parts(context, refs, request)  # the artist, or an undo, may have been at it
    if _fingerprint(again, request, request.by_blender) != mark:
        raise InputError(f"{title}: it was changed while its charts were made; start again")
    with object_mode(context):
        for i, (part, layout) in enumerate(zip(again, layouts, strict=True)):
            write_uv(context, part.obj, request.layer, layout, part.base.loops)
            part.mesh[MARKS[request.layer]] = f"{mark}{i}"
            _prefer(part.mesh, request.layer)
    return f"{title}: {said}"


def _accepted(request: ChartRequest) -> list[bool]:
    """Whose charts, made before, may stay: by Blender or not."""
    if request.uv == SMART:
        return [True]
    return [False] if request.uv == CHARTS and has_unwrapper() and not request.smart else [False, True]


def own_active(mesh: bpy.types.Mesh) -> str | None:
    """The mesh's active UV map where that is one of ours: it need not be the one that is rendered by."""
    active = mesh.uv_layers.active
    return str(active.name) if active is not None and active.name in MARKS else None


def _prefer(mesh: bpy.types.Mesh, name: str) -> None:
    """Of our own maps the last that was baked onto is active; an artist's stays so."""
    if library_of(mesh) is None and own_active(mesh) is not None:
        mesh.uv_layers.active = mesh.uv_layers[name]


def _fit_for_atlas(context: bpy.types.Context, objects: Objects, charting: ChartJob) -> list[BlockRef]:
    """The objects whose meshes can have charts in it; the others are refused."""
    fit: list[BlockRef] = []
    taken: dict[int, BlockRef] = {}
    with object_mode(context):  # once: each way there and back is two steps of undo
        for ref, obj in objects.items():
            try:
                _refuse_linked(obj, ref)
                if (other := taken.setdefault(mesh_of(obj).as_pointer(), ref)) != ref:
                    raise InputError(
                        f"{ref.label}: it shares its mesh with {other.label}, and in an atlas each needs UVs of its "
                        "own; make it a single user (Object > Relations > Make Single User > Object & Data)"
                    )
                _parts(context, [ref], charting.request)
                check_room(obj, charting.request.layer)
            except InputError as refusal:
                charting.refused[ref] = refusal
            else:
                fit.append(ref)
    return fit


def _unwrapped(
    title: str, parts: Sequence[_Part], request: ChartRequest, progress: Progress
) -> Generator[Callable[[], Any], Any, Charts]:
    if not has_unwrapper():
        raise NoUnwrapper(title)
    starts = np.cumsum([0, *(len(part.base.vertices) for part in parts)])
    faces = np.cumsum([0, *(int(part.base.polygons.max(initial=-1)) + 1 for part in parts)])
    vertices = np.concatenate([part.vertices for part in parts])
    triangles = np.concatenate([part.base.triangles + start for part, start in zip(parts, starts, strict=False)])
    polygons = np.concatenate([part.base.polygons + start for part, start in zip(parts, faces, strict=False)])
    seams = _seams(parts)
    charts: Charts = yield lambda: unwrap_in_process(
        title,
        vertices,
        triangles.astype(np.int32),
        polygons.astype(np.int32),
        size=request.size,
        padding=_PADDING,
        seams=seams,
        progress=lambda share, stage: progress.reach(share, f"{title}: {stage}"),
    )
    return charts


def _seams(parts: Sequence[_Part]) -> Flags | None:
    """(T, 3) bool of all parts' triangles, None where nothing is marked."""
    marked = [part.base.seams for part in parts]
    if all(seams is None for seams in marked):
        return None
    shapes = [part.base.triangles.shape for part in parts]
    return np.concatenate(
        [np.zeros(shape, np.bool_) if seams is None else seams for seams, shape in zip(marked, shapes, strict=True)]
    )


@dataclass(frozen=True, eq=False)
class _Part:
    """A mesh to chart. vertices: (V, 3) float32, as large in the world as they are in an atlas."""

    ref: BlockRef
    obj: bpy.types.Object
    base: BaseTriangles
    vertices: Floats

    @property
    def mesh(self) -> bpy.types.Mesh:
        """The object's."""
        return mesh_of(self.obj)


def _parts(context: bpy.types.Context, refs: Sequence[BlockRef], request: ChartRequest) -> list[_Part]:
    """Raises InputError for an object that is not there by now, and for one that an atlas cannot hold."""
    objects, parts = synced(view_layer_in(context)), []
    with object_mode(context):
        for ref in refs:
            obj = find(objects, ref)
            if obj is None:
                gone = "removed" if find(bpy.data.objects, ref) is None else "taken out of the view layer that is shown"
                raise InputError(f"{ref.label}: it was {gone} while its charts were made; start again")
            if obj.type != "MESH":
                raise InputError(
                    f"{ref.label}: it was made another kind of object while its charts were made; start again"
                )
            base = base_triangles(context, obj)
            vertices = base.vertices
            if request.atlas:
                vertices = (vertices @ _stretch_of(ref.label, obj).T).astype(np.float32)
                if not np.isfinite(vertices).all():
                    raise InputError(f"{ref.label}: some vertices are not finite numbers; delete them, or leave it out")
            parts.append(_Part(ref, obj, base, vertices))
    return parts


def _stretch_of(name: str, obj: bpy.types.Object) -> Doubles:
    """(3, 3): how large an object is in the world, each way, whichever way it is turned: the symmetric factor of its
    matrix' polar decomposition, rounded so that turning it changes no charts."""
    linear = matrix_of(obj.matrix_world)[:3, :3]
    if not np.isfinite(linear).all():
        raise InputError(f"{name}: its transform is not finite; clear the rotation or scale that is not")
    squares, axes = np.linalg.eigh(linear.T @ linear)
    stretch = (axes * np.sqrt(np.maximum(squares, 0.0))) @ axes.T
    step = _ROUNDED * max(float(np.abs(stretch).max()), 1e-300)
    rounded: Doubles = np.rint(stretch / step) * step
    return rounded


def _refuse_linked(obj: bpy.types.Object, ref: BlockRef) -> None:
    """Before minutes of unwrapping, what `write_uv` would say after."""
    if (library := library_of(mesh_of(obj))) is not None:
        where = library.filepath
        raise InputError(
            f"{ref.label}: its mesh is linked from {where} and can be given no UV map; make it local or unwrap it there"
        )


def _fits(mesh: bpy.types.Mesh, request: ChartRequest, mark: str) -> bool:
    """Whether the charts made before are those of now."""
    return mesh.get(MARKS[request.layer]) == mark and request.layer in mesh.uv_layers


def _fingerprint(parts: Sequence[_Part], request: ChartRequest, by_blender: bool) -> str:
    """Tells whether charts made before still fit."""
    how = repr((request.size, SMART)) if by_blender else repr(request.size)
    digest = hashlib.blake2b(how.encode(), digest_size=16)
    for part in parts:
        for array in (part.vertices, part.base.triangles, part.base.polygons):
            digest.update(array.tobytes())
    return digest.hexdigest()
