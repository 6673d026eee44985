"""UV charts for the meshes that need them, in a UV map of their own: each mesh's, or those of all in one atlas."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, field
from typing import Any

import bpy
import numpy as np

from ..core.apart import unwrap_apart
from ..core.charts import Charts, has_unwrapper
from ..core.errors import InputError, NoUnwrapper
from ..core.progress import Progress
from ..core.scene import Doubles, Floats
from .clock import timed
from .extract import BaseTriangles, base_triangles, matrix_of, synced, write_uv
from .smart import smart_unwrap

CHARTS, SMART = "charts", "smart"  # as the UV map of the options: make one, by xatlas or by Blender
CHART_MAP, ATLAS_MAP = "Occlusion Bake", "Occlusion Bake Atlas"  # and what it is called
MARKS = {CHART_MAP: "occlusion_bake_charts", ATLAS_MAP: "occlusion_bake_atlas"}  # on a mesh: what a map was made for
_PADDING = 4


def layer_of(uv: str | None) -> str | None:
    """The UV map that an object alone is baked onto, by the job's options; None: the active one."""
    return CHART_MAP if uv in (CHARTS, SMART) else uv


_Unwraps = Generator[Callable[[], Any], Any, None]


@dataclass
class Charting:
    """What charts to make, and what became of it. uv: as in the job's options. atlas: its name, or empty. smart: by
    Blender where there is no xatlas. size: of the image.

    layer: the UV map to bake onto, None for each mesh's active one. made: the objects whose mesh was given charts.
    refused: by the name of the object that cannot have any.
    """

    uv: str | None = None
    atlas: str = ""
    smart: bool = False
    size: tuple[int, int] = (1024, 1024)
    layer: str | None = None
    made: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    refused: dict[str, InputError] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)

    @property
    def by_blender(self) -> bool:
        """Whether Blender unwraps."""
        return self.uv == SMART or (self.smart and not has_unwrapper())

    @property
    def where(self) -> str:
        """The UV map for charts."""
        return ATLAS_MAP if self.atlas else CHART_MAP


def chart_steps(context: bpy.types.Context, names: Sequence[str], charting: Charting, progress: Progress) -> _Unwraps:
    """Give chart UVs to the meshes of the named objects that need them; for a `Runner`. Raises Cancelled."""
    charting.layer = None if charting.uv in (CHARTS, SMART) else charting.uv
    objects = synced(context.view_layer)
    found = [objects[name] for name in names if name in objects and _has_faces(objects[name])]
    wanting = [obj for obj in found if _wants_charts(obj, charting)]
    if not wanting:
        return
    if charting.atlas:  # one that wants charts is enough: those of the others leave no room for them
        charting.layer = charting.where
        yield from _charts_of(context, [obj.name for obj in found], charting, progress)
        return
    for sharing in _by_mesh(wanting):
        yield from _charts_of(context, sharing, charting, progress)
    if charting.uv in (CHARTS, SMART):
        charting.layer = charting.where


def _has_faces(obj: bpy.types.Object) -> bool:
    return obj is not None and obj.type == "MESH" and len(obj.data.polygons) > 0  # else reading the scene says why


def _wants_charts(obj: bpy.types.Object, charting: Charting) -> bool:
    layers = obj.data.uv_layers
    own = layers.active is not None and layers.active.name == charting.where
    return charting.uv in (CHARTS, SMART) or (charting.uv is None and (len(layers) == 0 or own))


def _by_mesh(objects: Sequence[bpy.types.Object]) -> list[list[str]]:
    """Names of the objects; those that share a mesh together."""
    found: dict[int, list[str]] = {}
    for obj in objects:
        found.setdefault(obj.data.as_pointer(), []).append(obj.name)
    return list(found.values())


def _charts_of(context: bpy.types.Context, names: list[str], charting: Charting, progress: Progress) -> _Unwraps:
    """Charts for objects of one mesh, or of an atlas; where they cannot have any, those are refused."""
    title = charting.atlas or names[0]
    progress.enter(f"{title}: making UV charts")
    try:
        with timed(charting.seconds, f"charts of {title}"):
            said = yield from _make(context, title, names if charting.atlas else names[:1], charting, progress)
    except InputError as refusal:
        charting.refused.update(dict.fromkeys(names, refusal))
        return
    if said:
        charting.made += names
        charting.notes.append(said)


