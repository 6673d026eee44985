"""What charts are made of: the mesh before modifiers, its triangles, and the edges that are marked."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.addon.charts.base_mesh import base_triangles  # noqa: E402
from occlusion_bake.core.charts.unwrap import unwrap  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402

pytestmark = pytest.mark.usefixtures("empty_scene")

STRIP = ((0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0), (1, 1, 0), (2, 1, 0), (1, 2, 0))
FACES = ((0, 1, 4, 3), (1, 2, 5, 6, 4), (4, 6, 3))  # a quad, a polygon of five corners, a triangle


def strip() -> Any:
    return blender.mesh("Strip", STRIP, FACES).data


def edge(mesh: Any, *ends: int) -> Any:
    return next(each for each in mesh.edges if set(each.vertices) == set(ends))


def marked(mesh: Any) -> set[tuple[int, int]]:
    """The marked edges of triangles, by their vertices in the order of the triangle."""
    obj = next(obj for obj in bpy.data.objects if obj.data == mesh)
    base = base_triangles(bpy.context, obj)
    if base.seams is None:
        return set()
    assert base.seams.shape == base.triangles.shape and base.seams.dtype == np.bool_
    ends = np.stack([base.triangles, base.triangles[:, [1, 2, 0]]], axis=2)[base.seams]
    return {tuple(pair) for pair in ends.tolist()}


def test_a_seam_is_marked_on_both_of_its_sides() -> None:
    mesh = strip()
    edge(mesh, 1, 4).use_seam = True
    assert marked(mesh) == {(1, 4), (4, 1)}


def test_a_sharp_edge_counts_as_a_seam_does() -> None:
    mesh = strip()
    edge(mesh, 4, 6).use_edge_sharp = True
    edge(mesh, 0, 1).use_seam = True
    assert marked(mesh) == {(4, 6), (6, 4), (0, 1)}


def test_what_cuts_a_polygon_into_triangles_is_no_seam() -> None:
    """All of the mesh's edges are: then exactly these are marked, and no diagonal."""
    mesh = strip()
    for each in mesh.edges:
        each.use_seam = True
    sides = {pair for face in FACES for pair in zip(face, (*face[1:], face[0]), strict=True)}
    assert marked(mesh) == sides


def test_flat_shaded_faces_have_no_sharp_edges() -> None:
    mesh = strip()
    for each in mesh.polygons:
        each.use_smooth = False
    assert marked(mesh) == set()


def test_where_every_edge_is_sharp_none_is_marked() -> None:
    """As some importers leave meshes of flat faces; all seams are another matter."""
    mesh = strip()
    for each in mesh.edges:
        each.use_edge_sharp = True
    assert marked(mesh) == set()
    edge(mesh, 1, 4).use_seam = True
    assert marked(mesh) == {(1, 4), (4, 1)}


def test_flat_faces_beside_others_are_no_more_than_flat() -> None:
    """An import of flat faces joined with what is smooth, or with a loose edge: marked is where they meet."""
    mesh = strip()
    for each in mesh.edges:
        each.use_edge_sharp = set(each.vertices) != {5, 6}
    assert marked(mesh) == {(1, 4), (4, 1), (4, 6), (6, 4), (1, 2), (2, 5)}  # not 3 to 4, between two that are flat
    edge(mesh, 5, 6).use_edge_sharp = True
    mesh.edges.add(1)
    mesh.edges[-1].vertices = (0, 6)
    assert marked(mesh) == set()


@pytest.mark.parametrize("mark", ["use_seam", "use_edge_sharp"])
def test_marks_are_borders_of_charts_where_they_close_one(mark: str) -> None:
    """Two rows of quads are parted once all edges between them are marked."""
    rows = [(x, y, 0) for y in range(3) for x in range(3)]
    obj = blender.mesh("Rows", rows, [(i, i + 1, i + 4, i + 3) for i in (0, 1, 3, 4)])
    for ends, count in (((3, 4), 1), ((4, 5), 2)):
        setattr(edge(obj.data, *ends), mark, True)
        base = base_triangles(bpy.context, obj)
        charts = unwrap("Rows", base.vertices, base.triangles, base.polygons, size=64, seams=base.seams)
        assert charts.count == count


def test_seams_of_an_edit_in_progress() -> None:
    mesh = strip()
    blender.select(bpy.data.objects["Strip"])
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.mark_seam(clear=False)
    assert (1, 4) in marked(mesh)


def test_a_mesh_without_faces() -> None:
    points = blender.mesh("Points", ((0, 0, 0), (1, 0, 0)), ())
    points.data.edges.add(1)
    points.data.edges[0].vertices, points.data.edges[0].use_seam = (0, 1), True
    base = base_triangles(bpy.context, points)
    assert base.seams is None and base.triangles.shape == (0, 3)
