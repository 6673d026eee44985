"""Labels of triangles made fit to be charts: polygons whole, each label in one piece, borders short and on creases."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base import kernel_api as api
from ..base.arrays import Flags, Longs
from .chart_mesh import ChartMesh, triangle_groups

_ROUNDS = 60  # of smoothing; most meshes are done in twenty
_CRUMB = 0.02  # a polygon larger than this part of its chart does not change sides
# Borders are smoothed over a number of steps that grows with the polygons of a chart.
_FLOW, _MOST_FLOW = 0.02, 20
_ON_CREASE = 0.95  # of what flows over an edge is held back by one at a right angle
_SCRAP = 0.25  # a piece smaller than this part of its label's largest goes to a neighbour


def settled(mesh: ChartMesh, label: Longs, locked: Flags, control: api.Control | None = None) -> Longs:
    """(T,) the charts, from 0, that labels (T,) come nearest to.

    locked: (3 T,) bool, half-edges over which no chart may go. Polygons get the label that holds most of them; scraps
    go to their neighbours; labels flow over borders until those are smooth; then polygons change sides one by one where
    that makes borders shorter still, those along creases counting less. Whatever is in several pieces in the end
    becomes several charts.
    """
    label = _whole_polygons(mesh, label)
    links = _Links.of(mesh, locked)
    label = _without_scraps(mesh, label, locked)
    label = links.shortened(label, control)
    return _pieces(mesh, _without_scraps(mesh, label, locked), locked)


def _whole_polygons(mesh: ChartMesh, label: Longs) -> Longs:
    """(T,) the label that holds most of each polygon, by area."""
    count = int(label.max()) + 1
    pair, slot = np.unique(mesh.polygon * count + label, return_inverse=True)
    area = np.bincount(slot.ravel(), mesh.area)
    chosen = np.empty(int(mesh.polygon.max()) + 1, np.int64)
    order = np.argsort(area, kind="stable")  # the largest is written last, and stays
    chosen[pair[order] // count] = pair[order] % count
    return chosen[mesh.polygon]


def _same(mesh: ChartMesh, label: Longs, locked: Flags) -> Flags:
    """(3 T,) bool: half-edges with one label on both sides."""
    return np.asarray((mesh.twin >= 0) & ~locked & ~mesh.between(label))


def _pieces(mesh: ChartMesh, label: Longs, locked: Flags) -> Longs:
    return triangle_groups(mesh, _same(mesh, label, locked))[0].astype(np.int64)


def _without_scraps(mesh: ChartMesh, label: Longs, locked: Flags) -> Longs:
    """(T,) pieces, the small ones of a label gone to the neighbour with which they share most of their border."""
    for _ in range(8):
        piece = _pieces(mesh, label, locked)
        area = np.bincount(piece, mesh.area)
        owner = np.zeros(len(area), np.int64)
        owner[piece] = label
        largest = np.zeros(int(label.max()) + 1)
        np.maximum.at(largest, owner, area)
        scrap = area < _SCRAP * largest[owner]
        border = np.flatnonzero((mesh.twin >= 0) & ~locked & scrap[np.repeat(piece, 3)])
        border = border[piece[mesh.across[border]] != piece[border // 3]]
        if not len(border):
            return piece
        here, there = piece[border // 3], piece[mesh.across[border]]
        pair, slot = np.unique(here * len(area) + there, return_inverse=True)
        shared = np.bincount(slot.ravel(), mesh.lengths[border])
        order = np.lexsort((~scrap[pair % len(area)], shared))  # the longest is written last, and stays
        own = np.arange(len(area), dtype=np.int64)
        heir = own.copy()
        heir[pair[order] // len(area)] = pair[order] % len(area)
        heir = np.where(scrap & scrap[heir] & (heir > own), own, heir)
        label = heir[piece]
    return label


@dataclass(frozen=True, eq=False)
class _Links:
    """Which polygons lie side by side. polygon: (T,). halves: (L,) half-edges between polygons; here, there: (L,) the
    polygons on their two sides."""

    mesh: ChartMesh
    halves: Longs
    here: Longs
    there: Longs

    @staticmethod
    def of(mesh: ChartMesh, locked: Flags) -> _Links:
        inner = np.flatnonzero((mesh.twin >= 0) & ~locked)
        here, there = mesh.polygon[inner // 3], mesh.polygon[mesh.across[inner]]
        between = here != there
        return _Links(mesh, inner[between], here[between], there[between])

    def shortened(self, label: Longs, control: api.Control | None) -> Longs:
        """(T,) labels whose borders are smooth, and short: few polygons could change sides and make them shorter."""
        of_polygon = np.empty(int(self.mesh.polygon.max()) + 1, np.int64)
        of_polygon[self.mesh.polygon] = label
        area = np.bincount(self.mesh.polygon, self.mesh.area)
        crumb = area < _CRUMB * np.bincount(of_polygon, area)[of_polygon]
        steps = int(min(_FLOW * len(of_polygon) / len(np.unique(of_polygon)), _MOST_FLOW))
        if steps > 1:
            of_polygon = self._flowed(of_polygon, crumb, steps, control)
        for _ in range(_ROUNDS):
            if not self._improve(of_polygon, crumb):
                break
        return of_polygon[self.mesh.polygon]

    def _flowed(self, label: Longs, crumb: Flags, steps: int, control: api.Control | None) -> Longs:
        count = len(label)
        order = np.argsort(self.here, kind="stable")
        starts = np.searchsorted(self.here[order], np.arange(count + 1, dtype=np.int64)).astype(np.int64)
        there = self.there[order].astype(np.int32)
        halves = self.halves[order]
        flow = self.mesh.lengths[halves] * (1.0 - _ON_CREASE * self.mesh.crease(halves))
        smooth, may = label.astype(np.int32), crumb.astype(np.uint8)
        api.check(
            api.library().ob_smooth_labels(
                count,
                api.address(starts, np.int64, count + 1),
                api.address(there, np.int32, len(order)),
                api.address(flow, np.float64, len(order)),
                api.address(may, np.uint8, count),
                steps,
                api.address(smooth, np.int32, count),
                api.pointer_to(control),
            )
        )
        return smooth.astype(np.int64)

    def _improve(self, label: Longs, crumb: Flags) -> bool:
        """Move those polygons that gain more by it than their neighbours do; False where none does."""
        count = int(label.max()) + 1
        edge = np.zeros(len(label), np.bool_)
        edge[self.here[label[self.here] != label[self.there]]] = True
        edge &= crumb
        near = np.flatnonzero(edge[self.here])
        here, other, weight = self.here[near], label[self.there[near]], self.mesh.cost(self.halves[near])
        pair, slot = np.unique(here * count + other, return_inverse=True)
        shared = np.bincount(slot.ravel(), weight)
        who, what = pair // count, pair % count
        own = np.zeros(len(label))
        mine = label[who] == what
        own[who[mine]] = shared[mine]
        order = np.lexsort((-what, shared))
        order = order[~mine[order]]
        best, gain = np.full(len(label), -1, dtype=np.int64), np.zeros(len(label))
        best[who[order]], gain[who[order]] = what[order], shared[order]
        gain -= own
        wants = (best >= 0) & (gain > 1e-9 * (own + gain))
        rival = np.where(wants, gain, 0.0)
        beaten = wants[self.here[near]] & wants[self.there[near]]
        one, two = self.here[near][beaten], self.there[near][beaten]
        lost = (rival[two] > rival[one]) | ((rival[two] == rival[one]) & (two < one))
        wants[one[lost]] = False
        label[wants] = best[wants]
        return bool(wants.any())
