"""UV triangles to texels, against a second way to do it: polygons clipped in float64, one texel at a time."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from occlusion_bake.core.base.errors import Cancelled, InputError
from occlusion_bake.core.base.kernel_api import Control
from occlusion_bake.core.rays.texel_surface import TexelSurface
from occlusion_bake.core.scene.world_mesh import WorldMesh
from occlusion_bake.core.texels.rasterize import Texels, owners_by_centre, rasterize
from occlusion_bake.tests.oracles import shapes

Points = list[tuple[float, float]]
SIZES = [(24, 17), (7, 31), (16, 16), (1, 9)]
TIE = 1e-6  # shares of a texel that count as equal


def cut(polygon: Points, axis: int, bound: float, sign: float) -> Points:
    """Sutherland and Hodgman: the part of a polygon on one side of a line."""
    kept: Points = []
    for here, there in zip(polygon, polygon[1:] + polygon[:1], strict=True):
        a, b = sign * (here[axis] - bound), sign * (there[axis] - bound)
        if a >= 0:
            kept.append(here)
        if a * b < 0:
            t = a / (a - b)
            kept.append((here[0] + t * (there[0] - here[0]), here[1] + t * (there[1] - here[1])))
    return kept


def clipped(corners: np.ndarray, x: int, y: int) -> Points:
    """The part of a triangle, in texels from the top left, that lies in one texel."""
    polygon: Points = [(float(p[0]), float(p[1])) for p in corners]
    for axis, low in ((0, x), (1, y)):
        polygon = cut(cut(polygon, axis, low, 1.0), axis, low + 1, -1.0)
    return polygon


def area_and_centroid(polygon: Points) -> tuple[float, np.ndarray]:
    if len(polygon) < 3:
        return 0.0, np.zeros(2)
    points = np.array(polygon)
    a, b = points[1:-1] - points[0], points[2:] - points[0]
    pieces = 0.5 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    total = pieces.sum()
    centroid = points[0] + (pieces[:, None] * (a + b) / 3).sum(axis=0) / (total or 1.0)
    return abs(float(total)), centroid


def in_texels(uv: np.ndarray, width: int, height: int) -> np.ndarray:
    """(T, 3, 2) float64: right and down from the top left corner."""
    place = uv.astype(np.float64)
    return np.stack([place[..., 0] * width, (1 - place[..., 1]) * height], axis=-1)


def by_clipping(uv: np.ndarray, width: int, height: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Owners, the sum of all coverages, and the owners' own, each (H, W)."""
    owner = np.full((height, width), -1, dtype=np.int64)
    best, total = np.zeros((height, width)), np.zeros((height, width))
    for index, corners in enumerate(in_texels(uv, width, height)):
        low = np.clip(np.floor(corners.min(axis=0)).astype(np.int64), 0, (width, height))
        high = np.clip(np.ceil(corners.max(axis=0)).astype(np.int64), 0, (width, height))
        for y in range(low[1], high[1]):
            for x in range(low[0], high[0]):
                share, _ = area_and_centroid(clipped(corners, x, y))
                total[y, x] += share
                if share > 0 and share >= best[y, x] - TIE:
                    owner[y, x], best[y, x] = index, max(best[y, x], share)
    return owner, total, best


def random_triangles(seed: int, count: int, spread: float = 0.3) -> np.ndarray:
    """(T, 3, 2) float32, some of which leave the unit square."""
    rng = np.random.default_rng(seed)
    middle = rng.uniform(-0.05, 1.05, (count, 1, 2))
    return (middle + rng.normal(0, spread, (count, 3, 2)) * rng.uniform(0.01, 1, (count, 1, 1))).astype(np.float32)


