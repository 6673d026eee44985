"""Charts are cut in two, or into parts: whole polygons, connected sides, short borders."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from occlusion_bake.core.base.errors import Cancelled, InputError
from occlusion_bake.core.base.kernel_api import Control
from occlusion_bake.core.charts.bisect import halves, pieces


@dataclass(frozen=True, eq=False)
class Chart:
    """corners: (T, 3, 3). neighbours: (T, 3). polygon: (T,). weight: (T, 3)."""

    corners: Any
    neighbours: Any
    polygon: Any
    weight: Any

    @staticmethod
    def of(points: Any, triangles: Any, polygon: Any = None) -> Chart:
        ends = np.sort(np.stack([triangles, triangles[:, [1, 2, 0]]], axis=2).reshape(-1, 2), axis=1)
        order = np.lexsort([ends[:, 1], ends[:, 0]])
        pair = np.flatnonzero((ends[order[1:]] == ends[order[:-1]]).all(axis=1))
        neighbours, one, other = np.full(len(ends), -1), order[pair], order[pair + 1]
        neighbours[one], neighbours[other] = other // 3, one // 3
        corners = points[triangles]
        weight = np.linalg.norm(corners - corners[:, [1, 2, 0]], axis=2)
        polygon = np.arange(len(triangles)) if polygon is None else polygon
        return Chart(corners, neighbours.reshape(-1, 3), polygon, weight)

    def only(self, kept: Any) -> Chart:
        number = np.append(np.cumsum(kept) - 1, -1)
        number[:-1][~kept] = -1
        return Chart(self.corners[kept], number[self.neighbours[kept]], self.polygon[kept], self.weight[kept])

    @property
    def middle(self) -> Any:
        return self.corners.mean(axis=1)

    @property
    def area(self) -> Any:
        a, b, c = np.moveaxis(self.corners, 1, 0)
        return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)

    def halves(self, apart: tuple[int, int] | None = None) -> Any:
        return halves(self.corners, self.neighbours, self.polygon, self.weight, apart)

    def pieces(self, count: int) -> Any:
        return pieces(self.corners, self.neighbours, self.polygon, self.weight, count)

    def border(self, part: Any) -> float:
        """The weight of the edges between parts."""
        meets = (self.neighbours >= 0) & (part[:, None] != part[self.neighbours])
        return float(self.weight[meets].sum()) / 2.0

    def share(self, side: Any) -> float:
        return float(self.area[side].sum() / self.area.sum())

    def hangs_together(self, part: Any) -> bool:
        """Whether the triangles of a part reach one another by way of edges, or of their polygons."""
        inside, neighbours, polygon = (
            set(np.flatnonzero(part).tolist()),
            self.neighbours.tolist(),
            self.polygon.tolist(),
        )
        mates: dict[int, list[int]] = {}
        for triangle in inside:
            mates.setdefault(polygon[triangle], []).append(triangle)
        waiting = [inside.pop()]
        while waiting:
            triangle = waiting.pop()
            near = inside.intersection(neighbours[triangle] + mates.pop(polygon[triangle], []))
            inside -= near
            waiting += near
        return not inside

    def check(self, side: Any) -> None:
        """What holds of every cut."""
        assert side.any()
        assert not side.all()
        first = np.zeros(self.polygon.max() + 1, bool)
        first[self.polygon] = side
        assert np.array_equal(first[self.polygon], side)
        assert self.hangs_together(side)
        assert self.hangs_together(~side)


def sheet(width: int, height: int, *, uneven: float = 0.0, quads: bool = False) -> Chart:
    """Squares cut in two; uneven: their corners are moved about by so much, and they are cut either way."""
    rng = np.random.default_rng(4)
    x, y = np.meshgrid(np.arange(width + 1.0), np.arange(height + 1.0), indexing="ij")
    points = np.stack([x, y, 0.0 * x], axis=-1)
    points[..., :2] += rng.uniform(-uneven, uneven, (width + 1, height + 1, 2))
    i = np.arange(x.size).reshape(x.shape)
    a, b, c, d = i[:-1, :-1], i[1:, :-1], i[1:, 1:], i[:-1, 1:]
    turned = rng.random(a.shape) < 0.5 * (uneven > 0.0)
    lower = np.stack([a, b, np.where(turned, d, c)], axis=-1)
    upper = np.stack([np.where(turned, b, a), c, d], axis=-1)
    triangles = np.stack([lower, upper], axis=-2).reshape(-1, 3)
    return Chart.of(points.reshape(-1, 3), triangles, np.arange(len(triangles)) // 2 if quads else None)


def disc(radius: int) -> Chart:
    square = sheet(2 * radius, 2 * radius, uneven=0.2)
    return square.only(np.hypot(*(square.middle[:, :2] - radius).T) < radius)


def ribbon(length: int, width: int) -> Chart:
    """A sheet wound up to a spring of radius one, as its side."""
    flat = sheet(length, width)
    along, across = flat.corners[..., 0] * 0.05, flat.corners[..., 1] * 0.05
    wound = np.stack([np.cos(along), np.sin(along), across + 0.3 * along], axis=-1)
    return replace(flat, corners=wound, weight=np.linalg.norm(wound - wound[:, [1, 2, 0]], axis=2))


def globe() -> Chart:
    """A closed surface: a cube, each side with a grid of its own that meets the next."""
    x, y, z = np.meshgrid(*[np.arange(13)] * 3, indexing="ij")
    points = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    number = np.arange(13**3).reshape(13, 13, 13)
    quads = []
    for axis in range(3):
        for end in (0, 12):
            side = number.take(end, axis=axis)
            corners = [side[:-1, :-1], side[1:, :-1], side[1:, 1:], side[:-1, 1:]]
            quads.append(np.stack(corners, axis=-1).reshape(-1, 4))
    quad = np.concatenate(quads)
    triangles = np.concatenate([quad[:, [0, 1, 2]], quad[:, [0, 2, 3]]])
    return Chart.of(points - 6.0, triangles, np.tile(np.arange(len(quad)), 2))


@pytest.mark.parametrize(
    ("chart", "shortest"),
    [
        (sheet(800, 12), 12.0),
        (sheet(3, 4000), 3.0),
        (sheet(300, 40, uneven=0.2), 41.0),
        (sheet(90, 90, uneven=0.2), 95.0),
        (disc(60), 125.0),
        (ribbon(4000, 6), 0.3),
        (globe(), 54.0),
    ],
    ids=["strip", "upright strip", "uneven strip", "square", "disc", "spring", "closed"],
)
def test_charts_are_cut_across_their_middle(chart: Chart, shortest: float) -> None:
    side = chart.halves()
    chart.check(side)
    assert 0.3 < chart.share(side) < 0.7
    assert chart.border(side) < 1.15 * shortest


def test_the_border_is_where_the_chart_is_narrow() -> None:
    square = sheet(90, 90, uneven=0.2)
    x, y = square.middle[:, 0], square.middle[:, 1]
    chart = square.only((np.abs(x - 35.0) > 4.0) | (np.abs(y - 60.0) < 6.0))
    side = chart.halves()
    chart.check(side)
    assert chart.border(side) < 1.15 * 12.0


def test_the_border_prefers_edges_of_little_weight() -> None:
    plain = sheet(120, 30)
    on_crease = (np.abs(plain.corners[:, :, 0] - 47.0) < 0.1) & (np.abs(plain.corners[:, [1, 2, 0], 0] - 47.0) < 0.1)
    chart = replace(plain, weight=np.where(on_crease, 0.2, 1.0) * plain.weight)
    side = chart.halves()
    assert np.array_equal(side == side[0], chart.middle[:, 0] < 47.0)


@pytest.mark.parametrize("apart", [(0, 1), (9000, 9001), (9000, 8), (100, 9100), (19199, 0)])
@pytest.mark.parametrize("length", [98, 9600])
def test_two_triangles_come_to_be_on_different_sides(length: int, apart: tuple[int, int]) -> None:
    chart = sheet(length, 9600 // length)
    apart = (apart[0] % len(chart.polygon), apart[1] % len(chart.polygon))
    side = chart.halves(apart)
    chart.check(side)
    assert side[list(apart)].tolist() == [False, True]
    assert length > 98 or chart.border(side) < 3.0 * 98.0


def test_a_pair_near_one_end_is_parted_on_the_way_between() -> None:
    chart = ribbon(4000, 6)
    pair = (12 * 100, 12 * 600)
    side = chart.halves(pair)
    chart.check(side)
    assert chart.border(side) < 1.15 * 0.3
    assert chart.share(side) < 1.0 - 300.0 / 4000.0  # nearer to the one of the two that more lies beyond


@pytest.mark.parametrize("apart", [None, (3, 900)])
def test_polygons_stay_whole(apart: tuple[int, int] | None) -> None:
    quads = sheet(60, 20, quads=True)
    middle = quads.middle[:, :2]
    lid = (np.abs(middle - [30.0, 10.0]) < [3.0, 6.0]).all(axis=1)  # one polygon in the middle of all
    chart = replace(quads, polygon=np.where(lid, 0, quads.polygon + 1))
    side = chart.halves(apart)
    chart.check(side)
    assert chart.border(side) < 40.0


def test_two_triangles_of_one_polygon_are_not_parted() -> None:
    chart = sheet(40, 10, quads=True)
    assert np.array_equal(chart.halves((50, 51)), chart.halves())


@pytest.mark.parametrize("triangles", [0, 1, 2, 5])
def test_a_single_polygon_is_not_cut(triangles: int) -> None:
    chart = sheet(5, 1).only(np.arange(10) < triangles)
    chart = replace(chart, polygon=np.full(triangles, 77))
    assert not chart.halves().any()
    assert not chart.pieces(3).any()


def test_corners_all_in_one_place_are_cut_all_the_same() -> None:
    chart = replace(sheet(50, 4), corners=np.zeros((400, 3, 3)), weight=np.zeros((400, 3)))
    side = chart.halves()
    chart.check(side)
    assert 40 < side.sum() < 360


def test_what_does_not_hang_together_is_parted_there() -> None:
    two = sheet(21, 10)
    chart = two.only(np.abs(two.middle[:, 0] - 10.5) > 0.5)
    side = chart.halves()
    assert np.array_equal(side == side[0], chart.middle[:, 0] < 10.5)
    assert len(np.unique(chart.pieces(2))) == 2


@pytest.mark.parametrize("count", [1, 2, 7, 40])
@pytest.mark.parametrize("chart", [sheet(1200, 8), ribbon(2400, 6)], ids=["strip", "spring"])
def test_long_charts_are_cut_into_parts_of_like_length(chart: Chart, count: int) -> None:
    part = chart.pieces(count)
    assert np.array_equal(np.unique(part), np.arange(count))
    shares = np.array([chart.share(part == one) for one in range(count)])
    assert shares.min() > 0.7 / count
    assert shares.max() < 1.3 / count
    assert all(chart.hangs_together(part == one) for one in range(0, count, 5))
    width = chart.border(chart.pieces(2))
    assert chart.border(part) < 1.05 * width * (count - 1) + 1e-9
    along = [np.flatnonzero(part == one).mean() for one in range(count)]
    assert np.array_equal(np.argsort(along), np.arange(count)[:: 1 if along[0] <= along[-1] else -1])


def test_the_arms_of_a_fork_are_parts_of_their_own() -> None:
    square = sheet(80, 80)
    x, y = square.middle[:, 0], square.middle[:, 1]
    chart = square.only((y < 6.0) | ((np.minimum(x, np.abs(x - 40.0)) < 6.0) & (x < 46.0)))
    part = chart.pieces(4)
    assert part.max() >= 3
    assert all(chart.hangs_together(part == one) for one in range(part.max() + 1))


def test_more_parts_than_polygons_are_as_many_as_there_are() -> None:
    part = sheet(6, 1).pieces(100)
    assert len(np.unique(part)) > 6
    assert part.max() < 12


@pytest.mark.parametrize("name", ["corners", "weight"])
def test_numbers_out_of_range_are_refused(name: str) -> None:
    chart = sheet(5, 5)
    getattr(chart, name)[7, 1] = np.nan
    with pytest.raises(InputError):
        chart.halves()
    with pytest.raises(InputError):
        chart.pieces(2)


@pytest.mark.parametrize("wrong", [-2, 50])
def test_neighbours_out_of_range_are_refused(wrong: int) -> None:
    chart = sheet(5, 5)
    chart.neighbours[7, 1] = wrong
    with pytest.raises(InputError):
        chart.halves()


def test_it_can_be_cancelled() -> None:
    chart = sheet(50, 50)
    with pytest.raises(Cancelled):
        halves(chart.corners, chart.neighbours, chart.polygon, chart.weight, control=Control(cancel=1))
    with pytest.raises(Cancelled):
        pieces(chart.corners, chart.neighbours, chart.polygon, chart.weight, 3, control=Control(cancel=1))
