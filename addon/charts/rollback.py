"""What was changed in meshes for charts, to be taken back after work that came to nothing."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import bpy

from ...core.base.arrays import Floats
from ..materials.mesh_layers import values_of
from ..read.blender_state import object_mode
from ..read.block_ref import BlockRef, find
from ..typed import found_in, mesh_of
from .chart_marks import KeptMark, is_ours


@dataclass(frozen=True, eq=False)
class MapChange:
    """What an object's mesh had before its UV map `layer` was made the active one or, where there is a mark, written.
    active: the name of the active map, empty for none. mark: the map's. uv: (loops, 2) float32, None for no such map.
    """

    ref: BlockRef
    layer: str
    active: str
    mark: KeptMark | None = None
    uv: Floats | None = None

    @staticmethod
    def of(ref: BlockRef, mesh: bpy.types.Mesh, layer: str, *, written: bool) -> MapChange:
        """Before it, within `object_mode`."""
        found: Any = found_in(mesh.uv_layers, layer) if written else None
        uv = None if found is None else values_of(found.uv, "vector", len(mesh.loops), 2)
        return MapChange(ref, layer, _active_name(mesh), KeptMark.of(mesh, layer) if written else None, uv)


@contextmanager
def chart_rollback(
    context: bpy.types.Context, changes: Sequence[MapChange], kept: Sequence[BlockRef]
) -> Iterator[None]:
    """Take back the changes to meshes that none of the objects that are kept in the end has.

    What the artist has renamed or edited in the meantime stays. changes, kept: filled by the work inside.
    """
    try:
        yield
    finally:
        used = [_mesh_of(ref) for ref in kept]
        vain = [(mesh, each) for each in changes if (mesh := _mesh_of(each.ref)) is not None and mesh not in used]
        if vain:
            with object_mode(context):
                for mesh, change in vain:
                    _take_back(mesh, change)


def _mesh_of(ref: BlockRef) -> bpy.types.Mesh | None:
    """None where the artist has removed or converted the object."""
    obj = find(bpy.data.objects, ref)
    return mesh_of(obj) if obj is not None and obj.type == "MESH" else None


def _active_name(mesh: bpy.types.Mesh) -> str:
    return mesh.uv_layers.active.name if mesh.uv_layers.active is not None else ""


def _take_back(mesh: bpy.types.Mesh, change: MapChange) -> None:
    if mesh.is_editmode:  # in another scene: its UVs are out of reach
        return
    active = _active_name(mesh)
    if change.mark is not None and not _restored(mesh, change, change.mark):
        return
    layer = found_in(mesh.uv_layers, change.active if active == change.layer else active)
    if layer is not None:
        mesh.uv_layers.active = layer
    mesh.update()


def _restored(mesh: bpy.types.Mesh, before: MapChange, mark: KeptMark) -> bool:
    """Whether a map and its mark are as they were, both or neither."""
    layer: Any = found_in(mesh.uv_layers, before.layer)
    if layer is None or not is_ours(mesh, before.layer):
        return False
    if before.uv is None:
        mesh.uv_layers.remove(layer)
    elif len(layer.uv) == len(before.uv):
        layer.uv.foreach_set("vector", before.uv.reshape(-1))
    else:
        return False  # faces were added or removed
    mark.restore(mesh, before.layer)
    return True