@cache
def trial(seed: int, size: tuple[int, int]) -> tuple[np.ndarray, Texels, np.ndarray, np.ndarray]:
    """Triangles, what the kernel makes of them, and what clipping does: owners and total coverage."""
    uv = random_triangles(seed, 40)
    return uv, rasterize("random", uv, *size), *by_clipping(uv, *size)[:2]


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("seed", range(4))
def test_coverage_and_owners_agree_with_clipping(seed: int, size: tuple[int, int]) -> None:
    _, texels, owner, total = trial(seed, size)
    assert_allclose(texels.coverage, np.minimum(total, 1), atol=1e-5)
    assert_array_equal(texels.owner, owner)
    assert texels.count == np.count_nonzero(texels.covered)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("seed", range(4))
def test_no_covered_texel_is_left_out(seed: int, size: tuple[int, int]) -> None:
    _, texels, _, total = trial(seed, size)
    assert np.all(texels.covered[total > 1e-9])
    assert not texels.covered[total == 0].any()
    assert np.all(texels.coverage[~texels.covered] == 0)


@pytest.mark.parametrize("threads", [1, 3])
def test_threads_do_not_matter(threads: int) -> None:
    uv, texels, _, _ = trial(0, SIZES[0])
    again = rasterize("random", uv, *SIZES[0], threads=threads)
    assert_array_equal(texels.owner, again.owner)
    assert_array_equal(texels.coverage, again.coverage)


def fan(cells: int, seed: int) -> np.ndarray:
    """(T, 3, 2): the unit square in jittered cells of two triangles each, exactly edge to edge."""
    rng = np.random.default_rng(seed)
    knots = np.stack(np.meshgrid(*[np.arange(cells + 1.0)] * 2), axis=-1)
    knots[1:-1, 1:-1] += rng.uniform(-0.15, 0.15, (cells - 1, cells - 1, 2))
    knots = (knots / cells).astype(np.float32)
    a, b, c, d = knots[:-1, :-1], knots[:-1, 1:], knots[1:, 1:], knots[1:, :-1]
    return np.stack([np.stack([a, b, c], 2), np.stack([a, c, d], 2)], 2).reshape(-1, 3, 2)


@pytest.mark.parametrize("cells", [1, 3, 40, 150])
def test_a_whole_chart_covers_every_texel_once(cells: int) -> None:
    texels = rasterize("chart", fan(cells, cells), 64, 48)
    assert texels.covered.all()
    assert_allclose(texels.coverage, 1, atol=1e-5)
    assert not any("overlap" in line or "leave" in line for line in texels.warnings)


def test_sub_texel_triangles_get_their_texels() -> None:
    uv = np.float32([[(5.2, 3.3), (5.6, 3.3), (5.2, 3.8)], [(9.9, 0.1), (10.1, 0.1), (10.1, 0.2)]]) / 16
    texels = rasterize("dust", uv, 16, 16)
    assert texels.count == 3
    assert texels.owner[12, 5] == 0  # row 3 from below is row 12 from the top
    assert_allclose(texels.coverage[12, 5], 0.1, atol=1e-6)
    assert texels.owner[15, 9] == texels.owner[15, 10] == 1
    assert_allclose(texels.coverage[15, 9] + texels.coverage[15, 10], 0.01, atol=1e-6)


def test_the_later_triangle_wins_a_tie() -> None:
    once = shapes.plane(1.0).uv
    texels = rasterize("twice", np.concatenate([once, once]), 8, 8)
    assert np.all(texels.owner >= 2)
    split = np.float32([[(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)]])
    assert np.all(np.diagonal(rasterize("halves", split, 8, 8).owner[::-1]) == 1)
    assert np.all(np.diagonal(rasterize("halves", split[::-1].copy(), 8, 8).owner[::-1]) == 1)


def test_the_larger_share_wins_over_the_later() -> None:
    most, rest = [(0, 0), (1, 0), (0, 1)], [(0.8, 0.8), (1, 0.8), (1, 1)]
    assert rasterize("both", np.float32([most, rest]), 1, 1).owner[0, 0] == 0
    assert rasterize("both", np.float32([rest, most]), 1, 1).owner[0, 0] == 1


