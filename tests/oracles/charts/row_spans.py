"""Triangles cut into rows: what a layout covers, and which of its triangles come near one another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ....core.base.arrays import Doubles, Longs


@dataclass(frozen=True, eq=False)
class RowSpans:
    """Which part of each row of the plane each triangle reaches into, a span for each row that it does.

    triangle: (n,) which one. row: (n,) row r reaches from r to r + 1 row heights. start, end: (n,) along the row.
    """

    triangle: Longs
    row: Longs
    start: Doubles
    end: Doubles


def row_spans(corners: Doubles, height: float = 1.0, within: float = 0.0) -> RowSpans:
    """Of triangles (n, 3, 2). Rows that a triangle reaches into by no more than `within` at their edges are left out.

    A triangle's part of a row is convex, so its ends are at corners in the row or where edges cross the row's borders.
    """
    low, high = corners[..., 1].min(axis=1) + within, corners[..., 1].max(axis=1) - within
    high = np.maximum(low, high)
    first, last = np.floor(low / height).astype(np.int64), np.ceil(high / height).astype(np.int64) - 1
    last = np.maximum(first, last)
    count = last - first + 1
    triangle = np.repeat(np.arange(len(corners), dtype=np.int64), count)
    row: Longs = np.arange(len(triangle), dtype=np.int64)
    row += np.repeat(first - np.cumsum(count) + count, count)
    bottom = np.maximum(row * height, low[triangle])
    top = np.minimum((row + 1) * height, high[triangle])
    start, end = np.full(len(triangle), np.inf), np.full(len(triangle), -np.inf)
    for one, other in ((0, 1), (1, 2), (2, 0)):
        (x0, y0), (x1, y1) = corners[triangle, one].T, corners[triangle, other].T
        rise = np.where(y1 == y0, 1.0, y1 - y0)
        touched = (np.minimum(y0, y1) <= top) & (np.maximum(y0, y1) >= bottom)
        for level in (bottom, top):
            share = np.clip((level - y0) / rise, 0.0, 1.0)
            for x in (x0 + share * (x1 - x0), np.where(y1 == y0, x1, x0 + share * (x1 - x0))):
                start = np.where(touched, np.minimum(start, x), start)
                end = np.where(touched, np.maximum(end, x), end)
    return RowSpans(triangle, row, start, end)
