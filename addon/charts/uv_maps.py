"""UV maps written into the artist's own mesh, before modifiers."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any

import bpy
import numpy as np

from ...core.base.arrays import Floats, Ints
from ...core.base.errors import InputError
from ..materials.mesh_layers import values_of
from ..read.blender_state import object_mode
from ..read.mesh_arrays import vertices_of
from ..read.writable_mesh import check_writable
from ..typed import mesh_of

_MOST_LAYERS = 8  # UV maps of a mesh
_SCATTER = (0.7548776662466927, 0.5698402909980532)  # multiples of these fill the unit square, no three on a line


def check_map(obj: bpy.types.Object, label: str, name: str) -> None:
    """Whether the object's mesh can be given a UV map of this name, or the one that it has be written over; within
    `object_mode`. label: what to call the object. Raises InputError where it cannot."""
    check_writable(obj, label)
    mesh = mesh_of(obj)
    if name in mesh.uv_layers:
        return
    taken = next((kind for kind, names in _namesakes(obj).items() if name in names), None)
    if taken is not None:  # Blender would call the map otherwise
        raise InputError(f"{label}: it has {taken} {name}, as its UV map would be called; rename that")
    if len(mesh.uv_layers) >= _MOST_LAYERS:
        raise InputError(f"{label}: Blender has no room for another UV map on its mesh; remove one")


def takes_map(obj: bpy.types.Object, name: str) -> bool:
    """Whether the object's mesh has a UV map of this name, or can be given one; within `object_mode`."""
    if name in mesh_of(obj).uv_layers:
        return True
    try:
        check_map(obj, obj.name, name)
    except InputError:
        return False
    return True


def write_uv(context: bpy.types.Context, obj: bpy.types.Object, name: str, uv: Floats, loops: Ints) -> None:
    """Write a UV map into the object's mesh, one that passes `check_map`: as a new map or over one of that name.

    uv: (T, 3, 2) float32, v up; loops: (T, 3) int32 as in `base_mesh.base_triangles`. The other maps stay as they are,
    the active one too.
    """
    mesh = mesh_of(obj)
    with object_mode(context):
        layer = _own_layer(mesh, name)
        values = values_of(layer.uv, "vector", len(mesh.loops), 2)
        values[loops] = uv
        layer.uv.foreach_set("vector", values.reshape(-1))
        mesh.update()


@contextmanager
def tried_map(meshes: Iterable[bpy.types.Mesh], name: str) -> Iterator[None]:
    """Meshes that can take it with a UV map of this name for the time, in which their faces have areas; one that is
    there is left as it is. A vertex has one place, as within a chart, so that faces made of its corners alone, as by
    Dual Mesh, have none."""
    given: list[bpy.types.Mesh] = []
    try:
        for mesh in meshes:
            if name not in mesh.uv_layers:
                layer = _own_layer(mesh, name)
                given.append(mesh)
                places = vertices_of(mesh, np.arange(len(mesh.loops), dtype=np.int64))[:, np.newaxis] * _SCATTER % 1.0
                layer.uv.foreach_set("vector", places.astype(np.float32).reshape(-1))
        yield
    finally:
        for mesh in given:
            mesh.uv_layers.remove(mesh.uv_layers[name])
            mesh.update()


def _namesakes(obj: bpy.types.Object) -> dict[str, Any]:
    """What Blender gives no UV map the name of, by what it is."""
    return {"a vertex group": obj.vertex_groups, "an attribute": mesh_of(obj).attributes}


def _own_layer(mesh: bpy.types.Mesh, name: str) -> Any:
    layers: Any = mesh.uv_layers
    active, shown = layers.active_index, next((layer.name for layer in layers if layer.active_render), None)
    if name not in layers:
        layers.new(name=name, do_init=False)
    if active >= 0:
        layers.active_index = active
    if shown is not None:
        layers[shown].active_render = True
    return layers[name]
