"""Whether objects can share an image by the UV maps that they have."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from ...core.charts.udim import FIRST, Udim, tiles_of
from ...core.scene.scene import Mesh
from ...core.texels.rasterize import owners_by_centre
from ..materials.mesh_layers import values_of
from ..read.block_ref import BlockRef
from ..read.mesh_arrays import corners_of, positions_of, vertices_of
from ..read.rendered_maps import Objects, as_rendered, rendering_modifiers
from ..typed import found_in, mesh_of

_LOOKED_AT = 512  # texels a side, at most: what they cover is looked at no closer
_SHARED = 0.1  # of what an object covers others may cover, too, as parts do that are meant to show one place


def leave_room(
    context: bpy.types.Context, objects: Objects, maps: Mapping[BlockRef, str], size: tuple[int, int], udim: Udim
) -> bool:
    """Whether objects, by these UV maps as they render, lie beside one another in the unit square, and nowhere else.

    A tenth of what an object covers may be covered by others, too. Objects of one mesh count as one: no layout parts
    them. Where UVs beyond the unit square are said to be copies, maps are taken as they are.
    """
    if udim is Udim.STACKED:
        return True
    layouts = [each for each in _layouts(context, objects, maps).values() if each is not None]
    if any(set(tiles_of(each, udim).numbers) - {FIRST} for each in layouts):
        return False
    width, height = (min(side, _LOOKED_AT) for side in size)
    masks = [_Mask.of(each, width, height) for each in layouts]
    times = np.zeros(width * height, np.int32)
    for mask in masks:
        times += mask.texels
    return all(np.count_nonzero(times[mask.texels] > 1) <= _SHARED * mask.count for mask in masks)


@dataclass(frozen=True, eq=False)
class _Mask:
    """bits: of (n,) bool, eight to a byte. count: of those set."""

    bits: Any
    size: int
    count: int

    @staticmethod
    def of(mesh: Mesh, width: int, height: int) -> _Mask:
        assert mesh.uv is not None
        covered = owners_by_centre(mesh.uv, width, height).ravel() >= 0
        return _Mask(np.packbits(covered), covered.size, int(np.count_nonzero(covered)))

    @property
    def texels(self) -> Any:
        """(n,) bool."""
        return np.unpackbits(self.bits, count=self.size).astype(np.bool_)


def _layouts(context: bpy.types.Context, objects: Objects, maps: Mapping[BlockRef, str]) -> dict[int, Mesh | None]:
    """The triangles and UVs of each mesh, by where Blender has it, as it renders; of several objects the first."""
    first = {mesh_of(obj).as_pointer(): ref for ref, obj in reversed(list(objects.items()))}
    names = {maps[ref] for ref in first.values()}
    remade = {ref: objects[ref] for ref in first.values() if rendering_modifiers(objects[ref])}
    evaluated = as_rendered(context, remade, lambda mesh: {name: _layout(mesh, name) for name in names})
    return {
        pointer: evaluated[ref][maps[ref]] if ref in remade else _layout(mesh_of(objects[ref]), maps[ref])
        for pointer, ref in first.items()
    }


def _layout(mesh: bpy.types.Mesh, name: str) -> Mesh | None:
    """None where a mesh lacks the map."""
    layer: Any = found_in(mesh.uv_layers, name)
    if layer is None:
        return None
    corners = corners_of(mesh)
    uv = values_of(layer.uv, "vector", len(mesh.loops), 2)[corners]
    return Mesh(mesh.name, positions_of(mesh), vertices_of(mesh, corners), uv)
