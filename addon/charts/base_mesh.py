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
        return BaseTriangles(positions_of(mesh), triangles, loops, polygons, _seams_of(mesh, loops, triangles))


def _seams_of(mesh: bpy.types.Mesh, loops: Ints, triangles: Ints) -> Flags | None:
    """(T, 3) bool: triangles' edges that the artist marked; None where there are none. Those within a polygon never
    are, nor those that are sharp only as their faces are flat."""
    seams, sharp = _marked(mesh, "uv_seam", ".uv_seam"), _marked(mesh, "sharp_edge")
    if not len(loops) or not (seams | sharp).any():
        return None
    edges, ends = _edges_of(mesh)
    marked = seams | _not_merely_flat(mesh, edges, sharp)
    found = np.zeros(loops.shape, np.bool_)
    for corners in (loops, loops[:, [1, 2, 0]]):  # an edge is that of the corner where it begins in the polygon
        chosen = np.nonzero(marked[edges[corners]])
        here = np.stack([triangles[chosen], triangles[:, [1, 2, 0]][chosen]], axis=1)
        found[chosen] |= (np.sort(here, axis=1) == ends[edges[corners[chosen]]]).all(axis=1)
    return found if found.any() else None


def _not_merely_flat(mesh: bpy.types.Mesh, edges: Ints, sharp: Flags) -> Flags:
    """(E,) bool: the sharp edges of polygons that have others, too. Importers leave all edges of a flat face sharp,
    which says no more than that it is flat. edges: (L,) that which begins at each corner."""
    counts = np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("loop_total", counts)
    polygon = np.repeat(np.arange(len(counts), dtype=np.int64), counts)
    smooth = np.bincount(polygon, ~sharp[edges], len(counts)) > 0.0
    found = np.zeros_like(sharp)
    found[edges[smooth[polygon]]] = True
    return found & sharp


def _marked(mesh: bpy.types.Mesh, *names: str) -> Flags:
    """(E,) bool: edges that have a mark, which Blender calls one of these."""
    flags = np.zeros(len(mesh.edges), np.bool_)
    attribute: Any = next(filter(None, map(mesh.attributes.get, names)), None)
    if attribute is not None:
        attribute.data.foreach_get("value", flags)
    return flags


def _edges_of(mesh: bpy.types.Mesh) -> tuple[Ints, Ints]:
    """(L,) int32: the edge that begins at each corner; (E, 2) int32: the vertices of each edge, in rising order."""
    begins, ends = np.empty(len(mesh.loops), np.int32), np.empty((len(mesh.edges), 2), np.int32)
    for name, values in ((".corner_edge", begins), (".edge_verts", ends)):
        attribute: Any = mesh.attributes[name]
        attribute.data.foreach_get("value", values.reshape(-1))
    return begins, np.sort(ends, axis=1)
