"""Charts joined with their neighbours where they can be laid flat together, and joined likewise on a finer mesh.

Two charts are joined along one stretch of their common border, so that what was two discs is one; what else they share
stays cut. That also unrolls a tube: its halves are joined along one seam and stay apart along the other.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ..base.arrays import Doubles, Flags, Longs
from ..base.kernel_api import Control
from .chart_mesh import ChartMesh, halves_of
from .flat_charts import Cuts, FlatCharts, lay_flat
from .shared_borders import JoinedCharts, SharedBorders

_LEAST_SHARE = 0.15  # of the shorter border: charts that touch along less stay two
# What runs along creases does not count, but between two charts that are both less than this part of the surface, a
# million: a rough or a blocky surface would fall into crumbs.
SMALL = 2_000.0


@dataclass
class Tree:
    """How charts came together. A chart is a leaf, numbered from 0 to `leaves`, or made of two charts.

    children: those of chart leaves, leaves + 1, …, in the order in which they were made. rounds: the charts made at one
    time, which share none of their parts.
    """

    leaves: int
    children: list[tuple[int, int]] = field(default_factory=list)
    rounds: list[int] = field(default_factory=list)

    def join(self, pairs: list[tuple[int, int]]) -> None:
        """One round."""
        self.children += pairs
        self.rounds.append(len(self.children))

    def parts(self, chart: int) -> tuple[int, int] | None:
        """What a chart was joined from; None for a leaf, and for what is not of the tree."""
        made = chart - self.leaves
        return self.children[made] if 0 <= made < len(self.children) else None

    def leaves_of(self, chart: int) -> list[int]:
        """The leaves that a chart was joined from."""
        found, waiting = [], [chart]
        while waiting:
            parts = self.parts(top := waiting.pop())
            if parts is None:
                found.append(top)
            else:
                waiting += parts
        return found


def joined(
    mesh: ChartMesh,
    label: Longs,
    locked: Flags,
    fits: Callable[[FlatCharts], Flags],
    control: Control | None = None,
) -> Tree:
    """Join charts (T,), from 0, with their neighbours as long as what comes of it `fits`. Raises Cancelled.

    locked: (3 T,) bool, half-edges over which no charts are joined. Pairs that share the most of their borders come
    first, many at a time that do not touch one another.
    """
    charts = JoinedCharts.of(mesh, label, locked)
    borders = SharedBorders.of(charts)
    tree = Tree(len(charts.chart))
    name = np.arange(tree.leaves, dtype=np.int64)  # of the tree, of each chart
    refused: set[tuple[int, int]] = set()
    while len(chosen := _matching(borders, _shares(borders, charts.areas(mesh)), name, refused)):
        tried = charts.joined(borders, chosen)
        good = _fitting(mesh, tried.cuts, borders.pair[chosen, 0], fits, control)
        refused.update((int(a), int(b)) for a, b in name[borders.pair[chosen[~good]]])
        if not good.any():
            continue
        charts = tried if good.all() else charts.joined(borders, chosen[good])
        pairs = borders.pair[chosen[good]]
        made = tree.leaves + len(tree.children) + np.arange(len(pairs), dtype=np.int64)
        tree.join([(int(a), int(b)) for a, b in name[pairs]])
        name[pairs[:, 0]] = made
        borders = SharedBorders.of(charts)
    return tree


def absorbed(
    mesh: ChartMesh,
    label: Longs,
    locked: Flags,
    fits: Callable[[FlatCharts], Flags],
    control: Control | None = None,
) -> Longs:
    """(T,) charts, from 0: those that lie within one other chart go to it, where `fits` what comes of it."""
    borders = SharedBorders.of(JoinedCharts.of(mesh, label, locked))
    area = np.bincount(label, mesh.area)
    own = np.arange(len(area), dtype=np.int64)
    owner = own.copy()
    for inner, outer in (borders.pair.T, borders.pair.T[::-1]):
        within = borders.length >= (1.0 - 1e-9) * borders.perimeter[inner]
        within &= area[inner] < area[outer]
        owner[inner[within]] = outer[within]
    owner = np.where(owner[owner] == owner, owner, own)
    grown = np.unique(owner[owner != own])
    if not len(grown):
        return label
    cuts = Cuts(owner[label], np.zeros(len(mesh.twin), np.bool_))
    spoilt = np.zeros(len(area), np.bool_)
    spoilt[grown] = ~_fitting(mesh, cuts, grown, fits, control)
    owner = np.where(spoilt[owner], own, owner)
    return np.asarray(np.unique(owner[label], return_inverse=True)[1].ravel())


def _shares(borders: SharedBorders, area: Doubles) -> Doubles:
    """Of each pair, how much of the shorter border of the two, whose areas are (C,), they share where there is no
    crease; creases or not where both are small."""
    small = (area[borders.pair] < SMALL).all(axis=1)
    shared = np.where(small, borders.length, borders.smooth)
    return np.asarray(shared / np.maximum(borders.perimeter[borders.pair].min(axis=1), 1e-300))


def _matching(borders: SharedBorders, share: Doubles, name: Longs, refused: set[tuple[int, int]]) -> Longs:
    """Pairs to try at one time: none shares a chart, the best first."""
    taken: set[int] = set()
    chosen = []
    for i in np.argsort(-share, kind="stable"):
        if share[i] < _LEAST_SHARE:
            break
        a, b = (int(chart) for chart in borders.pair[i])
        if a in taken or b in taken or (int(name[a]), int(name[b])) in refused:
            continue
        taken |= {a, b}
        chosen.append(i)
    return np.array(chosen, np.int64)


def _fitting(
    mesh: ChartMesh,
    cuts: Cuts,
    names: Longs,
    fits: Callable[[FlatCharts], Flags],
    control: Control | None,
) -> Flags:
    """Which of the named charts fit."""
    wanted = np.zeros(cuts.count, np.bool_)
    wanted[names] = True
    chosen = np.flatnonzero(wanted[cuts.label])
    part = mesh.part(chosen)
    present, label = np.unique(cuts.label[chosen], return_inverse=True)
    halves = halves_of(chosen)
    good = fits(lay_flat(part, Cuts(label.ravel(), cuts.slit[halves]), control))
    return np.asarray(good[np.searchsorted(present, names)])


def replayed(mesh: ChartMesh, label: Longs, locked: Flags, tree: Tree) -> tuple[Cuts, Longs]:
    """Join the charts (T,) of a mesh as those of another were: the cuts, and the tree's name of each chart.

    label: numbers of the tree's leaves. A pair that does not touch here stays two.
    """
    name, number = np.unique(label, return_inverse=True)
    charts = JoinedCharts.of(mesh, number.ravel(), locked)
    begin = 0
    for end in tree.rounds:
        borders = SharedBorders.of(charts)
        at = {(int(a), int(b)): i for i, (a, b) in enumerate(np.sort(name[borders.pair], axis=1))}
        wanted = [(at.get((min(pair), max(pair))), made) for made, pair in enumerate(tree.children[begin:end], begin)]
        found = [(i, tree.leaves + made) for i, made in wanted if i is not None]
        begin = end
        if not found:
            continue
        chosen = np.array([i for i, _ in found], dtype=np.int64)
        charts = charts.joined(borders, chosen)
        name[borders.pair[chosen, 0]] = [made for _, made in found]
    cuts = charts.cuts
    present, dense = np.unique(cuts.label, return_inverse=True)
    return Cuts(dense.ravel(), cuts.slit), name[present]
