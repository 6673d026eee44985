"""A simplified mesh keeps shape, lines and topology, at a size that does not depend on how finely it was cut."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from occlusion_bake.core.base.errors import Cancelled, InputError
from occlusion_bake.core.base.kernel_api import Control
from occlusion_bake.core.base.triangles import area_of
from occlusion_bake.core.charts.simplify import Simplified, simplified

Shape = tuple[Any, Any]  # (V, 3) points with a surface of 1000 x 1000, (T, 3) triangles
NO_LIMIT = 10**9


def sized(points: Any, triangles: Any) -> Shape:
    area = area_of(points[triangles]).sum()
    return points * (1000.0 / np.sqrt(area)), triangles.astype(np.int64)


def grid(rows: int, columns: int, wrap_rows: bool = False, wrap_columns: bool = False) -> Any:
    """Triangles of a grid of points (rows, columns), which may close upon itself."""
    row, column = np.indices((rows - (not wrap_rows), columns - (not wrap_columns)), dtype=np.int64).reshape(2, -1)
    a, b = row * columns + column, (row + 1) % rows * columns + column
    c, d = (row + 1) % rows * columns + (column + 1) % columns, row * columns + (column + 1) % columns
    return np.stack([a, b, c, a, c, d], axis=1).reshape(-1, 3)


def turn(sides: int) -> Any:
    angle = 2.0 * np.pi * np.arange(sides, dtype=np.int64) / sides
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)


def tube(sides: int, rings: int = 2) -> Shape:
    around = np.repeat(turn(sides), rings, axis=0)
    along = np.tile(np.linspace(0.0, 10.0, rings), sides)
    return sized(np.c_[around, along], grid(sides, rings, wrap_rows=True))


def cone(sides: int) -> Shape:
    points = np.concatenate([[[0.0, 0.0, 1.5]], np.c_[turn(sides), np.zeros(sides)]])
    here = np.arange(sides, dtype=np.int64)
    return sized(points, np.stack([np.zeros(sides, np.int64), here + 1, (here + 1) % sides + 1], axis=1))


def can(sides: int) -> Shape:
    """A tube with a polygon at each end, as a fan of needles from one corner."""
    points, around = tube(sides)
    fan = 2 * disc(sides)[1]
    return sized(points, np.concatenate([around, fan[:, ::-1], fan + 1]))


def disc(sides: int) -> Shape:
    """One polygon, as a fan from its first corner."""
    here = np.arange(1, sides - 1, dtype=np.int64)
    return sized(np.c_[turn(sides), np.zeros(sides)], np.stack([0 * here, here, here + 1], axis=1))


def ball(rows: int, columns: int, bumps: float = 0.0, noise: float = 0.0) -> Shape:
    """A UV sphere whose poles are many vertices in one place: the triangles there have no area."""
    theta, phi = np.meshgrid(
        np.linspace(0.0, np.pi, rows), np.arange(columns, dtype=np.int64) / columns * 2 * np.pi, indexing="ij"
    )
    radius = 1.0 + bumps * np.sin(6 * theta) * np.cos(5 * phi) * np.sin(theta) ** 2
    radius += noise * np.random.default_rng(1).standard_normal(radius.shape) * (np.sin(theta) > 0.01)
    flat = np.where(np.sin(theta) > 1e-9, np.sin(theta), 0.0)
    points = radius[..., None] * np.stack([flat * np.cos(phi), flat * np.sin(phi), np.cos(theta)], axis=-1)
    return sized(points.reshape(-1, 3), grid(rows, columns, wrap_columns=True))


def torus(rows: int, columns: int) -> Shape:
    big, small = np.meshgrid(
        np.arange(rows, dtype=np.int64) / rows, np.arange(columns, dtype=np.int64) / columns, indexing="ij"
    )
    reach = 1.0 + 0.4 * np.cos(2 * np.pi * small)
    points = [reach * np.cos(2 * np.pi * big), reach * np.sin(2 * np.pi * big), 0.4 * np.sin(2 * np.pi * small)]
    return sized(np.stack(points, axis=-1).reshape(-1, 3), grid(rows, columns, wrap_rows=True, wrap_columns=True))


def spring(rings: int, sides: int) -> Shape:
    along = np.repeat(np.linspace(0.0, 40.0, rings), sides)
    around = np.tile(2 * np.pi * np.arange(sides, dtype=np.int64) / sides, rings)
    reach = 1.0 + 0.15 * np.cos(around)
    points = np.stack([reach * np.cos(along), reach * np.sin(along), 0.15 * np.sin(around) + 0.1 * along], axis=1)
    return sized(points, grid(rings, sides, wrap_columns=True))


def simplify(shape: Shape, tolerance: float = 0.5, most: int = NO_LIMIT, kept: Any = None) -> Simplified:
    points, triangles = shape
    flags = np.zeros(triangles.shape, np.bool_) if kept is None else kept
    result = simplified(points, triangles, flags, tolerance, most)
    check(shape, result)
    return result


def check(shape: Shape, result: Simplified) -> None:
    """What must be true of any result."""
    triangles = shape[1]
    assert result.root.dtype == result.triangles.dtype == np.int32
    assert result.survivors.dtype == np.int64
    assert (np.diff(result.survivors) > 0).all()
    assert (result.root[result.survivors] == result.survivors).all()
    assert (result.survivors[result.patch] == result.root).all()
    assert np.isin(result.triangles, triangles).all()
    assert (result.triangles != np.roll(result.triangles, 1, axis=1)).all()


def edges(triangles: Any) -> Any:
    """(3 T, 2) the ends of the edges, lower first."""
    return np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)


def rim(triangles: Any) -> Any:
    """(T, 3) edges of one triangle alone."""
    _, back, uses = np.unique(edges(triangles), axis=0, return_inverse=True, return_counts=True)
    return uses[back.ravel()].reshape(-1, 3) == 1


def euler(triangles: Any) -> int:
    return len(np.unique(triangles)) - len(np.unique(edges(triangles), axis=0)) + len(triangles)


def normals(points: Any, triangles: Any) -> Any:
    corners = points[triangles]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return across / np.maximum(np.linalg.norm(across, axis=1), 1e-30)[:, None]


def distances(p: Any, corners: Any) -> Any:
    """(n,) how far points (n, 3) are from triangles (n, 3, 3): from their planes inside, from their edges outside."""
    ends = np.roll(corners, -1, axis=1)
    along = ends - corners
    away = p[:, None] - corners
    share = np.clip((away * along).sum(axis=2) / np.maximum((along**2).sum(axis=2), 1e-30), 0.0, 1.0)
    to_edges = np.linalg.norm(away - share[..., None] * along, axis=2).min(axis=1)
    normal = np.cross(along[:, 0], along[:, 1])
    inside = ((np.cross(along, away) * normal[:, None]).sum(axis=2) > 0.0).all(axis=1)
    to_planes = np.abs((away[:, 0] * normal).sum(axis=1)) / np.maximum(np.linalg.norm(normal, axis=1), 1e-30)
    return np.where(inside, to_planes, to_edges)


@pytest.mark.parametrize("shape", [tube, cone, disc])
def test_fine_tubes_cones_and_discs_come_down_to_the_same_size(shape: Any) -> None:
    """One quad high: thousands of needles, and a fan's hub with as many triangles."""
    sizes = [len(simplify(shape(sides), 1.0).triangles) for sides in (256, 2_048, 10_000)]
    assert max(sizes) < 1.7 * min(sizes)
    assert min(sizes) > 24
    assert max(sizes) < 140


