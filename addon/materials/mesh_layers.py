"""What a mesh of Blender's holds by its corners and faces, as arrays: UV maps, tangents, material slots."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from ...core.base.arrays import Floats, Ints
from ...core.base.errors import InputError
from .texel_values import Lookup


def values_of(collection: Any, name: str, count: int, width: int) -> Floats:
    """(count, width) float32: an attribute of the members of a collection."""
    values = np.empty((count, width), dtype=np.float32)
    collection.foreach_get(name, values.reshape(-1))
    return values


def tangents_of(mesh: bpy.types.Mesh, owner: str, layer: str, corners: Ints, what: str) -> Floats:
    """(T, 3, 4) float32: MikkTSpace tangents of a UV map, and the bitangents' signs. what: for which they are needed,
    to be told in the error. Raises InputError where there are none."""
    try:
        mesh.calc_tangents(uvmap=layer)
    except RuntimeError:  # Blender takes triangles and quads alone
        raise InputError(
            f"{owner}: it has faces of more than four corners, which have no tangents; add a Triangulate modifier, or "
            f"bake without {what}"
        ) from None
    loops = len(mesh.loops)
    parts = [values_of(mesh.loops, "tangent", loops, 3), values_of(mesh.loops, "bitangent_sign", loops, 1)]
    mesh.free_tangents()
    return np.ascontiguousarray(np.concatenate(parts, axis=1)[corners])


def materials_of(obj: bpy.types.Object) -> list[bpy.types.Material | None]:
    """Those of an object's slots; none in the place of the slots that it has not."""
    return [slot.material for slot in obj.material_slots] or [None]


def slots_of(mesh: bpy.types.Mesh, polygons: Ints, count: int) -> Ints:
    """(T,) int32: which of so many material slots each triangle has, of its polygons' indices."""
    indices = np.zeros(len(mesh.polygons), dtype=np.int32)
    attribute: Any = mesh.attributes.get("material_index")
    if attribute is not None:
        attribute.data.foreach_get("value", indices)
    slots: Ints = np.clip(indices[polygons], 0, count - 1)  # as Cycles takes those too high
    return slots


def places_of(mesh: bpy.types.Mesh, lookup: Lookup, corners: Ints) -> Floats:
    """(N, 3, 2) float32: where triangles' corners lie in a texture. On a map that is not there all lie at 0."""
    layer, loops = uv_map(mesh, lookup.uv), len(mesh.loops)
    uv = np.zeros((loops, 2), dtype=np.float32) if layer is None else values_of(layer.uv, "vector", loops, 2)
    matrix = np.array(lookup.matrix)
    placed: Floats = (uv[corners] @ matrix[:, :2].T + matrix[:, 2]).astype(np.float32)
    return placed


def uv_map(mesh: bpy.types.Mesh, name: str) -> Any:
    """The UV map of this name, of none the one for renders; None where it is not there."""
    if name:
        return mesh.uv_layers.get(name)
    return next((layer for layer in mesh.uv_layers if layer.active_render), None)
