"""Polygons whose triangles lie in several charts are put together.

A polygon that a chart border cuts through moves whole into one of its charts; where it fits into none of them, it
becomes a chart of its own.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.arrays import Doubles, Flags, Longs
from ..base.triangles import area_of, singular, square, uv_area_of

# xatlas leaves out triangles of an area below FLT_EPSILON.
LEAST_AREA = 2.0**-23
# An adopted triangle may be this many times longer or shorter than on the surface, in any direction.
MOST_STRETCH = 3.0


@dataclass(frozen=True, eq=False)
class ChartMesh:
    """What is charted. points: (V, 3), centred, at a size fit for xatlas. polygon: (T,) from 0. area: (T,)."""

    points: Doubles
    triangles: Longs
    polygon: Longs
    area: Doubles

    @property
    def solid(self) -> Flags:
        """(T,) bool: triangles that xatlas will not leave out."""
        flags: Flags = self.area > 2.0 * LEAST_AREA
        return flags


class Nodes:
    """Where the vertices lie in each chart: one position for each pair of a chart and a vertex."""

    def __init__(self, vertex_count: int) -> None:
        self._vertex_count = vertex_count
        self._keys: Longs = np.empty(0, np.int64)
        self._uv: Doubles = np.empty((0, 2))

    def add(self, chart: Longs, vertex: Longs, uv: Doubles) -> None:
        """chart, vertex: (n,), uv: (n, 2). Several proposals for one pair are averaged; a known pair stays as it is."""
        keys, slot = np.unique(chart * self._vertex_count + vertex, return_inverse=True)
        slot = slot.ravel()
        mean = np.stack([np.bincount(slot, uv[:, axis]) for axis in range(2)], axis=1) / np.bincount(slot)[:, None]
        merged = np.concatenate([self._keys, keys])
        self._keys, first = np.unique(merged, return_index=True)
        self._uv = np.concatenate([self._uv, mean])[first]

    def find(self, chart: Longs, vertex: Longs) -> tuple[Doubles, Flags]:
        """Position and whether it is known, for chart and vertex of any one shape; (0, 0) where it is not."""
        wanted = chart * self._vertex_count + vertex
        if len(self._keys) == 0:
            return np.zeros((*wanted.shape, 2)), np.zeros(wanted.shape, np.bool_)
        at = np.minimum(np.searchsorted(self._keys, wanted), len(self._keys) - 1)
        known: Flags = (self._keys[at] == wanted) & (chart >= 0)
        return np.where(known[..., None], self._uv[at], 0.0), known


def mended(surface: ChartMesh, draft: Longs, uv: Doubles) -> tuple[Longs, Nodes]:
    """Give every polygon one chart: (T,) chart or -1 where a polygon has no area, and the positions in the charts.

    A polygon cut by a chart border moves into the chart that holds most of it, unfolded over the border; where it does
    not fit there (mirrored, overstretched, over another triangle) it becomes a chart of its own.
    """
    draft = np.where((uv_area_of(uv) > 0.0) & ~_repeated(draft, uv), draft, -1)
    nodes = Nodes(len(surface.points))
    charted = draft >= 0
    nodes.add(np.repeat(draft[charted], 3), surface.triangles[charted].ravel(), uv[charted].reshape(-1, 2))
    chart = _home(surface, draft)[surface.polygon]
    moved = surface.solid & (chart != draft) & (chart >= 0)
    unfold(surface, chart, nodes, moved)
    misfit = _misfits(surface, chart, nodes, moved)
    alone = np.bincount(surface.polygon, misfit | (surface.solid & (chart < 0)))[surface.polygon] > 0.0
    alone |= (chart < 0) & (np.bincount(surface.polygon, surface.area)[surface.polygon] > 0.0)
    chart = np.where(alone, surface.polygon + int(chart.max(initial=-1)) + 1, chart)
    _set_apart(surface, chart, nodes, alone)
    return chart, nodes


def _repeated(chart: Longs, uv: Doubles) -> Flags:
    """(T,) bool: triangles that lie exactly over an earlier one of their chart, as doubled faces do."""
    corners = np.sort(uv[..., 0] + 1j * uv[..., 1], axis=1)
    order = np.lexsort((*corners.T.imag, *corners.T.real, chart))  # stable, so the earlier comes first
    row = np.concatenate([chart[:, None], corners.real, corners.imag], axis=1)[order]
    repeated = np.zeros(len(chart), np.bool_)
    repeated[order[1:]] = (row[1:] == row[:-1]).all(axis=1)
    return repeated


def _home(surface: ChartMesh, draft: Longs) -> Longs:
    """(P,) the chart that holds most of each polygon, by area, or -1 where none holds any of it."""
    held = np.flatnonzero(draft >= 0)
    count = int(draft.max(initial=-1)) + 1
    pair, slot = np.unique(surface.polygon[held] * count + draft[held], return_inverse=True)
    area = np.bincount(slot.ravel(), surface.area[held])
    home = np.full(int(surface.polygon.max()) + 1, -1, np.int64)
    order = np.argsort(area, kind="stable")  # the largest is written last, and stays
    home[pair[order] // count] = pair[order] % count
    return home


def unfold(surface: ChartMesh, chart: Longs, nodes: Nodes, chosen: Flags) -> None:
    """Place the unknown corners of the chosen triangles: where two are known, the third follows by similarity."""
    waiting = np.flatnonzero(chosen)
    while len(waiting):
        uv, known = nodes.find(chart[waiting, None], surface.triangles[waiting])
        ready = known.sum(axis=1) == 2
        if not ready.any():
            return
        turn = (np.argmin(known[ready], axis=1)[:, None] + [1, 2, 0]) % 3
        vertices = np.take_along_axis(surface.triangles[waiting[ready]], turn, axis=1)
        base = np.take_along_axis(uv[ready], turn[:, :2, None], axis=1)
        nodes.add(chart[waiting[ready]], vertices[:, 2], _third(surface.points[vertices], base))
        waiting = waiting[~ready]


def _third(corners: Doubles, base: Doubles) -> Doubles:
    """(n, 2): the third corner of triangles (n, 3, 3), similar to the originals over the base (n, 2, 2)."""
    edge, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    length = np.maximum(square(edge), np.finfo(np.float64).tiny)[:, None]
    along = (edge * other).sum(axis=1)[:, None] / length
    up = 2.0 * area_of(corners)[:, None] / length
    run = base[:, 1] - base[:, 0]
    third: Doubles = base[:, 0] + along * run + up * np.stack([-run[:, 1], run[:, 0]], axis=1)
    return third


def _set_apart(surface: ChartMesh, chart: Longs, nodes: Nodes, alone: Flags) -> None:
    """Place the polygons that are charts of their own, each from its largest triangle.

    That triangle is at least 1 long and half as high, about a texel's worth: a smaller one would be lost in float32.
    """
    mine = np.flatnonzero(alone)
    mine = mine[np.lexsort((-surface.area[mine], surface.polygon[mine]))]
    seeds = mine[np.unique(surface.polygon[mine], return_index=True)[1]]
    corners = surface.points[surface.triangles[seeds]]
    lengths = np.sqrt(square(corners[:, [1, 2, 0]] - corners))
    turn = (np.argmax(lengths, axis=1)[:, None] + [0, 1, 2]) % 3
    vertices = np.take_along_axis(surface.triangles[seeds], turn, axis=1)
    base = np.zeros((len(seeds), 2, 2))
    base[:, 1, 0] = np.maximum(lengths.max(axis=1, initial=0.0), 1.0)
    apex = _third(surface.points[vertices], base)
    apex[:, 1] = np.maximum(apex[:, 1], 0.5)
    placed = np.concatenate([base, apex[:, None]], axis=1)
    nodes.add(np.repeat(chart[seeds], 3), vertices.ravel(), placed.reshape(-1, 2))
    unfold(surface, chart, nodes, alone)


def _misfits(surface: ChartMesh, chart: Longs, nodes: Nodes, moved: Flags) -> Flags:
    """(T,) bool: moved triangles that do not fit into their charts."""
    uv, known = nodes.find(chart[:, None], surface.triangles)
    fits = moved & known.all(axis=1) & (uv_area_of(uv) > 0.0)
    largest, least = singular(surface.points[surface.triangles[fits]], uv[fits])
    fits[fits] = (largest < MOST_STRETCH) & (least > 1.0 / MOST_STRETCH)
    present = known.all(axis=1) & surface.solid & (fits | ~moved)
    fits &= ~_overlapping(chart, uv, fits, present)
    misfit: Flags = moved & ~fits
    return misfit


def _overlapping(chart: Longs, uv: Doubles, suspects: Flags, present: Flags) -> Flags:
    """(T,) bool: suspects whose inside meets the inside of another triangle present in the same chart."""
    low, high = uv.min(axis=1), uv.max(axis=1)
    first, second = [np.empty(0, np.int64)], [np.empty(0, np.int64)]
    members = np.flatnonzero(present & np.isin(chart, chart[suspects]))
    members = members[np.argsort(chart[members], kind="stable")]
    for group in np.split(members, np.flatnonzero(np.diff(chart[members])) + 1):
        for some in np.array_split(group[suspects[group]], 1 + len(group) // 1000):  # bounds the memory
            meet = (low[some, None] < high[group]).all(axis=2) & (high[some, None] > low[group]).all(axis=2)
            one, other = np.nonzero(meet & (some[:, None] != group))
            first.append(some[one])
            second.append(group[other])
    a, b = np.concatenate(first), np.concatenate(second)
    crossing = ~(_separated(uv[a], uv[b]) | _separated(uv[b], uv[a]))
    found: Flags = np.bincount(a[crossing], minlength=len(chart)) > 0
    return found


def _separated(a: Doubles, b: Doubles) -> Flags:
    """(n,) bool: all of b (n, 3, 2) is outside an edge of a (n, 3, 2), counter-clockwise, give or take 1e-6."""
    edge = a[:, [1, 2, 0]] - a
    offset = b[:, None, :, :] - a[:, :, None, :]
    side = edge[:, :, None, 0] * offset[..., 1] - edge[:, :, None, 1] * offset[..., 0]
    outside: Flags = (side.max(axis=2) <= 1e-6 * np.sqrt(square(edge))).any(axis=1)
    return outside


def parts(surface: ChartMesh, chart: Longs) -> Longs:
    """(T,) the connected part of a chart each triangle lies in: moving polygons away may have left several."""
    ends = np.sort(np.stack([surface.triangles, surface.triangles[:, [1, 2, 0]]], axis=2), axis=2)
    vertex_count = len(surface.points)
    _, start = np.unique(chart[:, None] * vertex_count + ends[..., 0], return_inverse=True)
    _, edge = np.unique(start.reshape(-1, 3) * vertex_count + ends[..., 1], return_inverse=True)
    links = np.concatenate([edge.reshape(-1, 3), surface.polygon[:, None] + int(edge.max()) + 1], axis=1)
    part = np.arange(len(chart))
    while True:
        least = np.full(int(links.max()) + 1, len(chart))
        np.minimum.at(least, links.ravel(), np.repeat(part, 4))
        lower = least[links].min(axis=1)
        lower = lower[lower]
        if np.array_equal(lower, part):
            return np.where(chart >= 0, part, -1)
        part = lower