def test_a_rim_is_as_round_as_the_tolerance_asks() -> None:
    """What is left of a circle of 2,048 vertices: 16 to 64, nowhere far from it."""
    points = (shape := tube(2_048, 9))[0]
    result = simplify(shape, 2.0)
    on_rim = result.triangles[rim(result.triangles)]
    ends = np.stack([result.triangles, np.roll(result.triangles, -1, axis=1)], axis=2)[rim(result.triangles)]
    assert 2 * 16 <= len(np.unique(on_rim)) <= 2 * 64
    radius = np.linalg.norm(points[0, :2])
    assert np.linalg.norm(points[ends].mean(axis=1)[:, :2], axis=1).min() > radius - 2.5 * 2.0
    assert np.isin(points[ends][..., 2], points[:, 2][[0, 8]]).all()


@pytest.mark.parametrize(
    "shape", [ball(60, 80, 0.1), ball(60, 80, 0.0, 0.002), torus(90, 40), tube(100, 30), spring(400, 16)]
)
def test_shape_is_kept(shape: Shape) -> None:
    """Topology stays, nothing lies far off, nothing is folded over."""
    points, triangles = shape
    result = simplify(shape, 1.0)
    assert len(result.triangles) < 0.6 * len(triangles)
    assert euler(result.triangles) == euler(triangles)
    middles = points[triangles].mean(axis=1)
    some = middles[:: len(middles) // 60]
    nearest = [distances(np.broadcast_to(p, (len(result.triangles), 3)), points[result.triangles]).min() for p in some]
    assert np.sqrt(np.square(nearest).mean()) < 1.0
    assert max(nearest) < 4.0
    off = distances(middles, points[result.triangles[result.patch]])
    assert off.mean() < 1.0 + 0.3 * np.sqrt(area_of(points[triangles]).mean())
    own = normals(points, triangles)
    solid = area_of(points[triangles]) > 1e-6
    turned = (own * normals(points, result.triangles)[result.patch]).sum(axis=1)[solid]
    assert (turned > 0.2).mean() > 0.995


@pytest.mark.parametrize("shape", [ball(60, 80, 0.1), torus(90, 40), tube(100, 30), spring(200, 12)])
def test_patches_are_connected_and_compact(shape: Shape) -> None:
    """The borders of the patches, along the mesh's own edges, are hardly longer than the simplified mesh's edges."""
    points, triangles = shape
    result = simplify(shape, 0.0, len(triangles) // 20)
    both = np.concatenate([edges(triangles), np.full((1, 2), -1, dtype=np.int64)])
    _, back, uses = np.unique(both, axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(back.ravel()[:-1], kind="stable")
    paired = order[(uses[back.ravel()[:-1]] == 2)[order]].reshape(-1, 2)
    labels = result.root[paired // 3]
    border = edges(triangles)[paired[labels[:, 0] != labels[:, 1], 0]]
    length = np.linalg.norm(points[border[:, 0]] - points[border[:, 1]], axis=1).sum()
    inner = np.unique(edges(result.triangles), axis=0)
    assert length < 1.3 * np.linalg.norm(points[inner[:, 0]] - points[inner[:, 1]], axis=1).sum()
    part = np.arange(len(triangles), dtype=np.int64)
    joined = paired[labels[:, 0] == labels[:, 1]] // 3
    while True:
        lower = part.copy()
        np.minimum.at(lower, joined.ravel(), part[joined[:, ::-1]].ravel())
        if (lower == part).all():
            break
        part = lower
    assert len(np.unique(part)) == len(result.triangles)


@pytest.mark.parametrize("sides", [64, 512, 2_048])
def test_patches_end_at_creases(sides: int) -> None:
    """Even the needles of a fan near its hub, which have the side beside them, are of the lid."""
    points, triangles = shape = can(sides)
    result = simplify(shape, 5.0)
    is_lid, is_lid_left = (np.abs(normals(points, which)[:, 2]) > 0.5 for which in (triangles, result.triangles))
    assert (is_lid == is_lid_left[result.patch]).all()


def test_kept_lines_stay_and_are_not_crossed() -> None:
    """A wavy line over a rough sheet: its ends stay, it is thinned out, and patches end at it."""
    row, column = np.indices((60, 60), dtype=np.int64).reshape(2, -1)
    height = 0.02 * np.random.default_rng(2).standard_normal(3600)
    triangles = (shape := sized(np.c_[row, column, height].astype(float), grid(60, 60)))[1]
    line = row == 30
    ends = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2)
    kept = line[ends].all(axis=2)
    result = simplify(shape, 1.0, kept=kept)
    above, above_left = (row[triangles].max(axis=1) > 30), (row[result.triangles].max(axis=1) > 30)
    assert (above == above_left[result.patch]).all()
    assert (row[result.triangles].min(axis=1) >= 30)[above_left].all()
    on_line = np.unique(result.triangles[line[result.triangles]])
    assert {30 * 60, 30 * 60 + 59} <= set(on_line.tolist())
    assert len(on_line) < 30
    ends_left = np.stack([result.triangles, np.roll(result.triangles, -1, axis=1)], axis=2)
    assert (result.lines == (line[ends_left].all(axis=2) | rim(result.triangles))).all()


def test_smoothing_takes_noise_away() -> None:
    """Of a rough ball: the triangles left turn less against one another, and no vertex goes farther than allowed."""
    points, triangles = shape = ball(80, 120, 0.0, 0.01)
    result = simplify(shape, 4.0)
    smooth = result.smoothed(points, 8.0)
    assert np.linalg.norm(smooth - points, axis=1).max() < 8.0 + 1e-9
    unused = np.setdiff1d(triangles, result.triangles)
    assert (smooth[unused] == points[unused]).all()
    radial = points[result.triangles].mean(axis=1)
    radial /= np.linalg.norm(radial, axis=1)[:, None]
    before, after = ((normals(p, result.triangles) * radial).sum(axis=1) for p in (points, smooth))
    assert np.percentile(after, 5) > np.percentile(before, 5) + 0.05


def test_smoothing_leaves_borders_and_creases() -> None:
    row, column = np.indices((30, 30), dtype=np.int64).reshape(2, -1)
    points = (shape := sized(np.c_[row, column, np.abs(row - 15)].astype(float), grid(30, 30)))[0]
    result = simplify(shape, 1.0)
    smooth = result.smoothed(points, 2.0)
    on_rim = np.unique(result.triangles[result.lines])
    assert (smooth[on_rim] == points[on_rim]).all()
    assert np.abs(smooth - points).max() <= 2.0


def test_triangles_without_area_do_not_stand_in_the_way() -> None:
    """A flat sheet, rows of which fall upon one another, becomes two triangles."""
    row, column = np.indices((50, 50), dtype=np.int64).reshape(2, -1)
    shape = sized(np.c_[row, column // 4 * 4, 0 * row].astype(float), grid(50, 50))
    assert (area_of(shape[0][shape[1]]) == 0.0).mean() > 0.5
    assert len(simplify(shape, 0.01).triangles) == 2


@pytest.mark.parametrize("flat", [[0, 0, 0], [1, 0, 0]], ids=["a point", "a line"])
def test_a_mesh_without_any_area(flat: Any) -> None:
    row, column = np.indices((20, 20), dtype=np.int64).reshape(2, -1)
    shape = np.c_[row, column, 0 * row] * np.array(flat, float), grid(20, 20)
    assert len(simplify(shape, 0.0, 10).triangles) <= 10


def test_loose_and_unwelded_triangles_stay() -> None:
    points, triangles = torus(20, 12)
    loose = points[triangles].reshape(-1, 3), np.arange(triangles.size, dtype=np.int64).reshape(-1, 3)
    assert len(simplify(loose, 100.0, 0).triangles) == len(triangles)


def test_soup_is_gone_through() -> None:
    random = np.random.default_rng(3)
    triangles = random.integers(0, 300, (20_000, 3))
    good = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    simplify(sized(random.standard_normal((300, 3)), triangles[good]), 100.0, 0)


def test_beyond_the_tolerance_only_as_far_as_asked() -> None:
    shape = ball(60, 80, 0.1)
    free = len(simplify(shape, 1.0).triangles)
    assert len(simplify(shape, 1.0, free + 100).triangles) == free
    assert free // 2 - 2 < len(simplify(shape, 1.0, free // 2).triangles) <= free // 2


def test_the_same_again_and_at_another_scale() -> None:
    points, triangles = shape = ball(40, 60, 0.1, 0.01)
    first, again = simplify(shape, 1.0), simplify(shape, 1.0)
    scaled = simplify((points / 64.0, triangles), 1.0 / 64.0)
    for other in (again, scaled):
        assert np.array_equal(first.root, other.root)
        assert np.array_equal(first.triangles, other.triangles)


def test_no_triangles() -> None:
    result = simplify((np.zeros((3, 3)), np.zeros((0, 3), np.int64)))
    assert len(result.root) == len(result.triangles) == len(result.survivors) == 0


def test_it_can_be_stopped() -> None:
    points, triangles = torus(200, 100)
    with pytest.raises(Cancelled):
        simplified(points, triangles, np.zeros(triangles.shape, bool), 1.0, 0, control=Control(cancel=1))


def test_a_tolerance_below_zero_is_refused() -> None:
    with pytest.raises(InputError, match="tolerance"):
        simplify(torus(9, 5), -1.0)


@pytest.mark.parametrize(
    "corner", [(0, 5), (0, -1), (0, 1), (2, 3)], ids=["missing", "negative", "twice", "not finite"]
)
def test_a_broken_mesh_is_refused(corner: tuple[int, int]) -> None:
    triangles = np.array([[0, 1, 2]])
    triangles[0, corner[0]] = corner[1]
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [np.nan, 0, 0]])
    with pytest.raises(InputError, match="simplified"):
        simplified(points, triangles, np.zeros((1, 3), bool), 1.0, 0)
