"""The chart maps of a mesh as they were, to put them back after work that came to nothing."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import bpy
import numpy as np

from ...core.base.arrays import Floats
from ..read.blender_state import synced
from ..read.block_ref import BlockRef, find
from ..typed import found_in, mesh_of
from .chart_marks import OUR_NAMES, KeptMark, is_ours


@dataclass(frozen=True, eq=False)
class _ChartMap:
    """uv: (loops, 2) float32, None where there was no such map. mark: of what it was made for."""

    uv: Floats | None
    mark: KeptMark


_ChartMaps = dict[str, _ChartMap]  # by the UV map's name


@contextmanager
def chart_rollback(view_layer: bpy.types.ViewLayer, refs: Sequence[BlockRef], kept: list[BlockRef]) -> Iterator[None]:
    """Put back the chart maps of all these objects that are not among the kept in the end; they share no mesh with one.

    What the artist has renamed or edited in the meantime stays. kept: filled by the work inside.
    """
    found = ((ref, find(synced(view_layer), ref)) for ref in refs)
    before = {ref: _read(mesh_of(obj)) for ref, obj in found if obj is not None and obj.type == "MESH"}
    try:
        yield
    finally:
        left = {ref: find(bpy.data.objects, ref) for ref in before}  # less those that the artist has removed
        used = {obj.data for ref in kept if (obj := left.get(ref))}
        for ref, obj in left.items():
            if obj is not None and obj.type == "MESH" and obj.data not in used:
                for layer, chart_map in before[ref].items():
                    _restore(mesh_of(obj), layer, chart_map)


def _read(mesh: bpy.types.Mesh) -> _ChartMaps:
    found = {}
    for name in OUR_NAMES:
        layer, uv = found_in(mesh.uv_layers, name), None
        if layer is not None:
            uv = np.empty((len(layer.uv), 2), dtype=np.float32)
            layer.uv.foreach_get("vector", uv.reshape(-1))
        found[name] = _ChartMap(uv, KeptMark.of(mesh, name))
    return found


def _restore(mesh: bpy.types.Mesh, name: str, before: _ChartMap) -> None:
    if before.mark.is_that_of(mesh, name):
        return  # no charts were made
    layer = found_in(mesh.uv_layers, name)
    if layer is not None and not mesh.is_editmode and not is_ours(mesh, name):
        return
    before.mark.restore(mesh, name)
    if layer is not None and before.uv is None:
        mesh.uv_layers.remove(layer)
    elif layer is not None and before.uv is not None and len(layer.uv) == len(before.uv):
        layer.uv.foreach_set("vector", before.uv.reshape(-1))
    mesh.update()
