"""Charts flattened: what can be developed keeps its shape, what cannot comes near to it, and nothing is mirrored."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from occlusion_bake.core.base.arrays import Doubles, Longs
from occlusion_bake.core.base.errors import Cancelled, InputError
from occlusion_bake.core.base.kernel_api import Control
from occlusion_bake.core.charts.flatten import FLATTENED, NOT_A_DISK, NOT_FLAT, NOT_TRIED, flattened

Mesh = tuple[Doubles, Longs]
Surface = Callable[[Doubles, Doubles], tuple[Doubles, Doubles, Doubles]]


def sheet(columns: int, rows: int, surface: Surface) -> Mesh:
    """A grid of columns x rows quads over the unit square, two triangles each, on a surface."""
    u, v = np.meshgrid(np.linspace(0.0, 1.0, columns + 1), np.linspace(0.0, 1.0, rows + 1), indexing="ij")
    points = np.stack(surface(u.ravel(), v.ravel()), axis=1)
    i, j = (
        grid.ravel()
        for grid in np.meshgrid(np.arange(columns, dtype=np.int64), np.arange(rows, dtype=np.int64), indexing="ij")
    )
    a = i * (rows + 1) + j
    b, c, d = a + rows + 1, a + rows + 2, a + 1
    return points, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


def tube(sides: int, rows: int = 1, turn: float = 2.0 * np.pi, height: float = 3.0) -> Mesh:
    """Part of a tube of radius 1, cut open along its length."""
    return sheet(sides, rows, lambda u, v: (np.cos(turn * u), np.sin(turn * u), height * v))


def cone(sides: int, rows: int) -> Mesh:
    """A truncated cone, cut open."""
    return sheet(sides, rows, lambda u, v: ((0.1 + v) * np.cos(6.0 * u), (0.1 + v) * np.sin(6.0 * u), 2.0 * (0.1 + v)))


def dome(sides: int, rings: int) -> Mesh:
    """Half a sphere of radius 1 with a vertex on top."""
    angle, tilt = (
        np.arange(sides, dtype=np.int64) * 2.0 * np.pi / sides,
        np.arange(1, rings + 1, dtype=np.int64)[:, None] * 0.5 * np.pi / rings,
    )
    ring = np.stack([np.sin(tilt) * np.cos(angle), np.sin(tilt) * np.sin(angle), np.cos(tilt) + 0.0 * angle], axis=2)
    here = 1 + np.arange(sides * (rings - 1), dtype=np.int64)
    beside = here + 1 - sides * (here % sides == 0)
    top = np.stack(
        [
            np.zeros(sides, np.int64),
            1 + np.arange(sides, dtype=np.int64),
            1 + (np.arange(sides, dtype=np.int64) + 1) % sides,
        ],
        axis=1,
    )
    quads = [np.stack([here, here + sides, beside + sides], 1), np.stack([here, beside + sides, beside], 1)]
    return np.concatenate([[[0.0, 0.0, 1.0]], ring.reshape(-1, 3)]), np.concatenate([top, *quads])


def elbow(sides: int, rows: int) -> Mesh:
    """Half of a bent pipe, cut along its length, skew: needles where it has many sides."""
    return sheet(
        sides,
        rows,
        lambda u, v: (
            (5.0 + np.cos(3.0 * u - v)) * np.cos(3.0 * v),
            (5.0 + np.cos(3.0 * u - v)) * np.sin(3.0 * v),
            np.sin(3.0 * u - v),
        ),
    )


def waves(columns: int, noise: float) -> Mesh:
    """A wavy sheet, rough by `noise` in units of its edges."""
    rough = noise / columns * np.random.default_rng(3).standard_normal((columns + 1) ** 2)
    return sheet(columns, columns, lambda u, v: (u, v, 0.1 * np.sin(6.0 * u) * np.cos(5.0 * v) + rough))


def doubled_areas(uv: Doubles, triangles: Longs) -> Doubles:
    edge1, edge2 = uv[triangles[:, 1]] - uv[triangles[:, 0]], uv[triangles[:, 2]] - uv[triangles[:, 0]]
    areas: Doubles = edge1[:, 0] * edge2[:, 1] - edge1[:, 1] * edge2[:, 0]
    return areas


def surface_areas(points: Doubles, triangles: Longs) -> Doubles:
    edge1, edge2 = points[triangles[:, 1]] - points[triangles[:, 0]], points[triangles[:, 2]] - points[triangles[:, 0]]
    areas: Doubles = 0.5 * np.linalg.norm(np.cross(edge1, edge2), axis=1)
    return areas


def stretch(points: Doubles, triangles: Longs, uv: Doubles) -> float:
    """L2 stretch (Sander et al. 2001, "Texture Mapping Progressive Meshes") of a map that keeps the area."""
    a, b, c = (points[triangles[:, corner]] for corner in range(3))
    p, q, r = (uv[triangles[:, corner]] for corner in range(3))
    doubled = doubled_areas(uv, triangles)[:, None]
    along_s = (a * (q - r)[:, 1:] + b * (r - p)[:, 1:] + c * (p - q)[:, 1:]) / doubled
    along_t = (a * (r - q)[:, :1] + b * (p - r)[:, :1] + c * (q - p)[:, :1]) / doubled
    area = surface_areas(points, triangles)
    return float(np.sqrt(np.average(0.5 * (along_s**2 + along_t**2).sum(axis=1), weights=area)))


def flatten_one(mesh: Mesh) -> tuple[Doubles, int]:
    points, triangles = mesh
    uv, _, state = flattened(points, triangles, np.array([0, len(triangles)]))
    return uv, int(state[0])


def check_sound(mesh: Mesh, uv: Doubles, state: int) -> None:
    points, triangles = mesh
    assert state == FLATTENED
    doubled = doubled_areas(uv, triangles)
    assert doubled.min() > 0.0
    assert np.isclose(0.5 * doubled.sum(), surface_areas(points, triangles).sum(), rtol=1e-9)


@pytest.mark.parametrize(
    "mesh",
    [
        tube(8),
        tube(10_000),  # needles of 1 to 5,000
        tube(3_000, 5, turn=1.0, height=0.5),
        tube(12, 300),
        cone(40, 30),
        cone(2_000, 4),
        sheet(20, 60, lambda u, v: (u, v, 0.2 * np.abs((5.0 * v) % 2.0 - 1.0))),  # folded
        sheet(1, 500, lambda u, v: (u, np.cos(40.0 * v) * (1.0 + v), np.sin(40.0 * v) * (1.0 + v))),  # rolled up
    ],
)
def test_what_can_be_developed_keeps_its_shape(mesh: Mesh) -> None:
    uv, state = flatten_one(mesh)
    check_sound(mesh, uv, state)
    points, triangles = mesh
    for corner in range(3):
        edge = triangles[:, [corner, corner - 1]]
        on_surface = np.linalg.norm(points[edge[:, 0]] - points[edge[:, 1]], axis=1)
        in_plane = np.linalg.norm(uv[edge[:, 0]] - uv[edge[:, 1]], axis=1)
        assert np.allclose(in_plane, on_surface, rtol=1e-6)


def test_a_flat_chart_keeps_its_shape_exactly() -> None:
    points, triangles = sheet(7, 5, lambda u, v: (0.6 * u, 0.8 * u, v))
    uv, state = flatten_one((points, triangles))
    assert state == FLATTENED
    assert np.allclose(np.linalg.norm(uv - uv[0], axis=1), np.linalg.norm(points - points[0], axis=1), rtol=1e-14)


def test_a_single_triangle_of_any_size() -> None:
    for size in (1e-30, 1.0, 1e50):
        mesh = size * np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 0.0, 4.0]]), np.array([[0, 1, 2]])
        uv, state = flatten_one(mesh)
        check_sound(mesh, uv, state)
        assert np.allclose(np.linalg.norm(uv - np.roll(uv, 1, axis=0), axis=1), [4.0 * size, 3.0 * size, 5.0 * size])


# The optimum of the symmetric Dirichlet energy, by Newton's method on all vertices at once, has the first stretch.
@pytest.mark.parametrize(
    ("mesh", "optimum"),
    [(dome(32, 12), 1.02482), (dome(128, 32), 1.02404), (dome(1_000, 8), 1.02452), (dome(10_000, 4), 1.0260)],
)
def test_a_dome_comes_near_to_its_least_stretch(mesh: Mesh, optimum: float) -> None:
    uv, state = flatten_one(mesh)
    check_sound(mesh, uv, state)
    assert stretch(*mesh, uv) < 1.005 * optimum


@pytest.mark.parametrize("rows", [4, 12])
def test_cutting_finely_in_one_direction_costs_no_stretch(rows: int) -> None:
    coarse = elbow(64, rows)
    least = stretch(*coarse, flatten_one(coarse)[0])
    assert least < 1.1
    for sides in (512, 2_048):
        mesh = elbow(sides, rows)
        uv, state = flatten_one(mesh)
        check_sound(mesh, uv, state)
        assert stretch(*mesh, uv) < 1.01 * least


@pytest.mark.parametrize(("noise", "most"), [(0.1, 1.03), (0.5, 1.06), (1.0, 1.2), (4.0, 1.9)])
def test_a_rough_sheet_has_no_mirrored_triangle(noise: float, most: float) -> None:
    mesh = waves(60, noise)
    uv, state = flatten_one(mesh)
    check_sound(mesh, uv, state)
    assert stretch(*mesh, uv) < most


def test_points_at_random_in_space_leave_a_sound_map() -> None:
    points, triangles = sheet(40, 40, lambda u, v: (u, v, u))
    mesh = np.random.default_rng(7).standard_normal(points.shape), triangles
    uv, state = flatten_one(mesh)
    check_sound(mesh, uv, state)
    assert stretch(*mesh, uv) < 1.5


def test_triangles_without_area_stay_thin_and_upset_nothing() -> None:
    points, triangles = tube(40, 12, turn=3.0, height=2.0)
    # T-junctions: the edge of every third triangle is split, on its other side by a triangle without area
    corner = triangles[::3]
    middle = len(points) + np.arange(len(corner), dtype=np.int64)
    halves = [np.stack([corner[:, 0], middle, corner[:, 2]], 1), np.stack([middle, corner[:, 1], corner[:, 2]], 1)]
    without_area = np.stack([corner[:, 0], corner[:, 1], middle], axis=1)
    mesh = (
        np.concatenate([points, 0.5 * (points[corner[:, 0]] + points[corner[:, 1]])]),
        np.concatenate([np.delete(triangles, np.s_[::3], axis=0), *halves, without_area]),
    )
    uv, state = flatten_one(mesh)
    check_sound(mesh, uv, state)
    texels = (1000.0 * (uv - uv.min(axis=0)) / np.ptp(uv, axis=0).max()).astype(np.float32)
    assert doubled_areas(texels.astype(np.float64), mesh[1]).min() > 0.0
    edge = np.linalg.norm(uv[corner[:, 1]] - uv[corner[:, 0]], axis=1)
    off = np.linalg.norm(uv[middle] - 0.5 * (uv[corner[:, 0]] + uv[corner[:, 1]]), axis=1)
    assert (off < 1e-3 * edge).all()
    solid = surface_areas(*mesh) > 1e-9
    assert stretch(mesh[0], mesh[1][solid], uv) < 1.0001


def test_an_edge_without_length() -> None:
    points, triangles = tube(30, 30, turn=2.0, height=2.0)
    column, row = np.divmod(np.arange(len(points), dtype=np.int64), 31)
    inside = np.flatnonzero((column % 4 == 2) & (row % 4 == 2) & (column < 30))
    points[inside] = points[inside + 31]
    mesh = points, triangles
    uv, state = flatten_one(mesh)
    check_sound(mesh, uv, state)
    size = 2.0 / 30.0
    assert (np.linalg.norm(uv[inside] - uv[inside + 31], axis=1) < 2e-3 * size).all()


@pytest.mark.parametrize(
    "triangles",
    [
        [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]],  # closed
        [[0, 1, 2], [3, 4, 5]],  # two pieces
        [[0, 1, 2], [0, 3, 4]],  # two fans at a vertex
        [[0, 1, 2], [1, 0, 3], [0, 1, 4]],  # three at an edge
        [[0, 1, 2], [0, 1, 3]],  # two that turn against each other
        [[0, 1, 3], [1, 4, 3], [1, 2, 4], [2, 5, 4], [2, 0, 5], [0, 3, 5]],  # a ring
        [[0, 1, 3], [1, 4, 3], [1, 2, 4], [2, 5, 4], [2, 0, 5], [0, 5, 3], [0, 5, 3]],  # a face twice
        [[0, 1, 2], [2, 1, 3], [2, 3, 4], [4, 3, 0], [4, 0, 5]],  # one piece, a border vertex used twice
    ],
)
def test_what_is_no_disk_is_left_alone(triangles: list[list[int]]) -> None:
    points = np.random.default_rng(0).standard_normal((6, 3))
    uv, _, state = flattened(points, np.array(triangles), np.array([0, len(triangles)]))
    assert state[0] == NOT_A_DISK
    assert (uv == 0.0).all()


def test_a_chart_without_area_cannot_be_flat() -> None:
    line, point = np.outer(np.arange(4.0), [0.0, 2.0, 0.0]), np.ones((4, 3))
    for points in (line, point):
        uv, state = flatten_one((points, np.array([[0, 1, 2], [0, 2, 3]])))
        assert state == NOT_FLAT
        assert np.isfinite(uv).all()


def test_a_plane_of_any_outline_keeps_its_shape() -> None:
    """A ring, and two pieces that touch at a corner, with a triangle that has no area: of any size, turned at will."""
    turn = np.linalg.qr(np.random.default_rng(2).standard_normal((3, 3)))[0]
    ring = np.array([[0, 1, 3], [1, 4, 3], [1, 2, 4], [2, 5, 4], [2, 0, 5], [0, 3, 5]])
    flat = np.array([[0, 0], [4, 0], [0, 4], [1, 1], [2, 1], [1, 2], [8, -8], [8, 0]], np.float64)
    pieces = np.concatenate([ring[:2], [[1, 6, 7]], [[0, 3, 3]]])
    for triangles in (ring, pieces):
        points = 100.0 * np.pad(flat, ((0, 0), (0, 1))) @ turn.T + 7.0
        for most in (0, None):
            uv, stretch, state = flattened(points, triangles, np.array([0, len(triangles)]), most=most)
            assert state.tolist() == [FLATTENED]
            lengths = np.linalg.norm(points[triangles] - points[np.roll(triangles, 1, axis=1)], axis=2)
            drawn = np.linalg.norm(uv[triangles] - uv[np.roll(triangles, 1, axis=1)], axis=2)
            assert np.allclose(drawn, lengths, rtol=1e-9, atol=1e-9)
            assert np.allclose(stretch, 1.0, rtol=1e-9)


def test_the_stretch_is_told() -> None:
    points, triangles = dome(12, 5)
    uv, squared, _ = flattened(points, triangles, np.array([0, len(triangles)]))
    told = float(np.sqrt(np.average(squared, weights=surface_areas(points, triangles))))
    assert told == pytest.approx(stretch(points, triangles, uv), rel=1e-9)
    assert told > 1.01


def test_bent_charts_of_many_triangles_are_not_tried_where_that_is_asked_for() -> None:
    points, triangles = dome(12, 5)
    starts = np.array([0, len(triangles)])
    assert flattened(points, triangles, starts, most=len(triangles))[2].tolist() == [FLATTENED]
    uv, squared, state = flattened(points, triangles, starts, most=len(triangles) - 1)
    assert state.tolist() == [NOT_TRIED]
    assert (uv == 0.0).all() and (squared == 1.0).all()


def test_charts_do_not_depend_on_one_another_or_on_threads() -> None:
    meshes = [tube(8), dome(12, 5), waves(20, 1.0), dome(40, 20), tube(1, 1), dome(3, 1), waves(9, 0.3)]
    first = np.cumsum([0] + [len(points) for points, _ in meshes])
    starts = np.cumsum([0] + [len(triangles) for _, triangles in meshes])
    points = np.concatenate([points for points, _ in meshes])
    triangles = np.concatenate([start + mesh[1] for start, mesh in zip(first, meshes, strict=False)])
    alone = np.concatenate([flatten_one(mesh)[0] for mesh in meshes])
    for threads in (1, 3):
        uv, _, state = flattened(points, triangles, starts, threads=threads)
        assert (state == FLATTENED).all()
        assert (uv == alone).all()


def test_random_disks_with_random_points() -> None:
    rng = np.random.default_rng(5)
    for round_ in range(60):
        triangles, border, count = [[0, 1, 2]], [0, 1, 2], 3
        for _ in range(int(rng.integers(0, 80))):
            side = int(rng.integers(len(border)))
            triangles.append([border[(side + 1) % len(border)], border[side], count])
            border.insert(side + 1, count)
            count += 1
        points = rng.standard_normal((count, 3))
        if round_ % 3 == 1:
            points = np.round(points)
        elif round_ % 3 == 2:
            points *= 10.0 ** rng.uniform(-3.0, 3.0, (count, 1))
        uv, state = flatten_one((points, np.array(triangles)))
        assert np.isfinite(uv).all()
        assert state == NOT_FLAT or doubled_areas(uv, np.array(triangles)).min() > 0.0


def test_no_charts_and_an_empty_one() -> None:
    uv, _, state = flattened(np.zeros((2, 3)), np.empty((0, 3), np.int64), np.array([0]))
    assert (uv.shape, state.shape) == ((2, 2), (0,))
    _, _, state = flattened(np.zeros((0, 3)), np.empty((0, 3), np.int64), np.array([0, 0]))
    assert state.tolist() == [NOT_A_DISK]


@pytest.mark.parametrize(
    ("triangles", "starts", "line"),
    [
        ([[0, 1, 4]], [0, 1], "does not exist"),
        ([[0, 1, -1]], [0, 1], "does not exist"),
        ([[0, 1, 2], [0, 2, 3]], [0, 1, 2], "share a vertex"),
        ([[0, 1, 2], [0, 2, 3]], [0, 1], "follow on one another"),
        ([[0, 1, 2], [0, 2, 3]], [0, 3, 2], "follow on one another"),
    ],
)
def test_broken_contracts_are_told(triangles: list[list[int]], starts: list[int], line: str) -> None:
    with pytest.raises(InputError, match=line):
        flattened(np.zeros((4, 3)), np.array(triangles), np.array(starts))


@pytest.mark.parametrize("wrong", [np.nan, np.inf, 2.0**201])
def test_a_point_out_of_range_is_told(wrong: float) -> None:
    with pytest.raises(InputError, match="finite"):
        flattened(
            np.array([[0.0, 0.0, 0.0], [1.0, wrong, 0.0], [0.0, 1.0, 0.0]]), np.array([[0, 1, 2]]), np.array([0, 1])
        )


def test_cancelled() -> None:
    points, triangles = tube(8)
    with pytest.raises(Cancelled):
        flattened(points, triangles, np.array([0, len(triangles)]), control=Control(cancel=1))
