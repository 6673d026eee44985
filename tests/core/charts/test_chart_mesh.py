"""What lies across each edge, however a mesh was put together."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from occlusion_bake.core.charts.chart_mesh import (
    ChartMesh,
    components,
    connected,
    corner_classes,
    following,
    places,
    triangle_groups,
)
from occlusion_bake.tests.oracles.charts.hard_surface import cube, prism
from occlusion_bake.tests.oracles.charts.organic import waves

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
TWO = np.array([[0, 1, 2], [0, 2, 3]])


def mesh_of(points: Any, triangles: Any, polygon: Any = None, seams: Any = None) -> ChartMesh:
    triangles = np.asarray(triangles, np.int64)
    own = np.arange(len(triangles), dtype=np.int64) if polygon is None else np.asarray(polygon, np.int64)
    return connected(np.asarray(points, float), triangles, own, seams)


def groups(mesh: ChartMesh) -> list[int]:
    return triangle_groups(mesh, mesh.twin >= 0)[0].tolist()


@pytest.mark.parametrize("kind", [cube(), prism(9), waves(6)], ids=["cube", "prism", "waves"])
def test_twins_are_mutual_and_run_the_other_way(kind: Any) -> None:
    vertices, triangles, polygons = kind
    mesh = mesh_of(vertices, triangles, polygons)
    inner = np.flatnonzero(mesh.twin >= 0)
    assert (mesh.twin[mesh.twin[inner]] == inner).all()
    ends = mesh.triangles.ravel()
    assert (ends[inner] == ends[following(mesh.twin[inner])]).all()
    assert np.allclose(mesh.points[mesh.triangles], vertices[triangles])
    closed = len(inner) == 3 * len(triangles)
    assert closed == (len(mesh.points) - len(inner) // 2 + len(triangles) == 2)


def test_loose_triangles_in_place_are_one_surface() -> None:
    vertices, triangles, polygons = waves(5)
    whole = mesh_of(vertices, triangles, polygons)
    loose = mesh_of(
        vertices[triangles].reshape(-1, 3), np.arange(3 * len(triangles), dtype=np.int64).reshape(-1, 3), polygons
    )
    assert (loose.twin == whole.twin).all()
    assert len(loose.points) == len(whole.points)


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("shared", [False, True])
def test_two_sheets_in_one_place_stay_two(turned: bool, shared: bool) -> None:
    second = TWO[:, ::-1] if turned else TWO
    points = SQUARE if shared else np.concatenate([SQUARE, SQUARE])
    triangles = np.concatenate([TWO, second if shared else second + 4])
    polygon = np.array([0, 0, 1, 1])
    mesh = mesh_of(points, triangles, polygon)
    inner = np.flatnonzero(mesh.twin >= 0)
    within = inner[(mesh.normals[inner // 3] == mesh.normals[mesh.across[inner]]).all(axis=1)]
    assert len(within) == 4, "each sheet hangs together by its diagonal"
    assert (polygon[within // 3] == polygon[mesh.across[within]]).all()
    assert turned or len(inner) == 4, "sheets that face the same way have no edge in common"


def test_fins_on_an_edge_leave_a_surface() -> None:
    """Three triangles at an edge: two that turn the same way go on into one another, the third begins there."""
    points = np.concatenate([SQUARE, [[0, 0, 1]]])
    mesh = mesh_of(points, [[0, 1, 2], [0, 2, 3], [0, 2, 4]])
    assert groups(mesh) == [0, 0, 1]
    assert len(mesh.points) == 4 + 3  # the fin has vertices of its own


def test_triangles_that_turn_otherwise_are_no_neighbours() -> None:
    assert groups(mesh_of(SQUARE, [[0, 1, 2], [0, 3, 2]])) == [0, 1]


def test_sheets_that_meet_in_a_vertex_part_there() -> None:
    points = np.concatenate([SQUARE, [[2, 1, 0], [2, 2, 0]]])
    mesh = mesh_of(points, [*TWO, [2, 4, 5]])
    assert groups(mesh) == [0, 0, 1]
    assert len(mesh.points) == 7


def test_a_polygon_whose_triangles_do_not_touch_is_one_group() -> None:
    points = np.concatenate([SQUARE, SQUARE + 5.0])
    mesh = mesh_of(points, [[0, 1, 2], [4, 5, 6]], [0, 0])
    assert groups(mesh) == [0, 0]
    assert triangle_groups(mesh, mesh.twin >= 0, np.array([0, 1]))[1] == 2


def test_creases_and_seams() -> None:
    """0 on a plane, 1 at a cube's edges and at an edge that is marked, on both its sides."""
    flat = mesh_of(SQUARE, TWO)
    assert flat.crease(np.array([2, 3])).tolist() == [0.0, 0.0]
    vertices, triangles, polygons = cube()
    box = mesh_of(vertices, triangles, polygons)
    between = polygons[box.across] != np.repeat(polygons, 3)
    assert np.allclose(box.crease(np.flatnonzero(between)), 1.0)
    assert np.allclose(box.crease(np.flatnonzero(~between)), 0.0)
    marked = np.zeros((2, 3), bool)
    marked[0, 2] = True
    seamed = mesh_of(SQUARE, TWO, seams=marked)
    assert seamed.seam.tolist() == [False, False, True, True, False, False]
    assert seamed.crease(np.array([2, 3])).tolist() == [1.0, 1.0]


def test_a_part_is_the_mesh_of_its_triangles() -> None:
    vertices, triangles, polygons = waves(6)
    mesh = mesh_of(vertices, triangles, polygons)
    chosen = np.flatnonzero(np.arange(len(triangles), dtype=np.int64) % 7 < 4)
    part, alone = mesh.part(chosen), mesh_of(vertices, triangles[chosen], polygons[chosen])
    assert (part.twin == alone.twin).all()
    assert np.array_equal(part.corners, alone.corners)
    assert (np.diff(part.polygon) >= 0).all()


def test_places() -> None:
    points = np.array([[0.0, 1, 2], [-0.0, 1, 2], [2, 1, 0], [0, 1, 2 + 1e-12]])
    number = places(points)
    assert number[0] == number[1]
    assert len(set(number.tolist())) == 3


def test_components() -> None:
    label, count = components(6, np.array([4, 1, 5]), np.array([2, 1, 4]))
    assert (label.tolist(), count) == ([0, 1, 2, 3, 2, 2], 4)
    assert components(0, np.zeros(0, np.int64), np.zeros(0, np.int64))[1] == 0


def test_a_slit_parts_the_corners_beside_it_and_not_its_end() -> None:
    """Four triangles round a point, cut along one spoke: the rim's end of the spoke is two vertices, the hub one."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]], float)
    mesh = mesh_of(points, [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]])
    joined = mesh.twin >= 0
    assert corner_classes(mesh.twin, joined)[1] == 5
    joined[[0, mesh.twin[0]]] = False
    vertex, count = corner_classes(mesh.twin, joined)
    assert count == 6
    assert len(set(vertex.reshape(-1, 3)[:, 0].tolist())) == 1
