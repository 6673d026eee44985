"""Meshes simplified for the chart cutter, which sees their shape and not their noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.arrays import Doubles, Flags, Ints, Longs
from ..base.kernel_api import Control, address, check, library, pointer_to


@dataclass(frozen=True, eq=False)
class Simplified:
    """A mesh with fewer triangles, and where those of the whole mesh are in it.

    root: (T,) int32, for each triangle of the whole mesh the number of the one that is left in its place; those that
    are left are their own. Triangles of one root are connected, over edges that are part of no line. survivors: (S,)
    int64, the numbers of the triangles left, rising. triangles: (S, 3) int32, their corners, which are vertices of the
    whole mesh.
    """

    root: Ints
    triangles: Ints
    survivors: Longs

    @property
    def patch(self) -> Longs:
        """(T,) the row in `triangles` of the one that is left in the place of each triangle of the whole mesh."""
        row: Longs = np.searchsorted(self.survivors, self.root)
        return row


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
    its `cancel` to stop. Raises Cancelled, MemoryError, and InputError for a mesh that breaks this.
    """
    count = len(triangles)
    corners, flags = np.ascontiguousarray(triangles, np.int32), np.ascontiguousarray(kept, np.uint8)
    places = np.ascontiguousarray(points, np.float64)
    root, left = np.zeros(count, np.int32), np.zeros((count, 3), np.int32)
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
            pointer_to(control),
        )
    )
    survivors: Longs = np.flatnonzero(root == np.arange(count))
    return Simplified(root, left[survivors], survivors)
