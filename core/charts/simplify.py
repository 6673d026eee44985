"""Meshes simplified for the chart cutter, which sees their shape and not their noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.arrays import Doubles, Flags, Ints, Longs
from ..base.kernel_api import Control, address, check, library, pointer_to
from ..base.triangles import square


@dataclass(frozen=True, eq=False)
class Simplified:
    """A mesh with fewer triangles, and where those of the whole mesh are in it.

    root: (T,) int32, for each triangle of the whole mesh one that stands for the simplified triangle that it lies at;
    that one is its own. Triangles of one root are connected, over edges that are part of no line. survivors: (S,)
    int64, those that stand for others, rising. triangles: (S, 3) int32, the corners of the simplified triangles, which
    are vertices of the whole mesh. lines: (S, 3) bool, whether the edge from corner i to corner i + 1 is part of a
    line: of a border, of a line that was to be kept, or where three or more triangles meet.
    """

    root: Ints
    triangles: Ints
    survivors: Longs
    lines: Flags

    @property
    def patch(self) -> Longs:
        """(T,) the row in `triangles` of the simplified triangle that each triangle of the whole mesh lies at."""
        row: Longs = np.searchsorted(self.survivors, self.root)
        return row

    def smoothed(self, points: Doubles, within: float, steps: int = 3) -> Doubles:
        """(V, 3) places of the vertices for the chart cutter alone, for the vertices left still carry the noise that
        each of them had.

        Each step moves a vertex half of the way to the mean of its neighbours (Laplacian smoothing), never farther than
        `within` (above 0) from its own place, so that creases stay. Vertices on lines stay too.
        """
        used, numbered = np.unique(self.triangles, return_inverse=True)
        corners = numbered.reshape(-1, 3)
        following = np.roll(corners, -1, axis=1)
        one, other = np.concatenate([corners.ravel(), following.ravel()]), np.concatenate([following, corners]).ravel()
        free = np.ones(len(used), np.bool_)
        free[corners[self.lines]] = free[following[self.lines]] = False
        degree = np.bincount(one, minlength=len(used))[:, None]
        start = points[used]
        place = start.copy()
        for _ in range(steps):
            sums = [np.bincount(one, place[other, axis], minlength=len(used)) for axis in range(3)]
            way = 0.5 * (place + np.stack(sums, axis=1) / degree) - start
            length = np.sqrt(square(way))[:, None]
            way *= within / np.maximum(length, within)
            place[free] = (start + way)[free]
        result: Doubles = points.copy()
        result[used] = place
        return result


def simplified(
    points: Doubles,
    triangles: Longs,
    kept: Flags,
    tolerance: float,
    most: int,
    *,
    control: Control | None = None,
) -> Simplified:
    """Collapse edges onto one of their ends, cheapest first, by quadric error.

    After Garland & Heckbert 1997, "Surface Simplification Using Quadric Error Metrics"; topology is kept as Dey,
    Edelsbrunner, Guha & Nekhayev 1999, "Topology Preserving Edge Contraction", say. points: (V, 3) float64, best with
    a surface of 1000 x 1000. triangles: (T, 3) int64, none uses a vertex twice. kept: (T, 3) bool, edges, from corner i
    to corner i + 1, that are part of a line which nothing is collapsed across; so are edges with other than two
    triangles that turn the same way. Along lines vertices go too, where the line stays within the tolerance. tolerance:
    how far collapses move the surface (root mean square over what a vertex stands for, in units of the points). most:
    while more triangles are left than that, it goes on beyond the tolerance, as long as anything can go. control: set
    its `cancel` to stop. Time and memory grow with the triangles, and with the vertices, used or not; many loose pieces
    are best done in one call. Raises Cancelled, MemoryError, and InputError for a mesh that breaks this.
    """
    count = len(triangles)
    corners, flags = np.ascontiguousarray(triangles, np.int32), np.ascontiguousarray(kept, np.uint8)
    places = np.ascontiguousarray(points, np.float64)
    root, left, lines = np.zeros(count, np.int32), np.zeros((count, 3), np.int32), np.zeros((count, 3), np.uint8)
    check(
        library().ob_simplify(
            address(places, np.float64, len(points), 3),
            len(points),
            address(corners, np.int32, count, 3),
            count,
            address(flags, np.uint8, count, 3),
            tolerance,
            most,
            address(root, np.int32, count),
            address(left, np.int32, count, 3),
            address(lines, np.uint8, count, 3),
            pointer_to(control),
        )
    )
    survivors: Longs = np.flatnonzero(root == np.arange(count, dtype=np.int64))
    return Simplified(root, left[survivors], survivors, lines[survivors] != 0)
