"""Blender's meshes as arrays: places, triangles, UVs, normals."""

from __future__ import annotations

import ctypes
from typing import Any

import bpy
import numpy as np

from ...core.base.arrays import Flags, Floats, Ints
from ...core.base.errors import InputError
from ...core.base.triangles import unit_normals
from ...core.scene.scene import Mesh
from ..materials.mesh_layers import tangents_of, values_of

_WITH_TANGENTS = "a directional code and bent normals in tangent space"


def read_shape(mesh: bpy.types.Mesh) -> Mesh:
    """Vertices and triangles alone: all that an occluder needs."""
    return Mesh(mesh.name, positions_of(mesh), vertices_of(mesh, corners_of(mesh)))


def read_surface(mesh: bpy.types.Mesh, owner: str, uv: str | None, *, unwrapped: bool, tangents: bool) -> Mesh:
    """A mesh that is baked, or baked from. unwrapped: with its UVs, of the map `uv` (None: the active one), where it
    has faces. tangents: with those of its UVs. Raises InputError where it lacks either."""
    corners = corners_of(mesh)
    vertices, triangles = positions_of(mesh), vertices_of(mesh, corners)
    layer = _uv_layer(mesh, owner, uv) if unwrapped and len(corners) else None
    layout = None if layer is None else values_of(layer.uv, "vector", len(mesh.loops), 2)[corners]
    along = None
    if layer is not None and tangents:
        along = tangents_of(mesh, owner, layer.name, corners, _WITH_TANGENTS)
    normals = _normals(mesh, vertices, triangles, corners)
    return Mesh(mesh.name, vertices, triangles, layout, normals, corners, along, layer.name if layer else "")


def _uv_layer(mesh: bpy.types.Mesh, owner: str, name: str | None) -> Any:
    """The named UV map or the active one, None where the mesh has none. Raises InputError for a name it lacks."""
    layers = mesh.uv_layers
    if name is None:
        return active_map(mesh)
    if name not in layers:
        cure = (
            f"choose one of those it has: {', '.join(layer.name for layer in layers)}" if layers else "unwrap it first"
        )
        raise InputError(f"{owner}: no UV map named {name}; {cure}")
    return layers[name]


def active_map(mesh: bpy.types.Mesh) -> Any:
    """The UV map that is baked onto where none is asked for, None where the mesh has none.

    Of meshes that nodes make, Blender up to 4.5 may call a map active that is not among them, for it has no name.
    """
    layers = mesh.uv_layers
    if layers.active is not None and layers.active.name in layers:
        return layers.active
    return layers[0] if layers else None


def _normals(mesh: bpy.types.Mesh, vertices: Floats, triangles: Ints, corners: Ints) -> Floats | None:
    """(T, 3, 3) shading normals as this Blender's Cycles takes them, None where all faces are flat.

    Measured by normal bakes: a wholly flat mesh is flat triangle by triangle, even where a polygon is not planar. In a
    mesh with smooth faces too, a flat polygon is so up to Blender 5.1 unless the mesh has custom normals; from 5.2 on
    it has one normal.
    """
    if mesh.normals_domain == "FACE":
        return None
    normals = values_of(mesh.corner_normals, "vector", len(mesh.loops), 3)[corners]
    if mesh.normals_domain == "CORNER" and bpy.app.version < (5, 2):
        flatten(mesh, normals, vertices, triangles)
    return normals


def flatten(mesh: bpy.types.Mesh, normals: Floats, vertices: Floats, triangles: Ints) -> None:
    """Give triangles of flat-shaded polygons their own normal; a mesh with custom normals has none up to Blender 5.1.

    normals: (T, 3, 3), changed in place.
    """
    if not (mesh.has_custom_normals and bpy.app.version < (5, 2)):
        flat = flat_triangles(mesh)
        normals[flat] = _face_normals(vertices, triangles[flat])[:, np.newaxis]


def flat_triangles(mesh: bpy.types.Mesh) -> Flags:
    """(T,) bool: triangles of flat-shaded polygons."""
    sharp: Any = mesh.attributes.get("sharp_face")
    if sharp is None:
        return np.zeros(len(mesh.loop_triangles), dtype=np.bool_)
    faces = np.empty(len(mesh.polygons), dtype=np.bool_)
    sharp.data.foreach_get("value", faces)
    return faces[polygons_of(mesh)]


def _face_normals(vertices: Floats, triangles: Ints) -> Floats:
    """(T, 3) unit normals by the right-hand rule; zero for a triangle without area."""
    return unit_normals(vertices[triangles].astype(np.float64)).astype(np.float32)


def positions_of(mesh: bpy.types.Mesh) -> Floats:
    if not len(mesh.vertices):
        return np.empty((0, 3), dtype=np.float32)
    position: Any = mesh.attributes["position"]
    return values_of(position.data, "vector", len(mesh.vertices), 3)


def vertices_of(mesh: bpy.types.Mesh, corners: Ints) -> Ints:
    """(T, 3) vertex indices of corner indices."""
    if not len(mesh.loops):
        return corners
    attribute: Any = mesh.attributes[".corner_vert"]
    vertex = np.empty(len(mesh.loops), dtype=np.int32)
    attribute.data.foreach_get("value", vertex)
    return vertex[corners]


def polygons_of(mesh: bpy.types.Mesh) -> Ints:
    polygons = np.empty(len(mesh.loop_triangles), dtype=np.int32)
    mesh.loop_triangle_polygons.foreach_get("value", polygons)
    return polygons


def corners_of(mesh: bpy.types.Mesh) -> Ints:
    """(T, 3) corner indices of the triangles.

    Blender holds them as one array of three int32 a triangle, which can be copied whole: its own call takes 0.16 μs a
    triangle. That layout is no promise, so it is checked on a sample, addresses first, and else the call is used.
    """
    triangles = mesh.loop_triangles
    corners = np.empty((len(triangles), 3), dtype=np.int32)
    if not len(triangles):
        return corners
    start, size = triangles[0].as_pointer(), corners.strides[0]
    sample = np.unique(np.linspace(0, len(triangles) - 1, 64).astype(np.int64)).tolist()
    if all(triangles[i].as_pointer() == start + i * size for i in sample):
        ctypes.memmove(corners.ctypes.data, start, corners.nbytes)
        if all(tuple(triangles[i].loops) == tuple(corners[i].tolist()) for i in sample):
            return corners
    triangles.foreach_get("loops", corners.reshape(-1))
    return corners
