"""The judges of charts find what is wrong: each fault that they look for, put into a layout of which all is known."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from occlusion_bake.tests.oracles.charts.judge import charts_of, judged, stretch
from occlusion_bake.tests.oracles.charts.overlaps import overlaps
from occlusion_bake.tests.oracles.charts.polygon_mesh import PolygonMesh, copies, of_faces
from occlusion_bake.tests.oracles.charts.texel_gaps import kept_padding

SIZE = (64, 32)
SQUARE = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])


def squares(*corners: tuple[float, float, float]) -> tuple[PolygonMesh, Any]:
    """Loose squares of side 1 in space; in the layout, by place and side in texels."""
    flat = np.concatenate([SQUARE, np.zeros((4, 1))], axis=1)
    mesh = copies(
        [flat + np.array([3.0 * number, 0.0, 0.0]) for number in range(len(corners))], np.arange(4, dtype=np.int64)
    )
    texels = np.concatenate([np.array([x, y]) + side * SQUARE for x, y, side in corners])
    return mesh, (texels[mesh.triangles] / SIZE).astype(np.float32)


def test_a_layout_without_a_fault() -> None:
    found = judged(*squares((1, 1, 8), (13, 1, 8), (1, 13, 8)), SIZE)
    assert (found.triangles, found.charts, found.padding, found.overlaps) == (6, 3, 4, 0)
    assert (found.mirrored, found.collapsed, found.torn, found.deepest) == (0, 0, 0, 0.0)
    assert found.outside <= 0.0
    assert found.used == pytest.approx(3 * 64 / (64 * 32))
    assert found.l2 == pytest.approx(1.0)
    assert found.p95 == pytest.approx(1.0)
    assert found.uneven == pytest.approx(0.0, abs=1e-6)


def test_an_overlap_is_as_deep_as_the_way_out_of_it() -> None:
    found = judged(*squares((1, 1, 8), (8.75, 4, 8)), SIZE)
    assert found.overlaps > 0
    assert found.padding == -1
    assert found.deepest == pytest.approx(0.25, abs=1e-5)


def test_what_touches_does_not_overlap() -> None:
    assert judged(*squares((1, 1, 8), (9, 1, 8), (9, 9, 8)), SIZE).overlaps == 0


def test_overlaps_are_those_whose_common_part_has_an_area() -> None:
    rng = np.random.default_rng(1)
    corners = rng.uniform(0, 40, (60, 1, 2)) + rng.normal(size=(60, 3, 2)) * 10.0 ** rng.uniform(-0.5, 1.2, (60, 1, 1))
    pairs, depths = overlaps(corners, 1e-6)
    assert (depths > 1e-6).all()
    shared = {(i, j) for j in range(60) for i in range(j) if len(common_part(corners[i], corners[j])) > 2}
    assert len(shared) > 50
    assert {tuple(pair) for pair in pairs.tolist()} == shared


def common_part(one: Any, other: Any) -> list[Any]:
    """The polygon that two triangles share, the one cut by the other's edges (Sutherland and Hodgman 1974)."""
    polygon = list(one)
    turn = np.sign(cross(other[1] - other[0], other[2] - other[0]))
    for a, b in zip(other, np.roll(other, -1, axis=0), strict=True):
        side = [turn * cross(b - a, point - a) for point in polygon]
        cut = []
        for number, (point, here) in enumerate(zip(polygon, side, strict=True)):
            if here * side[number - 1] < 0.0:
                cut.append(point + here / (here - side[number - 1]) * (polygon[number - 1] - point))
            if here > 0.0:
                cut.append(point)
        polygon = cut
    return polygon


def cross(a: Any, b: Any) -> Any:
    return a[0] * b[1] - a[1] * b[0]