def test_v_is_1_at_the_top_of_an_oblong_image() -> None:
    uv = shapes.quad((0, 0, 0), (1, 0, 0), (0, 1, 0), cell=(0, 0.75, 0.5, 1)).uv
    texels = rasterize("corner", uv, 16, 8)
    expected = np.zeros((8, 16), dtype=bool)
    expected[:2, :8] = True
    assert_array_equal(texels.covered, expected)
    assert np.all(texels.coverage[expected] == 1)


def test_mirrored_charts_are_drawn_too() -> None:
    uv = shapes.plane(1.0).uv * np.float32([-1, 1]) + np.float32([1, 0])
    assert rasterize("mirrored", uv, 8, 8).covered.all()


def test_skipped_triangles_get_nothing() -> None:
    uv = shapes.plane(1.0).uv
    texels = rasterize("half", uv, 8, 8, skip=np.array([True, False]))
    assert set(np.unique(texels.owner)) == {-1, 1}
    assert_allclose(texels.coverage.sum(), 32, atol=1e-3)


def test_uvs_that_leave_the_square_are_counted() -> None:
    quad = shapes.plane(1.0).uv
    texels = rasterize("Rock", np.concatenate([quad, quad * 0.5 + np.float32(0.75)]), 8, 8)
    assert "Rock: 2 triangles leave the 0-1 UV square; what lies outside is not baked" in texels.warnings
    assert texels.covered.all()


def test_degenerate_uvs_are_counted() -> None:
    uv = np.concatenate([shapes.plane(1.0).uv, np.zeros((3, 3, 2), np.float32), shapes.plane(1.0).uv * np.nan])
    texels = rasterize("Rock", uv.astype(np.float32), 8, 8)
    assert texels.warnings == ["Rock: 5 triangles have no area in the texture and get no texels"]


def test_overlap_is_counted() -> None:
    quad = shapes.plane(1.0).uv
    texels = rasterize("Rock", np.concatenate([quad, quad * 0.5]), 8, 8)
    assert texels.warnings == ["Rock: UVs overlap on 16 of 64 texels (25.0 %); each shows one of its faces"]
    assert np.all(texels.coverage == 1)


@pytest.mark.parametrize(
    ("change", "cause"),
    [
        (lambda uv: uv + np.float32(2), "outside the 0-1 square"),
        (lambda uv: uv * np.float32(0), "of 2 triangles 2 have no area"),
        (lambda uv: uv * np.float32(np.nan), "of 2 triangles 2 have no area"),
    ],
)
def test_uvs_that_cover_nothing_are_refused(change: Any, cause: str) -> None:
    with pytest.raises(InputError, match=cause) as refusal:
        rasterize("Rock", change(shapes.plane(1.0).uv), 8, 8)
    assert str(refusal.value).startswith("Rock: ")
    assert "\n" not in str(refusal.value)


def test_an_already_cancelled_rasterization_ends() -> None:
    with pytest.raises(Cancelled):
        rasterize("plane", shapes.plane(1.0).uv, 8, 8, control=Control(cancel=1))


@pytest.mark.parametrize("size", SIZES)
def test_owners_by_centre_are_the_last_triangles_over_a_point(size: tuple[int, int]) -> None:
    width, height = size
    uv = random_triangles(9, 60)
    expected = np.full((height, width), -1, dtype=np.int64)
    column, row = np.meshgrid(np.arange(width, dtype=np.int64), np.arange(height, dtype=np.int64))
    point = np.stack([(column + 0.501) / width, 1 - (row + 1 - 0.502) / height], axis=-1)
    for index, (a, b, c) in enumerate(uv.astype(np.float64)):
        sides = [
            (q[0] - p[0]) * (point[..., 1] - p[1]) - (q[1] - p[1]) * (point[..., 0] - p[0])
            for p, q in ((a, b), (b, c), (c, a))
        ]
        inside = np.all(np.array(sides) >= 0, axis=0) | np.all(np.array(sides) <= 0, axis=0)
        expected[inside] = index
    assert_array_equal(owners_by_centre(uv, width, height), expected)


