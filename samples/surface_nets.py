"""Surfaces of fields, by surface nets (Gibson 1998, "Constrained elastic surface nets")."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]
Flags = NDArray[np.bool_]
Longs = NDArray[np.int64]

_CORNERS = np.array(list(np.ndindex(2, 2, 2)))


def surface_net(values: Doubles, low: Sequence[float] | Doubles, step: float) -> tuple[Doubles, Longs]:
    """Quads where a field is zero: a vertex in each cell that the surface passes, in the middle of where it crosses the
    cell's edges.

    values: (X, Y, Z) of the field, negative inside, on a grid that begins at `low` and is `step` apart. Returns (V, 3)
    points and (Q, 4) corners of quads, counter-clockwise seen from outside.
    """
    inside = values < 0.0
    corners = np.stack([_shifted(inside, corner) for corner in _CORNERS])
    active = corners.any(axis=0) & ~corners.all(axis=0)
    number = np.full(active.shape, -1, np.int64)
    number[active] = np.arange(np.count_nonzero(active), dtype=np.int64)
    points = low + step * (np.argwhere(active) + _crossing_middle(values, active))
    return points, _net_quads(inside, number)


def _shifted(grid: Any, corner: Longs) -> Any:
    """The value at one corner of each cell."""
    x, y, z = (slice(int(each), side - 1 + int(each)) for each, side in zip(corner, grid.shape, strict=True))
    return grid[x, y, z]


def _crossing_middle(values: Doubles, active: Flags) -> Doubles:
    """(n, 3): the mean place, within each active cell, of the surface on the cell's edges."""
    total, count = np.zeros((np.count_nonzero(active), 3)), np.zeros((np.count_nonzero(active), 1))
    at_corner = {tuple(corner): _shifted(values, corner)[active] for corner in _CORNERS}
    for start, here in at_corner.items():
        for axis in range(3):
            if start[axis] == 0:
                end = tuple(np.array(start) + np.eye(3, dtype=int)[axis])
                there = at_corner[end]
                crosses = (here < 0.0) != (there < 0.0)
                share = np.where(crosses, here / np.where(crosses, here - there, 1.0), 0.0)
                point = np.array(start, float) + share[:, None] * np.eye(3)[axis]
                total += np.where(crosses[:, None], point, 0.0)
                count += crosses[:, None]
    middle: Doubles = total / count
    return middle


def _net_quads(inside: Flags, number: Longs) -> Longs:
    """(Q, 4): about each edge of the grid that passes through the surface, the vertices of the four cells there."""
    quads = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        here, there = (_along(inside, axis, end) for end in (0, 1))
        edge = np.argwhere(here != there)
        edge = edge[(edge[:, u] > 0) & (edge[:, v] > 0)]
        edge = edge[(edge[:, u] < inside.shape[u] - 1) & (edge[:, v] < inside.shape[v] - 1)]
        around = np.zeros((4, 3), int)
        around[[0, 3], u], around[[0, 1], v] = -1, -1
        cells = edge[:, None] + around
        found = number[cells[..., 0], cells[..., 1], cells[..., 2]]
        leaves = here[edge[:, 0], edge[:, 1], edge[:, 2]]
        quads.append(np.where(leaves[:, None], found, found[:, ::-1]))
    return np.concatenate(quads)


def _along(grid: Flags, axis: int, end: int) -> Flags:
    """The first or the second end of every edge along an axis."""
    return np.take(grid, np.arange(end, grid.shape[axis] - 1 + end, dtype=np.int64), axis=axis)
