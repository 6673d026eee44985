"""Which triangles of a UV layout lie on one another."""

from __future__ import annotations

from ctypes import byref, c_int64

import numpy as np

from ..base import kernel_api as api
from ..base.arrays import Doubles, Ints

MOST = 1 << 20  # pairs


def overlapping(
    uv: Doubles,
    tolerance: float,
    *,
    group: Ints | None = None,
    threads: int = 0,
    most: int = MOST,
    control: api.Control | None = None,
) -> Ints:
    """(n, 2) the pairs of triangles whose insides meet by more than the tolerance, lower number first, in rising order.

    uv: (T, 3, 2) finite, each triangle either way round. tolerance: zero or more, in the units of the UVs; how far one
    of the two would have to be moved to part them, by the separating axis theorem. A triangle no thicker than the
    tolerance overlaps none; those that share an edge or a corner and lie beside one another meet by nothing, but for
    rounding: the tolerance should be 1e-12 of the coordinates or more. group: (T,) pairs are of one group; None: all
    are. threads: 0 for as many as the machine has. most: the search ends at so many pairs, always the same ones; if
    fewer come back those are all, and 1 asks whether there are any, which is answered soonest.

    A search of pairs of nodes of a bounding volume hierarchy (Gottschalk, Lin and Manocha 1996, "OBBTree"), whose
    volumes are hulls of few edges. Raises Cancelled; InputError for UVs or a tolerance out of range.
    """
    pairs, count = np.empty((max(1, most), 2), np.int32), c_int64()
    status = api.library().ob_overlaps(
        api.address(uv, np.float64, len(uv), 3, 2),
        api.address(group, np.int32, len(uv)),
        len(uv),
        tolerance,
        threads,
        len(pairs),
        api.address(pairs, np.int32, len(pairs), 2),
        byref(count),
        api.pointer_to(control),
    )
    api.check(status)
    return pairs[: count.value].copy()


def lowest_overlaps(
    uv: Doubles, tolerance: float, group: Ints, count: int, *, threads: int = 0, control: api.Control | None = None
) -> Ints:
    """(count, 2) of each group the first pair that `overlapping` would give, or -1.

    uv, tolerance, threads: as there. group: (T,) 0 to count - 1. Raises Cancelled; InputError for UVs, groups or a
    tolerance out of range.
    """
    pairs = np.empty((count, 2), np.int32)
    status = api.library().ob_lowest_overlaps(
        api.address(uv, np.float64, len(uv), 3, 2),
        api.address(group, np.int32, len(uv)),
        len(uv),
        count,
        tolerance,
        threads,
        api.address(pairs, np.int32, count, 2),
        api.pointer_to(control),
    )
    api.check(status)
    return pairs
