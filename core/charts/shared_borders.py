"""Charts that are being joined, and the borders that they share meanwhile."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..base.arrays import Doubles, Flags, Longs
from .chart_mesh import ChartMesh, components, corner_classes, following, halves_of
from .flat_charts import Cuts


@dataclass(frozen=True, eq=False)
class JoinedCharts:
    """Charts of a mesh, each joined from some that it had at first, its leaves.

    leaf: (T,) from 0. chart: of each leaf the chart that it is in now, which is called as its lowest leaf.
    near: the triangles with a corner on the border of a leaf, as a mesh; all that meet there are in it, so that charts
    go on round a corner in it as they do in the whole mesh. members: their numbers. goes_on: half-edges of it beyond
    which a chart goes on outside; locked: over which none are joined; slit: that are cut though one chart lies on both
    sides.
    """

    leaf: Longs
    chart: Longs
    near: ChartMesh
    members: Longs
    goes_on: Flags
    locked: Flags
    slit: Flags

    @staticmethod
    def of(mesh: ChartMesh, leaf: Longs, locked: Flags) -> JoinedCharts:
        """Each leaf by itself. locked: (3 T,)."""
        inside = (mesh.twin >= 0) & ~mesh.between(leaf)
        on_rim = np.zeros(len(mesh.points), np.bool_)
        rim = np.flatnonzero(~inside)
        on_rim[mesh.triangles.ravel()[rim]] = True
        on_rim[mesh.triangles.ravel()[following(rim)]] = True
        members = np.flatnonzero(on_rim[mesh.triangles].any(axis=1))
        near, halves = mesh.part(members), halves_of(members)
        goes_on = (near.twin < 0) & inside[halves]
        own = np.arange(int(leaf.max(initial=-1)) + 1, dtype=np.int64)
        return JoinedCharts(leaf, own, near, members, goes_on, locked[halves], np.zeros(len(halves), np.bool_))

    @property
    def near_cuts(self) -> Cuts:
        """Of the triangles near borders."""
        return Cuts(self.chart[self.leaf[self.members]], self.slit)

    @property
    def cuts(self) -> Cuts:
        """Of the whole mesh."""
        slit = np.zeros(3 * len(self.leaf), np.bool_)
        slit[halves_of(self.members)] = self.slit
        return Cuts(self.chart[self.leaf], slit)

    def areas(self, mesh: ChartMesh) -> Doubles:
        """(C,) on the surface of the whole mesh; 0 of a leaf that is part of another chart."""
        return np.bincount(self.chart[self.leaf], mesh.area, len(self.chart)).astype(np.float64)

    def joined(self, borders: SharedBorders, chosen: Longs) -> JoinedCharts:
        """The charts of these pairs joined along their stretches; what else they share stays cut. No chart is in two
        pairs."""
        low, high = borders.pair[chosen].T
        to = np.arange(len(self.chart), dtype=np.int64)
        to[high] = low
        before = self.near_cuts.label
        after = to[before]
        slit = self.slit | (self.near.between(before) & ~self.near.between(after))
        opened = borders.halves[np.isin(borders.owner, chosen)]
        slit[opened] = slit[self.near.twin[opened]] = False
        return replace(self, chart=to[self.chart], slit=slit)


@dataclass(frozen=True, eq=False)
class SharedBorders:
    """What pairs of charts share: for each pair the longest stretch of common border.

    pair: (n, 2) charts, lower first. length: (n,); of it, smooth: (n,) what does not run along creases. perimeter: (C,)
    of the charts. halves, owner: half-edges of the stretches, of the triangles near borders, on the side of the first,
    and the pair of each.
    """

    pair: Longs
    length: Doubles
    smooth: Doubles
    perimeter: Doubles
    halves: Longs
    owner: Longs

    @staticmethod
    def of(charts: JoinedCharts) -> SharedBorders:
        near, cuts, count = charts.near, charts.near_cuts, len(charts.chart)
        label, inside = cuts.label, cuts.joined(near)
        chart = np.repeat(label, 3)
        rim = ~inside & ~charts.goes_on
        perimeter: Doubles = np.bincount(chart[rim], near.lengths[rim], count).astype(np.float64)

        half = np.flatnonzero((near.twin >= 0) & ~charts.locked & (chart < label[near.across]))
        stretch = _stretches(near, inside, half)
        names, pair = np.unique(chart[half] * count + chart[near.twin[half]], return_inverse=True)
        length: Doubles = np.bincount(stretch, near.lengths[half]).astype(np.float64)
        smooth = np.bincount(stretch, near.lengths[half] * (1.0 - near.crease(half)))

        owner = np.zeros(len(length), np.int64)
        owner[stretch] = pair.ravel()
        longest = _longest(length, owner, len(names))
        some = np.flatnonzero(longest >= 0)
        kept = np.flatnonzero(longest[owner[stretch]] == stretch)
        return SharedBorders(
            np.stack([names // count, names % count], axis=1)[some],
            length[longest[some]],
            smooth[longest[some]],
            perimeter,
            half[kept],
            np.searchsorted(some, owner[stretch[kept]]),
        )


def _stretches(mesh: ChartMesh, inside: Flags, half: Longs) -> Longs:
    """The stretch that each of some half-edges between charts is part of, from 0: it goes on where both charts go on,
    at one vertex of the one and one of the other."""
    vertex, count = corner_classes(mesh.twin, inside)
    back = mesh.twin[half]
    corner = vertex.astype(np.int64)
    begin = corner[half] * count + corner[following(back)]
    end = corner[following(half)] * count + corner[back]
    node = np.unique(np.concatenate([begin, end]), return_inverse=True)[1].ravel()
    at = np.arange(len(half), dtype=np.int64)
    stretch = components(len(half) + len(node), np.concatenate([at, at]), len(half) + node)[0]
    return stretch[: len(half)].astype(np.int64)


def _longest(length: Doubles, owner: Longs, count: int) -> Longs:
    """(count,) the longest stretch of each owner, the first of equal ones; -1 where all are of no length."""
    order = np.lexsort((-np.arange(len(length), dtype=np.int64), length))
    order = order[length[order] > 0.0]
    longest = np.full(count, -1, dtype=np.int64)
    longest[owner[order]] = order  # the last that is written stays
    return longest
