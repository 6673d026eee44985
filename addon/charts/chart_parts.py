"""Meshes as they are charted: their triangles, as large as they are in the world, and the charts that they keep."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from ...core.base.arrays import Doubles, Flags, Floats
from ...core.base.errors import InputError
from ...core.charts.existing import ExistingCharts
from ...core.charts.udim import Udim
from ..materials.mesh_layers import values_of
from ..read.blender_state import object_mode, synced
from ..read.block_ref import BlockRef, find
from ..read.scene_reader import matrix_of
from ..typed import found_in, mesh_of, view_layer_in
from .base_mesh import BaseTriangles, base_triangles
from .chart_request import SMART, ChartRequest

_ROUNDED = 1e-5  # of an object's scale: float32 matrices that are turned differ by less

Wanted = Mapping[BlockRef, str]  # objects that are to have charts, and the UV map whose charts each keeps; "": none


@dataclass(frozen=True, eq=False)
class Part:
    """A mesh to chart. vertices: (V, 3) float32, as large in the world as they are in an atlas. own: (T, 3, 2) float32
    UVs whose charts it keeps, of the UV map `source`, None where it is to have new ones."""

    ref: BlockRef
    obj: bpy.types.Object
    base: BaseTriangles
    vertices: Floats
    source: str = ""
    own: Floats | None = None

    @property
    def mesh(self) -> bpy.types.Mesh:
        """The object's."""
        return mesh_of(self.obj)

    def charts_in(self, uv: Floats) -> ExistingCharts:
        """New charts of it, in a layout of their own: (T, 3, 2) float32."""
        return ExistingCharts(self.vertices, self.base.triangles, uv)

    def kept(self, udim: Udim) -> ExistingCharts:
        """The charts that it keeps."""
        assert self.own is not None
        return ExistingCharts(self.vertices, self.base.triangles, self.own, udim)


def parts_of(context: bpy.types.Context, wanted: Wanted, *, in_world: bool) -> list[Part]:
    """As the objects are now. in_world: as large in the world. Raises InputError for an object that is not there by
    now, and for one that an atlas cannot hold."""
    objects, parts = synced(view_layer_in(context)), []
    with object_mode(context):
        for ref, source in wanted.items():
            obj = _still_a_mesh(objects, ref)
            base = base_triangles(context, obj)
            vertices = base.vertices
            if in_world:
                vertices = (vertices @ _stretch_of(ref.label, obj).T).astype(np.float32)
                if not np.isfinite(vertices).all():
                    raise InputError(f"{ref.label}: some vertices are not finite numbers; delete them, or leave it out")
            own = _own_uv(mesh_of(obj), source, base) if source else None
            parts.append(Part(ref, obj, base, vertices, source, own))
    return parts


def seams_of(parts: Sequence[Part]) -> Flags | None:
    """(T, 3) bool of all parts' triangles, None where nothing is marked."""
    if all(part.base.seams is None for part in parts):
        return None
    unmarked = (np.zeros(part.base.triangles.shape, np.bool_) for part in parts)
    return np.concatenate(
        [none if part.base.seams is None else part.base.seams for part, none in zip(parts, unmarked, strict=True)]
    )


def fingerprint(parts: Sequence[Part], request: ChartRequest, *, by_blender: bool) -> str:
    """Of all that charts depend on; what is not there says nothing."""
    digest = hashlib.blake2b(repr((request.size, SMART) if by_blender else request.size).encode(), digest_size=16)
    for part in parts:
        for array in (part.vertices, part.base.triangles, part.base.polygons):
            digest.update(array.tobytes())
        if part.base.seams is not None:
            digest.update(part.base.seams.tobytes())
        if part.own is not None:
            digest.update(request.udim.value.encode() + part.own.tobytes())
    return digest.hexdigest()


def _still_a_mesh(objects: Any, ref: BlockRef) -> bpy.types.Object:
    obj: bpy.types.Object | None = find(objects, ref)
    if obj is None:
        gone = "removed" if find(bpy.data.objects, ref) is None else "taken out of the view layer that is shown"
        raise InputError(f"{ref.label}: it was {gone} while its charts were made; start again")
    if obj.type != "MESH":
        raise InputError(f"{ref.label}: it was made another kind of object while its charts were made; start again")
    return obj


def _own_uv(mesh: bpy.types.Mesh, name: str, base: BaseTriangles) -> Floats:
    """(T, 3, 2) float32."""
    layer: Any = found_in(mesh.uv_layers, name)
    if layer is None:
        raise InputError(f"{mesh.name}: its UV map {name} was removed while charts were laid out; start again")
    return values_of(layer.uv, "vector", len(mesh.loops), 2)[base.loops]


def _stretch_of(name: str, obj: bpy.types.Object) -> Doubles:
    """(3, 3): how large an object is in the world, each way, whichever way it is turned: the symmetric factor of its
    matrix' polar decomposition, rounded so that turning it changes no charts."""
    linear = matrix_of(obj.matrix_world)[:3, :3]
    if not np.isfinite(linear).all():
        raise InputError(f"{name}: its transform is not finite; clear the rotation or scale that is not")
    squares, axes = np.linalg.eigh(linear.T @ linear)
    stretch = (axes * np.sqrt(np.maximum(squares, 0.0))) @ axes.T
    # A power of two, or the step would have the noise of the number that it is a share of.
    step = 2.0 ** np.floor(np.log2(_ROUNDED * max(float(np.abs(stretch).max()), 1e-300)))
    rounded: Doubles = np.rint(stretch / step) * step
    return rounded