def _make(
    context: bpy.types.Context, title: str, names: list[str], charting: Charting, progress: Progress
) -> Generator[Callable[[], Any], Any, str]:
    """One layout for the meshes of these objects. Returns what to say of it, nothing where the one made before fits."""
    parts = _parts(context, names, charting)
    mark = _fingerprint(parts, charting)
    if all(_fits(part.mesh, charting, f"{mark}{i}") for i, part in enumerate(parts)):
        return ""
    for part in parts:
        _refuse_linked(part.obj)
    if charting.by_blender:
        layouts = smart_unwrap(
            context, [part.obj for part in parts], _PADDING / max(charting.size), in_world=bool(charting.atlas)
        )
        said = "charts by Smart UV Project"
    else:
        charts = yield from _unwrapped(title, parts, charting, progress)
        layouts = np.split(charts.uv, np.cumsum([len(part.base.triangles) for part in parts])[:-1])
        said = f"{charts.count} charts"
        fit = f", stretch {charts.stretch.l2:.3f}, {100.0 * charts.utilisation:.0f} % of the image used"
    again = _parts(context, names, charting)  # the artist, or an undo, may have been at it
    if _fingerprint(again, charting) != mark:
        raise InputError(f"{title}: it was changed while its charts were made; start again")
    for i, (part, layout) in enumerate(zip(again, layouts, strict=True)):
        write_uv(context, part.obj, charting.where, layout, part.base.loops)
        part.mesh[MARKS[charting.where]] = f"{mark}{i}"
    return f"{title}: {said} in the UV map {charting.where}{'' if charting.by_blender else fit}"


def _unwrapped(
    title: str, parts: Sequence[_Part], charting: Charting, progress: Progress
) -> Generator[Callable[[], Any], Any, Charts]:
    if not has_unwrapper():
        raise NoUnwrapper(title)
    starts = np.cumsum([0, *(len(part.base.vertices) for part in parts)])
    faces = np.cumsum([0, *(int(part.base.polygons.max(initial=-1)) + 1 for part in parts)])
    vertices = np.concatenate([part.vertices for part in parts])
    triangles = np.concatenate([part.base.triangles + start for part, start in zip(parts, starts, strict=False)])
    polygons = np.concatenate([part.base.polygons + start for part, start in zip(parts, faces, strict=False)])
    charts: Charts = yield lambda: unwrap_apart(
        *(title, vertices, triangles.astype(np.int32), polygons.astype(np.int32)),
        size=charting.size,
        padding=_PADDING,
        cancelled=lambda: bool(progress.control.cancel),
    )
    return charts


@dataclass(frozen=True, eq=False)
class _Part:
    """A mesh to chart. vertices: (V, 3) float32, as large in the world as they are in an atlas."""

    obj: bpy.types.Object
    base: BaseTriangles
    vertices: Floats

    @property
    def mesh(self) -> bpy.types.Mesh:
        """The object's."""
        return self.obj.data


def _parts(context: bpy.types.Context, names: Sequence[str], charting: Charting) -> list[_Part]:
    """Raises InputError for an object that is not there by now, and for meshes that an atlas cannot hold."""
    objects, parts = synced(context.view_layer), []
    if charting.atlas:
        _refuse_shared([objects.get(name) for name in names])
    for name in names:
        obj = objects.get(name)
        if obj is None:
            raise InputError(f"{name}: it was removed while its charts were made; start again")
        base = base_triangles(context, obj)
        vertices = base.vertices
        if charting.atlas:
            vertices = (vertices @ _size_of(name, obj).T).astype(np.float32)
            if not np.isfinite(vertices).all():
                raise InputError(f"{name}: some vertices are not finite numbers; delete them, or leave it out")
        parts.append(_Part(obj, base, vertices))
    return parts


def _size_of(name: str, obj: bpy.types.Object) -> Doubles:
    """(3, 3): how an object lies in the world, but for its place, and never mirrored."""
    linear: Doubles = matrix_of(obj.matrix_world)[:3, :3]
    if not np.isfinite(linear).all():
        raise InputError(f"{name}: its transform is not finite; clear the rotation or scale that is not")
    return linear if np.linalg.det(linear) >= 0.0 else linear @ np.diag([-1.0, 1.0, 1.0])


def _refuse_shared(objects: Sequence[bpy.types.Object | None]) -> None:
    for names in _by_mesh([obj for obj in objects if obj is not None]):
        if len(names) > 1:
            raise InputError(
                f"{names[0]}, {names[1]}: they share a mesh, and in an atlas each needs UVs of its own; make them "
                "single users (Object > Relations > Make Single User > Object & Data)"
            )


def _refuse_linked(obj: bpy.types.Object) -> None:
    """Before minutes of unwrapping, what `write_uv` would say after."""
    if obj.data.library is not None:
        where = obj.data.library.filepath
        raise InputError(
            f"{obj.name}: its mesh is linked from {where} and has no UV map; make it local or unwrap it there"
        )


def _fits(mesh: bpy.types.Mesh, charting: Charting, mark: str) -> bool:
    """Whether the charts made before are those of now."""
    return mesh.get(MARKS[charting.where]) == mark and charting.where in mesh.uv_layers


def _fingerprint(parts: Sequence[_Part], charting: Charting) -> str:
    """Tells whether charts made before still fit."""
    how = repr((charting.size, SMART)) if charting.by_blender else repr(charting.size)
    digest = hashlib.blake2b(how.encode(), digest_size=16)
    for part in parts:
        for array in (part.vertices, part.base.triangles, part.base.polygons):
            digest.update(array.tobytes())
    return digest.hexdigest()
