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
from .chart_mesh import ChartMesh, components, corner_classes, following, halves_of
from .flat_charts import Cuts, FlatCharts, lay_flat

_LEAST_SHARE = 0.15  # of the shorter border: charts that touch along less stay two
_ROUNDS = 200  # of joining; each joins many pairs that do not touch one another


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


@dataclass(frozen=True, eq=False)
class Borders:
    """What pairs of charts share: for each pair the longest stretch of common border.

    pair: (n, 2) charts, lower first. length: (n,); of it, smooth: (n,) what does not run along creases. perimeter: (C,)
    of the charts. halves, owner: half-edges of the stretches, on the side of the first, and the pair of each.
    """

    pair: Longs
    length: Doubles
    smooth: Doubles
    perimeter: Doubles
    halves: Longs
    owner: Longs

    @staticmethod
    def of(mesh: ChartMesh, cuts: Cuts, locked: Flags) -> Borders:
        near, chosen = _beside_borders(mesh, cuts)
        label = cuts.label[chosen]
        halves = halves_of(chosen)
        joined = Cuts(label, cuts.slit[halves]).joined(near)
        vertex = corner_classes(near.twin, joined)[0]
        here = np.repeat(label, 3)
        rim = ~(joined | cuts.joined(mesh)[halves])
        perimeter: Doubles = np.bincount(here[rim], near.lengths[rim], cuts.count).astype(np.float64)
        half = np.flatnonzero((near.twin >= 0) & ~locked[halves] & (here < label[near.across]))
        back = near.twin[half]
        key = here[half] * cuts.count + here[back]
        names, pair = np.unique(key, return_inverse=True)
        pair = pair.ravel()
        # A stretch goes on where both charts go on: at one vertex of the one and one of the other.
        starts = np.stack([pair, vertex[half], vertex[following(back)]])
        ends = np.stack([pair, vertex[following(half)], vertex[back]])
        node = np.unique(np.concatenate([starts, ends], axis=1), axis=1, return_inverse=True)[1].ravel()
        at = np.arange(len(half))
        stretch = components(len(half) + len(node), np.concatenate([at, at]), len(half) + node)[0][: len(half)].astype(
            np.int64
        )
        total = np.bincount(stretch, near.lengths[half])
        smooth = np.bincount(stretch, near.lengths[half] * (1.0 - near.crease(half)))
        owner = np.zeros(len(total), np.int64)
        owner[stretch] = pair
        order = np.lexsort((-np.arange(len(total)), total))
        order = order[total[order] > 0.0]
        longest = np.full(len(names), -1)
        longest[owner[order]] = order  # the last that is written stays
        kept = np.flatnonzero(longest[pair] == stretch)
        some = np.flatnonzero(longest >= 0)
        return Borders(
            np.stack([names // cuts.count, names % cuts.count], axis=1)[some],
            total[longest[some]],
            smooth[longest[some]],
            perimeter,
            halves[half[kept]],
            np.searchsorted(some, pair[kept]),
        )

    def joined(self, mesh: ChartMesh, cuts: Cuts, chosen: Longs, names: Longs) -> Cuts:
        """The cuts without these stretches; the charts of pair chosen[i] get the label names[i]. No chart is in two."""
        slit = cuts.slit.copy()
        to = np.arange(max(cuts.count, int(names.max(initial=-1)) + 1))
        to[self.pair[chosen].ravel()] = np.repeat(names, 2)
        label = to[cuts.label]
        shared = np.flatnonzero(mesh.twin >= 0)
        shared = shared[
            (label[shared // 3] == label[mesh.across[shared]])
            & (cuts.label[shared // 3] != cuts.label[mesh.across[shared]])
        ]
        slit[shared] = True
        opened = self.halves[np.isin(self.owner, chosen)]
        slit[opened] = slit[mesh.twin[opened]] = False
        return Cuts(label, slit)


def _beside_borders(mesh: ChartMesh, cuts: Cuts) -> tuple[ChartMesh, Longs]:
    """The triangles with a corner on the border of a chart, as a mesh, and their numbers: all that meet there are in
    it, so that charts go on round a corner in it as they do in the whole mesh."""
    rim = ~cuts.joined(mesh)
    on_rim = np.zeros(len(mesh.points), np.bool_)
    corner = np.flatnonzero(rim)
    on_rim[mesh.triangles.ravel()[corner]] = True
    on_rim[mesh.triangles.ravel()[following(corner)]] = True
    chosen = np.flatnonzero(on_rim[mesh.triangles].any(axis=1))
    return mesh.part(chosen), chosen


def joined(
    mesh: ChartMesh,
    label: Longs,
    locked: Flags,
    fits: Callable[[FlatCharts], Flags],
    control: Control | None = None,
) -> Tree:
    """Join charts (T,), from 0, with their neighbours as long as what comes of it `fits`. Raises Cancelled.

    locked: (3 T,) bool, half-edges over which no charts are joined. Pairs that share the most of their borders come
    first.
    """
    tree = Tree(int(label.max()) + 1)
    cuts = Cuts(label, np.zeros(len(mesh.twin), np.bool_))
    name = np.arange(tree.leaves)  # of the tree, of each chart
    refused: set[tuple[int, int]] = set()
    for _ in range(_ROUNDS):
        borders = Borders.of(mesh, cuts, locked)
        chosen = _matching(borders, name, refused)
        if not len(chosen):
            return tree
        tried = borders.joined(mesh, cuts, chosen, borders.pair[chosen, 0])
        good = _fitting(mesh, tried, borders.pair[chosen, 0], fits, control)
        refused.update((int(a), int(b)) for a, b in name[borders.pair[chosen[~good]]])
        chosen = chosen[good]
        if not len(chosen):
            continue
        cuts = borders.joined(mesh, cuts, chosen, borders.pair[chosen, 0])
        made = tree.leaves + len(tree.children) + np.arange(len(chosen))
        tree.join([(int(a), int(b)) for a, b in name[borders.pair[chosen]]])
        name[borders.pair[chosen, 0]] = made
        cuts, name = _renumbered(cuts, name)
    return tree


def _renumbered(cuts: Cuts, name: Longs) -> tuple[Cuts, Longs]:
    """Cuts whose charts are numbered from 0 without gaps, and their names."""
    present, number = np.unique(cuts.label, return_inverse=True)
    return Cuts(number.ravel(), cuts.slit), name[present]


def absorbed(
    mesh: ChartMesh,
    label: Longs,
    locked: Flags,
    fits: Callable[[FlatCharts], Flags],
    control: Control | None = None,
) -> Longs:
    """(T,) charts, from 0: those that lie within one other chart go to it, where `fits` what comes of it."""
    cuts = Cuts(label, np.zeros(len(mesh.twin), np.bool_))
    borders = Borders.of(mesh, cuts, locked)
    area = np.bincount(label, mesh.area)
    owner = np.arange(cuts.count)
    for inner, outer in (borders.pair.T, borders.pair.T[::-1]):
        within = borders.length >= (1.0 - 1e-9) * borders.perimeter[inner]
        within &= area[inner] < area[outer]
        owner[inner[within]] = outer[within]
    owner = np.where(owner[owner] == owner, owner, np.arange(cuts.count))
    if (owner == np.arange(cuts.count)).all():
        return label
    names, merged = np.unique(owner[label], return_inverse=True)
    good = fits(lay_flat(mesh, Cuts(merged.ravel(), cuts.slit), control))
    stays = ~good[np.searchsorted(names, owner)]
    owner[stays] = np.flatnonzero(stays)
    return np.asarray(np.unique(owner[label], return_inverse=True)[1].ravel())


def _matching(borders: Borders, name: Longs, refused: set[tuple[int, int]]) -> Longs:
    """Pairs to try at one time: none shares a chart, the best first."""
    score = borders.smooth / np.maximum(borders.perimeter[borders.pair].min(axis=1), 1e-300)
    taken: set[int] = set()
    chosen = []
    for i in np.lexsort((np.arange(len(score)), -score)):
        if score[i] < _LEAST_SHARE:
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
    present, number = np.unique(label, return_inverse=True)
    cuts, name = Cuts(number.ravel(), np.zeros(len(mesh.twin), np.bool_)), present
    begin = 0
    for end in tree.rounds:
        borders = Borders.of(mesh, cuts, locked)
        at = {(int(a), int(b)): i for i, (a, b) in enumerate(np.sort(name[borders.pair], axis=1))}
        wanted = [(at.get((min(pair), max(pair))), made) for made, pair in enumerate(tree.children[begin:end], begin)]
        found = [(i, tree.leaves + made) for i, made in wanted if i is not None]
        begin = end
        if not found:
            continue
        chosen = np.array([i for i, _ in found])
        first = borders.pair[chosen, 0]
        cuts = borders.joined(mesh, cuts, chosen, first)
        name[first] = [made for _, made in found]
        cuts, name = _renumbered(cuts, name)
    return cuts, name
