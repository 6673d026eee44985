"""Charts cut into smaller ones: in two, or a long one across its length into parts."""

from __future__ import annotations

import numpy as np

from ..base import kernel_api as api
from ..base.arrays import Doubles, Flags, Ints, Longs


def halves(
    corners: Doubles,
    neighbours: Longs,
    polygon: Longs,
    weight: Doubles,
    apart: tuple[int, int] | None = None,
    *,
    control: api.Control | None = None,
) -> Flags:
    """(T,) whether each triangle is on the second side of a chart that is cut in two along a short border.

    Both sides hang together; a border is taken for shorter, the more evenly it shares out the area. corners: (T, 3, 3)
    the points. neighbours: (T, 3) across the edge from corner i to i + 1 the triangle of the chart beyond, or -1; each
    is its neighbour's neighbour. polygon: (T,) triangles of one polygon stay together, whatever is asked for. weight:
    (T, 3) what a border along each edge costs, zero or more: its length, times less than one on creases or in hollows,
    say. apart: two triangles, the first on the first side and the second on the second, as of a pair that overlaps.
    None, or two of one polygon: two about as far apart as any over the surface, so that long charts are cut across
    their length. All False of a chart of one polygon.

    The minimum cut (Ford and Fulkerson 1956) of the dual graph in a range between the two ends, on coarse copies of it
    first, as in graph partitioning (Hendrickson and Leland 1995, "A multilevel algorithm for partitioning graphs"),
    with costs as in a ratio cut (Hagen and Kahng 1992). Raises Cancelled, InputError.
    """
    count, side = len(neighbours), np.zeros(len(neighbours), np.uint8)
    first, second = (-1, -1) if apart is None else apart
    status = api.library().ob_bisect(
        api.address(corners, np.float64, count, 3, 3),
        api.address(neighbours, np.int64, count, 3),
        api.address(polygon, np.int64, count),
        api.address(weight, np.float64, count, 3),
        count,
        first,
        second,
        api.address(side, np.uint8, count),
        api.pointer_to(control),
    )
    api.check(status)
    return side.astype(np.bool_)


def pieces(
    corners: Doubles,
    neighbours: Longs,
    polygon: Longs,
    weight: Doubles,
    count: int,
    *,
    control: api.Control | None = None,
) -> Ints:
    """(T,) the part of each triangle, from 0 at one end of a chart to the other, of about `count` of like length.

    The chart is given as for `halves`; parts end along short borders near the lines that part it evenly. A part that
    does not hang together, as where a chart forks, is as many parts, so that there may be more than asked for; polygons
    longer than a part make them fewer. Raises Cancelled, InputError.
    """
    part = np.zeros(len(neighbours), np.int32)
    status = api.library().ob_divide(
        api.address(corners, np.float64, len(part), 3, 3),
        api.address(neighbours, np.int64, len(part), 3),
        api.address(polygon, np.int64, len(part)),
        api.address(weight, np.float64, len(part), 3),
        len(part),
        count,
        api.address(part, np.int32, len(part)),
        api.pointer_to(control),
    )
    api.check(status)
    return part
