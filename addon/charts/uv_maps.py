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
from ..typed import library_of, mesh_of

_MOST_LAYERS = 8  # UV maps of a mesh
_SCATTER = (0.7548776662466927, 0.5698402909980532)  # multiples of these fill the unit square, no three on a line


def check_room(obj: bpy.types.Object, layer_name: str) -> None:
    """Refuse a mesh that has no room for another UV map. Raises InputError."""
    if not _has_room(mesh_of(obj), layer_name):
        raise InputError(f"{obj.name}: Blender has no room for another UV map on its mesh; remove one")


def _has_room(mesh: bpy.types.Mesh, name: str) -> bool:
    return name in mesh.uv_layers or len(mesh.uv_layers) < _MOST_LAYERS


def takes_map(mesh: bpy.types.Mesh, name: str) -> bool:
    """Whether a mesh has a UV map of this name, or can be given one."""
    return name in mesh.uv_layers or (library_of(mesh) is None and _has_room(mesh, name))


def write_uv(
    context: bpy.types.Context,
    obj: bpy.types.Object,
    layer_name: str,
    uv: Floats,
    loops: Ints,
    *,
    activate: bool = False,
) -> str:
    """Write a UV map named `layer_name` into the object's mesh, as a new map or over an earlier one of that name.

    uv: (T, 3, 2) float32, v up; loops: (T, 3) int32 as in `base_mesh.base_triangles`. The other maps stay as they are,
    the active one too unless `activate`. Returns the name that Blender gave it. Raises InputError for a mesh linked
    from a library and for one that has no room for another map.
    """
    mesh = mesh_of(obj)
    if (library := library_of(mesh)) is not None:
        raise InputError(f"{obj.name}: its mesh is linked from {library.filepath}; make the mesh local first")
    with object_mode(context):
        layer = _own_layer(mesh, obj.name, layer_name, activate)
        values = values_of(layer.uv, "vector", len(mesh.loops), 2)
        values[loops] = uv
        layer.uv.foreach_set("vector", values.reshape(-1))
        mesh.update()
        return str(layer.name)


@contextmanager
def tried_map(meshes: Iterable[bpy.types.Mesh], name: str) -> Iterator[None]:
    """Meshes that can take it with a UV map of this name for the time, in which their faces have areas; one that is
    there is left as it is. A vertex has one place, as within a chart, so that faces made of its corners alone, as by
    Dual Mesh, have none."""
    given: list[bpy.types.Mesh] = []
    try:
        for mesh in meshes:
            if name not in mesh.uv_layers:
                layer = _own_layer(mesh, mesh.name, name, activate=False)
                given.append(mesh)
                places = vertices_of(mesh, np.arange(len(mesh.loops)))[:, np.newaxis] * _SCATTER % 1.0
                layer.uv.foreach_set("vector", places.astype(np.float32).reshape(-1))
        yield
    finally:
        for mesh in given:
            mesh.uv_layers.remove(mesh.uv_layers[name])
            mesh.update()


def _own_layer(mesh: bpy.types.Mesh, owner: str, name: str, activate: bool) -> Any:
    layers: Any = mesh.uv_layers
    active, shown = layers.active_index, next((layer.name for layer in layers if layer.active_render), None)
    layer = layers.get(name) or layers.new(name=name, do_init=False)
    if layer is None:
        raise InputError(f"{owner}: Blender has no room for another UV map on its mesh; remove one")
    name = layer.name
    if activate:
        layers.active = layer
    elif active >= 0:
        layers.active_index = active
    if shown is not None:
        layers[shown].active_render = True
    return layers[name]
