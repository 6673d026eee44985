"""Which triangles of a layout lie on one another, by separating axes: every pair that comes near is tried."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ....core.base.arrays import Doubles, Longs
from .row_spans import RowSpans, row_spans

_AT_ONCE = 1_000_000  # pairs
_ROWS = 4_000_000  # spans, for bounded memory


def overlaps(corners: Doubles, tolerance: float) -> tuple[Longs, Doubles]:
    """(n, 2) pairs of triangles that overlap by more than the tolerance, lower number first, and (n,) by how much.

    corners: (T, 3, 2), turned either way. Two triangles overlap by the least way that one must be moved to part them,
    and by no more than the least height of either: what is thinner than the tolerance has no inside to speak of.
    """
    upright = np.where((_doubled_area(corners) < 0.0)[:, None, None], corners[:, ::-1], corners)
    thin = least_height(upright)
    solid = np.flatnonzero(thin > tolerance)
    if len(solid) == 0:
        return np.empty((0, 2), np.int64), np.empty(0)
    shapes, thin = _Shapes.of(upright[solid]), thin[solid]
    found, depths = [np.empty((0, 2), np.int64)], [np.empty(0)]
    for near in _near(shapes.corners):
        pairs, depth = shapes.depths(near, tolerance)
        found.append(solid[pairs])
        depths.append(np.minimum(depth, thin[pairs].min(axis=1)))
    pairs, first = np.unique(np.sort(np.concatenate(found), axis=1), axis=0, return_index=True)
    return pairs, np.concatenate(depths)[first]


@dataclass(frozen=True, eq=False)
class _Shapes:
    """Counter-clockwise triangles. corners: (n, 3, 2). outward: (n, 3, 2) unit normals of the edges, the longest edge
    first; level: (n, 3) where the edges are along them."""

    corners: Doubles
    outward: Doubles
    level: Doubles

    @staticmethod
    def of(corners: Doubles) -> _Shapes:
        along = corners[:, [1, 2, 0]] - corners
        length = np.sqrt((along**2).sum(axis=-1))
        outward = np.stack([along[..., 1], -along[..., 0]], axis=-1) / length[..., None]
        level = (outward * corners).sum(axis=-1)
        order = np.argsort(-length, axis=1)
        outward = np.take_along_axis(outward, order[..., None], axis=1)
        return _Shapes(corners, outward, np.take_along_axis(level, order, axis=1))

    def depths(self, pairs: Longs, tolerance: float) -> tuple[Longs, Doubles]:
        """Those pairs (n, 2) that overlap by more than the tolerance, and by how much."""
        gap = np.full(len(pairs), -np.inf)
        for edge in range(3):
            for one, other in ((0, 1), (1, 0)):
                gap = np.maximum(gap, self._gap(pairs[:, one], edge, pairs[:, other]))
                pairs, gap = pairs[gap < -tolerance], gap[gap < -tolerance]
        return pairs, -gap

    def _gap(self, one: Longs, edge: int, other: Longs) -> Doubles:
        """(n,): how far all of the other is beyond that edge of the one; below 0 where it reaches over it."""
        x, y = self.outward[one, edge].T
        corners = self.corners[other]
        beyond = [x * corners[:, corner, 0] + y * corners[:, corner, 1] for corner in range(3)]
        gap: Doubles = np.minimum(np.minimum(beyond[0], beyond[1]), beyond[2]) - self.level[one, edge]
        return gap


def least_height(corners: Doubles) -> Doubles:
    """(T,): twice the area over the longest side; below 0 for triangles that are turned clockwise."""
    longest = np.sqrt(((corners - corners[:, [1, 2, 0]]) ** 2).sum(axis=2)).max(axis=1)
    height: Doubles = _doubled_area(corners) / np.maximum(longest, np.finfo(np.float64).tiny)
    return height


def _doubled_area(corners: Doubles) -> Doubles:
    p, q = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    doubled: Doubles = p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]
    return doubled


def _near(corners: Doubles) -> Iterator[Longs]:
    """Pairs (n, 2) of triangles whose spans in some row overlap, in portions; a pair may come more than once."""
    tall = corners[..., 1].max(axis=1) - corners[..., 1].min(axis=1)
    height = max(float(np.median(tall)), float(tall.sum()) / _ROWS, 1e-9)
    spans = row_spans(corners, height)
    order = np.lexsort((spans.start, spans.row))
    spans = RowSpans(*(each[order] for each in (spans.triangle, spans.row, spans.start, spans.end)))
    last = _last_reached(spans)
    reached = last - np.arange(len(last), dtype=np.int64) - 1
    portions = np.cumsum(reached) // _AT_ONCE
    for some in np.split(np.arange(len(last), dtype=np.int64), np.flatnonzero(np.diff(portions)) + 1):
        one = np.repeat(some, reached[some])
        start = np.repeat(np.cumsum(reached[some]) - reached[some], reached[some])
        other = one + 1 + np.arange(len(one), dtype=np.int64) - start
        yield np.stack([spans.triangle[one], spans.triangle[other]], axis=1)


def _last_reached(spans: RowSpans) -> Longs:
    """(n,): for spans by row and start, the number of the first one after it that begins beyond its end."""
    wide = float(spans.end.max() - spans.start.min()) + 1.0
    offset = (spans.row - spans.row.min()) * (2.0 * wide) - spans.start.min()
    after: Longs = np.searchsorted(spans.start + offset, spans.end + offset, side="left")
    return np.maximum(after, np.arange(len(after), dtype=np.int64) + 1)