@pytest.mark.parametrize("size", SIZES)
def test_surface_points_are_the_middles_of_the_footprints(size: tuple[int, int]) -> None:
    rng = np.random.default_rng(5)
    uv = trial(1, size)[0]
    owner = trial(1, size)[1].owner
    triangles = np.arange(3 * len(uv), dtype=np.int32).reshape(-1, 3)
    vertices = rng.normal(0, 1, (3 * len(uv), 3)).astype(np.float32)
    texels = TexelSurface(WorldMesh(vertices, triangles, uv), owner)
    positions, normals = texels.positions, texels.normals
    corners = in_texels(uv, *size)
    for y, x in np.argwhere(owner >= 0):
        share, centroid = area_and_centroid(clipped(corners[owner[y, x]], x, y))
        edges = (corners[owner[y, x]][1:] - corners[owner[y, x]][0]).T
        if share < 1e-3 or abs(np.linalg.det(edges)) < 1e-2:
            continue  # slivers, where float32 weights magnify rounding
        weights = np.linalg.solve(edges, centroid - corners[owner[y, x]][0])
        a, b, c = vertices[triangles[owner[y, x]]].astype(np.float64)
        assert_allclose(positions[y, x], a + weights[0] * (b - a) + weights[1] * (c - a), atol=2e-5)
        normal = np.cross(b - a, c - a)
        assert_allclose(normals[y, x], normal / np.linalg.norm(normal), atol=1e-5)
    assert np.all(positions[owner < 0] == 0) and np.all(normals[owner < 0] == 0)


def test_surface_points_lie_on_the_surface() -> None:
    sphere = shapes.sphere(segments=32)
    surface = WorldMesh(sphere.vertices, sphere.triangles, sphere.uv, sphere.normals)
    owner = rasterize("sphere", sphere.uv, 50, 40).owner
    texels = TexelSurface(surface, owner)
    positions, normals = texels.positions, texels.normals
    mask = owner >= 0
    a, b, c = (sphere.vertices[sphere.triangles[owner[mask], i]].astype(np.float64) for i in range(3))
    flat = np.cross(b - a, c - a)
    flat /= np.linalg.norm(flat, axis=1, keepdims=True)
    assert np.abs(np.sum((positions[mask] - a) * flat, axis=1)).max() < 2e-7  # 2^-22 of the largest coordinate
    assert_allclose(np.linalg.norm(normals[mask], axis=1), 1, atol=1e-6)
    toward = positions[mask] / np.linalg.norm(positions[mask], axis=1, keepdims=True)
    assert np.sum(normals[mask] * toward, axis=1).min() > np.cos(np.radians(1))  # smooth, where facets are off by 8°


@pytest.mark.parametrize(("side", "told"), [(8, True), (16, True), (128, False)])
def test_an_image_too_small_for_its_triangles_is_told(side: int, told: bool) -> None:
    """A net of 2 x 32 x 32 triangles: in an image of fewer texels than that most have none."""
    x, y = np.meshgrid(np.arange(32, dtype=np.int64) / 32, np.arange(32, dtype=np.int64) / 32)
    low = np.stack([x.ravel(), y.ravel()], axis=-1)
    corners = [low + np.array(shift) / 32 for shift in ((0, 0), (1, 0), (1, 1), (0, 1))]
    uv = np.concatenate([np.stack([corners[0], corners[i], corners[i + 1]], axis=1) for i in (1, 2)])
    texels = rasterize("Net", uv.astype(np.float32), side, side)
    owned = len(np.unique(texels.owner[texels.owner >= 0]))
    expected = [f"Net: {100 * (1 - owned / len(uv)):.0f} % of its surface"] if told else []
    assert [line[: len(expected[0])] for line in texels.warnings] == expected if told else texels.warnings == []
    assert texels.overlapped == 0


def test_texels_that_overlap_are_counted() -> None:
    square = np.float32([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]])
    texels = rasterize("Twice", np.concatenate([square, square]), 8, 8)
    assert texels.overlapped == 64