def test_needles_that_cross_are_found() -> None:
    """200 needles of 0.1 texel across one another: bounding boxes and all corners are far apart."""
    at = np.linspace(0.0, 50.0, 100)
    upright = np.stack(
        [np.stack([at, 0 * at], 1), np.stack([at + 0.1, 0 * at], 1), np.stack([at, 0 * at + 50.1], 1)], 1
    )
    pairs, _ = overlaps(np.concatenate([upright, upright[..., ::-1]]), 1e-3)
    assert len(pairs) > 4900
    assert (pairs[:, 0] < 100).all() and (pairs[:, 1] >= 100).all()


@pytest.mark.parametrize(
    ("x", "y", "kept"), [(10, 1, 1), (9, 1, 0), (8.9, 1, -1), (9.5, 1, 0), (11.99, 9, 2), (11.9995, 9, 3), (20, 10, 4)]
)
def test_padding_counts_texels_that_are_touched_at_all(x: float, y: float, kept: int) -> None:
    """Beside a square from 1 to 9: the first texel free is 9; half a texel of the other's takes a whole one."""
    mesh, uv = squares((1, 1, 8), (x, y, 8))
    chart = charts_of(mesh, uv)
    assert kept_padding(uv.astype(float) * SIZE, chart, *SIZE, 4) == kept


def test_thin_charts_are_seen_between_the_texels_centres() -> None:
    corners = np.array([[(1.1, 1.1), (30.0, 1.1), (30.0, 1.2)], [(1.1, 3.1), (30.0, 3.1), (30.0, 3.2)]])
    assert kept_padding(corners, np.arange(2, dtype=np.int64), *SIZE, 4) == 1


def test_mirrored_collapsed_outside_and_torn() -> None:
    mesh, uv = squares((1, 1, 8), (20, 1, 8), (40, 1, 8))
    uv[0] = uv[0, ::-1]
    uv[2] = uv[2, :1]
    uv[4:] += np.float32(0.5)
    found = judged(mesh, uv, SIZE)
    assert found.mirrored == 1
    assert found.collapsed == 1
    mesh.vertices[4:8, 1] *= np.float32(1e-9)
    assert judged(mesh, uv, SIZE).collapsed == 0  # of what is too thin for float32 nothing is asked
    assert found.outside == pytest.approx(40 + 8 + 32 - 64)
    assert found.torn == 2


def test_a_chart_twice_as_large_is_uneven() -> None:
    found = judged(*squares((1, 1, 8), (13, 1, 8), (25, 1, 4)), SIZE)
    assert found.uneven == pytest.approx(3.0)


def test_stretch_of_a_square_drawn_twice_as_wide() -> None:
    """Singular values 1/2 and 1, brought to one area by the root of 2."""
    mesh = of_faces(np.concatenate([SQUARE, np.zeros((4, 1))], axis=1), [[0, 1, 2, 3]])
    l2, p95 = stretch(mesh.corners, SQUARE[mesh.triangles] * (2.0, 1.0))
    assert l2 == pytest.approx(np.sqrt((0.25 + 1.0) / 2 * 2))
    assert p95 == pytest.approx(l2)


def test_charts_are_told_apart_by_the_edges_of_the_mesh() -> None:
    """Two squares joined along an edge, in the layout too, be its vertices shared or not; then parted in the mesh."""
    points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 0, 0), (2, 1, 0)]
    mesh = of_faces(points, [[0, 1, 2, 3], [1, 4, 5, 2]])
    uv = (mesh.vertices[mesh.triangles][..., :2] / 4).astype(np.float32)
    assert len(np.unique(charts_of(mesh, uv))) == 1
    loose = of_faces([*points, points[1]], [[0, 1, 2, 3], [6, 4, 5, 2]])
    assert len(np.unique(charts_of(loose, uv))) == 1
    parted = of_faces([*points, (1, 0, 1)], [[0, 1, 2, 3], [6, 4, 5, 2]])
    assert len(np.unique(charts_of(parted, uv))) == 2
    moved = uv.copy()
    moved[2:] += np.float32(0.25)
    assert len(np.unique(charts_of(mesh, moved))) == 2
