"""The artist's own mesh, before modifiers: its triangles for charts, and where it is marked to be cut."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from ...core.base.arrays import Flags, Floats, Ints
from ..read.blender_state import object_mode
from ..read.mesh_arrays import corners_of, polygons_of, positions_of, vertices_of
from ..typed import mesh_of


@dataclass(frozen=True, eq=False)
class BaseTriangles:
    """A mesh as the artist made it, before modifiers.

    vertices: (V, 3) float32. triangles: (T, 3) int32 vertices, loops: (T, 3) int32 corners, polygons: (T,) int32.
    seams: (T, 3) bool, edge i from corner i to i + 1 is a marked seam or sharp edge; None where none is.
    """

    vertices: Floats
    triangles: Ints
    loops: Ints
    polygons: Ints
    seams: Flags | None


def base_triangles(context: bpy.types.Context, obj: bpy.types.Object) -> BaseTriangles:
    """Triangles of the object's original mesh data, edits in progress among them."""
    mesh = mesh_of(obj)
    with object_mode(context):
        loops = corners_of(mesh)
        triangles, polygons = vertices_of(mesh, loops), polygons_of(mesh)
        return BaseTriangles(positions_of(mesh), triangles, loops, polygons, _seams_of(mesh, loops))


def _seams_of(mesh: bpy.types.Mesh, loops: Ints) -> Flags | None:
    """(T, 3) bool: triangles' edges that the artist marked; None where there are none. Those within a polygon never
    are, nor those that are sharp only as their faces are flat."""
    marked = _marked(mesh, "use_seam")
    sharp = _marked(mesh, "use_edge_sharp")
    if not sharp.all():  # as some importers leave it, which says no more than that the faces are flat
        marked |= sharp
    if not marked.any():
        return None
    edge, after = np.empty(len(mesh.loops), np.int32), _next_corners(mesh)
    attribute: Any = mesh.attributes[".corner_edge"]
    attribute.data.foreach_get("value", edge)
    following = loops[:, [1, 2, 0]]
    forward, backward = after[loops] == following, after[following] == loops
    found: Flags = marked[np.where(forward, edge[loops], edge[following])] & (forward | backward)
    return found if found.any() else None


def _marked(mesh: bpy.types.Mesh, mark: str) -> Flags:
    """(E,) bool: edges that have a mark; its attribute is called differently from one Blender to another."""
    flags = np.empty(len(mesh.edges), np.bool_)
    mesh.edges.foreach_get(mark, flags)
    return flags


def _next_corners(mesh: bpy.types.Mesh) -> Ints:
    """(L,) int32: the corner that follows each one in its polygon."""
    starts, sizes = np.empty(len(mesh.polygons), np.int32), np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("loop_start", starts)
    mesh.polygons.foreach_get("loop_total", sizes)
    after = np.arange(1, len(mesh.loops) + 1, dtype=np.int32)
    after[starts + sizes - 1] = starts
    return after
