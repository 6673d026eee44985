"""Charts are cut in two: whole polygons, connected sides, short borders, and rings so that two discs come of them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from occlusion_bake.core.base.errors import Cancelled, InputError
from occlusion_bake.core.base.kernel_api import Control
from occlusion_bake.core.charts.chart_mesh import ChartMesh, connected, corner_classes
from occlusion_bake.core.charts.divide import divided
from occlusion_bake.core.charts.flat_charts import Cuts
from occlusion_bake.tests.oracles.charts.polygon_mesh import PolygonMesh, joined, placed
from occlusion_bake.tests.oracles.charts.round_shapes import ring, spring, tube


@dataclass(frozen=True, eq=False)
class Chart:
    """A mesh that is one chart."""

    mesh: ChartMesh

    @staticmethod
    def of(mesh: PolygonMesh) -> Chart:
        return Chart(
            connected(mesh.vertices.astype(float), mesh.triangles.astype(np.int64), mesh.polygons.astype(np.int64))
        )

    def only(self, kept: Any) -> Chart:
        return Chart(self.mesh.part(np.flatnonzero(kept)))

    @property
    def middle(self) -> Any:
        return self.mesh.corners.mean(axis=1)

    @property
    def uncut(self) -> Cuts:
        return Cuts(np.zeros(len(self.mesh.triangles), np.int64), np.zeros(len(self.mesh.twin), bool))

    def halves(self, apart: tuple[int, int] = (-1, -1), control: Control | None = None) -> Any:
        return divided(self.mesh, self.uncut, np.ones(self.uncut.count, bool), np.array([apart]), control=control)

    def border(self, side: Any) -> float:
        """What the edges between the sides cost."""
        return float(self.mesh.cost(np.flatnonzero(self.mesh.between(side))).sum()) / 2.0

    def share(self, side: Any) -> float:
        return float(self.mesh.area[side].sum() / self.mesh.area.sum())

    def hangs_together(self, part: Any) -> bool:
        """Whether the triangles of a part reach one another by way of edges, or of their polygons."""
        inside = set(np.flatnonzero(part).tolist())
        neighbours, polygon = self.mesh.across.reshape(-1, 3).tolist(), self.mesh.polygon.tolist()
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
        first = np.zeros(self.mesh.polygon.max() + 1, bool)
        first[self.mesh.polygon] = side
        assert np.array_equal(first[self.mesh.polygon], side)
        assert self.hangs_together(side)
        assert self.hangs_together(~side)


def euler_number(mesh: ChartMesh) -> int:
    """Vertices - edges + triangles: 1 of a disc, 0 of a ring."""
    inner = mesh.twin >= 0
    edges = np.count_nonzero(~inner) + np.count_nonzero(inner) // 2
    return corner_classes(mesh.twin, inner)[1] - edges + len(mesh.triangles)


def sheet(width: int, height: int, *, uneven: float = 0.0, quads: bool = False) -> Chart:
    """Squares cut in two; uneven: their corners are moved about by so much, and they are cut either way."""
    rng = np.random.default_rng(4)
    x, y = np.meshgrid(np.arange(width + 1.0), np.arange(height + 1.0), indexing="ij")
    points = np.stack([x, y, 0.0 * x], axis=-1)
    points[..., :2] += rng.uniform(-uneven, uneven, (width + 1, height + 1, 2))
    i = np.arange(x.size, dtype=np.int64).reshape(x.shape)
    a, b, c, d = i[:-1, :-1], i[1:, :-1], i[1:, 1:], i[:-1, 1:]
    turned = rng.random(a.shape) < 0.5 * (uneven > 0.0)
    lower = np.stack([a, b, np.where(turned, d, c)], axis=-1)
    upper = np.stack([np.where(turned, b, a), c, d], axis=-1)
    triangles = np.stack([lower, upper], axis=-2).reshape(-1, 3)
    polygon = np.arange(len(triangles), dtype=np.int64) // (2 if quads else 1)
    return Chart(connected(points.reshape(-1, 3), triangles, polygon))


def disc(radius: int) -> Chart:
    square = sheet(2 * radius, 2 * radius, uneven=0.2)
    return square.only(np.hypot(*(square.middle[:, :2] - radius).T) < radius)


def ribbon(length: int, width: int) -> Chart:
    """A sheet wound up to a spring of radius one, as its side."""
    flat = sheet(length, width).mesh
    along, across = flat.points[:, 0] * 0.05, flat.points[:, 1] * 0.05
    return Chart(replace(flat, points=np.stack([np.cos(along), np.sin(along), across + 0.3 * along], axis=-1)))


def box() -> Chart:
    """A closed surface: a cube, each side with a grid of its own that meets the next."""
    x, y, z = np.meshgrid(*[np.arange(13.0)] * 3, indexing="ij")
    points = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    number = np.arange(13**3, dtype=np.int64).reshape(13, 13, 13)
    quads = []
    for axis in range(3):
        for end in (0, 12):
            side = number.take(end, axis=axis)
            side = side.T if (axis + end) % 2 else side
            corners = [side[:-1, :-1], side[1:, :-1], side[1:, 1:], side[:-1, 1:]]
            quads.append(np.stack(corners, axis=-1).reshape(-1, 4)[:, :: 1 if end else -1])
    quad = np.concatenate(quads)
    triangles = np.concatenate([quad[:, [0, 1, 2]], quad[:, [0, 2, 3]]])
    return Chart(connected(points - 6.0, triangles, np.tile(np.arange(len(quad), dtype=np.int64), 2)))


def holed() -> Chart:
    """A square with a square hole, four units from its left side."""
    whole = sheet(20, 20)
    return whole.only((np.abs(whole.middle[:, :2] - [6.0, 10.0]) > 2.0).any(axis=1))


@pytest.mark.parametrize(
    ("chart", "shortest"),
    [
        (sheet(800, 12), 12.0),
        (sheet(3, 4000), 3.0),
        (sheet(300, 40, uneven=0.2), 41.0),
        (sheet(90, 90, uneven=0.2), 95.0),
        (disc(60), 125.0),
        (ribbon(4000, 6), 0.3),
        (box(), 0.2 * 6 * 12),  # between two times three sides, along the cube's edges
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


def test_the_border_prefers_edges_that_are_marked() -> None:
    chart = sheet(120, 30)
    start, end = chart.mesh.corners[..., 0], chart.mesh.corners[:, [1, 2, 0], 0]
    marked = (np.abs(start - 47.0) < 0.1) & (np.abs(end - 47.0) < 0.1)
    chart = Chart(replace(chart.mesh, seam=marked.ravel()))
    side = chart.halves()
    assert np.array_equal(side == side[0], chart.middle[:, 0] < 47.0)


@pytest.mark.parametrize("apart", [(0, 1), (9000, 9001), (9000, 8), (100, 9100), (19199, 0)])
@pytest.mark.parametrize("length", [98, 9600])
def test_two_triangles_come_to_be_on_different_sides(length: int, apart: tuple[int, int]) -> None:
    chart = sheet(length, 9600 // length)
    count = len(chart.mesh.triangles)
    apart = (apart[0] % count, apart[1] % count)
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


@pytest.mark.parametrize("apart", [(-1, -1), (3, 900)])
def test_polygons_stay_whole(apart: tuple[int, int]) -> None:
    quads = sheet(60, 20, quads=True)
    lid = (np.abs(quads.middle[:, :2] - [30.0, 10.0]) < [3.0, 6.0]).all(axis=1)  # one polygon in the middle of all
    chart = Chart(replace(quads.mesh, polygon=np.where(lid, 0, quads.mesh.polygon + 1)))
    side = chart.halves(apart)
    chart.check(side)
    assert chart.border(side) < 40.0


def test_two_triangles_of_one_polygon_are_not_parted() -> None:
    chart = sheet(40, 10, quads=True)
    assert np.array_equal(chart.halves((50, 51)), chart.halves())


@pytest.mark.parametrize("triangles", [1, 2, 5])
def test_a_single_polygon_is_not_cut(triangles: int) -> None:
    chart = sheet(5, 1).only(np.arange(10, dtype=np.int64) < triangles)
    assert not Chart(replace(chart.mesh, polygon=np.full(triangles, 77, dtype=np.int64))).halves().any()


def test_corners_all_in_one_place_are_cut_all_the_same() -> None:
    chart = sheet(50, 4)
    chart = Chart(replace(chart.mesh, points=np.zeros_like(chart.mesh.points)))
    side = chart.halves()
    chart.check(side)
    assert 40 < side.sum() < 360


def test_what_does_not_hang_together_is_parted_there() -> None:
    two = sheet(21, 10)
    chart = two.only(np.abs(two.middle[:, 0] - 10.5) > 0.5)
    side = chart.halves()
    assert np.array_equal(side == side[0], chart.middle[:, 0] < 10.5)


@pytest.mark.parametrize(
    "chart",
    [Chart.of(tube(64, rows=4)), Chart.of(ring(50, 0.3)), Chart.of(spring(16, turns=2.0)), holed()],
    ids=["tube", "flat ring", "spring", "holed"],
)
def test_a_ring_becomes_two_discs(chart: Chart) -> None:
    assert euler_number(chart.mesh) == 0
    side = chart.halves()
    chart.check(side)
    for half in (side, ~side):
        assert euler_number(chart.only(half).mesh) == 1


def test_a_ring_is_cut_where_it_is_narrowest() -> None:
    """On the left of the hole the shortest way to it is all the border that there is."""
    chart = holed()
    mesh = chart.mesh
    between = np.flatnonzero(mesh.between(chart.halves()))
    left = mesh.corners[..., 0] <= 4.0
    near = between[(left & left[:, [1, 2, 0]]).ravel()[between]]
    assert mesh.lengths[near].sum() / 2.0 == pytest.approx(4.0)


def test_a_ring_is_cut_between_two_triangles_alone_where_they_are_named() -> None:
    chart = Chart.of(tube(8, 40.0, rows=50))
    side = chart.halves((0, len(chart.mesh.triangles) - 1))
    chart.check(side)
    assert [euler_number(chart.only(half).mesh) for half in (side, ~side)] == [0, 0]  # around, into two rings


def many() -> tuple[ChartMesh, Cuts]:
    """Charts of many shapes and sizes in one mesh, some of them rings, one with a slit; their triangles mixed up."""
    shapes = [tube(3 + k, 1.0 + k % 3, rows=1 + k % 4, closed=k % 5 == 0) for k in range(30)]
    shapes += [ring(5 + k, 0.5) for k in range(9)] + [spring(6, turns=1.0 + k) for k in range(3)]
    vertices, triangles, polygons = joined([placed(shape, at=(4.0 * k, 0, 0)) for k, shape in enumerate(shapes)])
    label = np.repeat(np.arange(len(shapes), dtype=np.int64), [len(shape.triangles) for shape in shapes])
    order = np.random.default_rng(5).permutation(len(triangles))
    mesh = connected(vertices.astype(float), triangles[order].astype(np.int64), polygons[order].astype(np.int64))
    slit = np.zeros(len(mesh.twin), bool)
    some = np.flatnonzero(
        (mesh.twin >= 0) & np.repeat(label[order] == 41, 3) & (np.arange(len(mesh.twin), dtype=np.int64) % 7 == 0)
    )
    slit[some] = slit[mesh.twin[some]] = True
    return mesh, Cuts(label[order], slit)


def test_many_charts_at_once_are_cut_as_each_by_itself() -> None:
    mesh, cuts = many()
    wanted = np.arange(cuts.count, dtype=np.int64) % 4 != 1
    apart = np.full((cuts.count, 2), -1, dtype=np.int64)
    for chart in range(0, cuts.count, 3):
        apart[chart] = np.flatnonzero(cuts.label == chart)[[1, -1]]
    together = divided(mesh, cuts, wanted, apart)
    assert not together[~wanted[cuts.label]].any()
    for chart in np.flatnonzero(wanted):
        own = cuts.label == chart
        alone = divided(mesh, cuts, np.arange(cuts.count, dtype=np.int64) == chart, apart)
        assert np.array_equal(together[own], alone[own])
        assert together[own].any()
        assert not together[own].all()


@pytest.mark.parametrize("threads", [2, 3, 16])
def test_the_number_of_threads_does_not_matter(threads: int) -> None:
    mesh, cuts = many()
    wanted = np.ones(cuts.count, bool)
    one = divided(mesh, cuts, wanted, threads=1)
    assert np.array_equal(divided(mesh, cuts, wanted, threads=threads), one)


def test_no_chart_at_all() -> None:
    mesh, cuts = many()
    assert not divided(mesh, cuts, np.zeros(cuts.count, bool)).any()


def test_places_that_are_not_finite_are_refused() -> None:
    chart = sheet(5, 5)
    chart.mesh.points[7, 1] = np.nan
    with pytest.raises(InputError):
        chart.halves()


@pytest.mark.parametrize("apart", [(0, 2), (0, -1)])
def test_triangles_of_another_chart_are_refused(apart: tuple[int, int]) -> None:
    mesh, chart = sheet(1, 2).mesh, np.arange(4, dtype=np.int64) // 2
    with pytest.raises(InputError):
        divided(mesh, Cuts(chart, np.zeros(12, bool)), np.ones(2, bool), np.array([apart, (-1, -1)]))


@pytest.mark.parametrize("chart", [sheet(50, 50), holed()], ids=["sheet", "ring"])
def test_it_can_be_cancelled(chart: Chart) -> None:
    with pytest.raises(Cancelled):
        chart.halves(control=Control(cancel=1))


def test_it_tells_how_far_it_is() -> None:
    chart, control = sheet(50, 50), Control()
    chart.halves(control=control)
    assert (control.done, control.total) == (5000, 5000)
