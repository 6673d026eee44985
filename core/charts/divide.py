"""Charts cut in two by the kernel, many at once."""

from __future__ import annotations

import numpy as np

from ..base import kernel_api as api
from ..base.arrays import Flags, Longs
from .chart_mesh import ChartMesh, halves_of
from .flat_charts import Cuts


def divided(
    mesh: ChartMesh,
    cuts: Cuts,
    wanted: Flags,
    apart: Longs | None = None,
    *,
    threads: int = 0,
    control: api.Control | None = None,
) -> Flags:
    """(T,) bool: which side of a cut the triangles of the wanted charts are on; False in all others.

    wanted: (C,) bool. apart: (C, 2) two triangles of a chart that are to be on different sides, the second on the
    second, as they lie on one another; -1, or None for all: about as far apart as any over the surface, so that long
    charts are cut across their length. threads: 0 for all of the machine's.

    Both sides of a cut hang together; polygons stay whole, so that a chart of one is False throughout. Cuts run along
    short borders, creases counting for less of their length; a border is taken for shorter, the more evenly it shares
    out the area. A ring is cut across twice, so that both sides are discs, unless its triangles `apart` are named. Same
    input, same output, on any number of threads. Raises Cancelled.

    The minimum cut (Ford and Fulkerson 1956) of the dual graph in a range between the two ends, on coarse copies of it
    first, as in graph partitioning (Hendrickson and Leland 1995, "A multilevel algorithm for partitioning graphs"),
    with costs as in a ratio cut (Hagen and Kahng 1992).
    """
    order, starts = in_order(cuts, wanted)
    number = np.full(len(mesh.triangles) + 1, -1, dtype=np.int64)  # the last is that of -1
    number[order] = np.arange(len(order), dtype=np.int64)
    halves = halves_of(order)
    twin = mesh.twin[halves]
    beyond = np.where(cuts.joined(mesh)[halves], 3 * number[twin // 3] + twin % 3, -1)
    ends = np.full((len(starts) - 1, 2), -1, dtype=np.int64) if apart is None else number[apart[wanted]]
    corners, polygon, weight = mesh.corners[order], mesh.polygon[order], mesh.cost(halves)
    side = np.zeros(len(order), np.uint8)
    status = api.library().ob_bisect(
        api.address(corners, np.float64, len(order), 3, 3),
        api.address(beyond, np.int64, 3 * len(order)),
        api.address(polygon, np.int64, len(order)),
        api.address(weight, np.float64, 3 * len(order)),
        len(order),
        api.address(starts, np.int64, len(ends) + 1),
        len(ends),
        api.address(ends, np.int64, len(ends), 2),
        threads,
        api.address(side, np.uint8, len(order)),
        api.pointer_to(control),
    )
    api.check(status)
    second = np.zeros(len(mesh.triangles), np.bool_)
    second[order] = side
    return second


def in_order(cuts: Cuts, wanted: Flags) -> tuple[Longs, Longs]:
    """The triangles of the wanted charts, chart by chart and in rising order in each; where each chart's start, and
    the end."""
    chosen = np.flatnonzero(wanted[cuts.label])
    order = chosen[np.argsort(cuts.label[chosen], kind="stable")]
    size = np.bincount(cuts.label[order], minlength=cuts.count)[wanted]
    return order, np.append(np.int64(0), np.cumsum(size, dtype=np.int64))
