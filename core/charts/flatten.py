"""Charts flattened by the kernel, with little stretch and no mirrored triangle."""

from __future__ import annotations

import numpy as np

from ..base import kernel_api as api
from ..base.arrays import Doubles, Ints, Longs
from ..base.kernel_api import Control

FLATTENED, NOT_A_DISK, NOT_FLAT, NOT_TRIED = range(4)


def flattened(
    points: Doubles,
    triangles: Longs | Ints,
    starts: Longs,
    *,
    most: int | None = None,
    threads: int = 0,
    control: Control | None = None,
) -> tuple[Doubles, Doubles, Ints]:
    """Lay charts out in the plane: (V, 2) float64 places of the vertices, in the units of the points; (T,) float64
    squares of the triangles' L2 stretch (Sander et al. 2001), after one scale for each chart; (C,) int32 states.

    points: (V, 3) float64. triangles: (T, 3) vertices; those of chart c are starts[c] to starts[c + 1], of (C + 1,). A
    vertex belongs to one chart: charts are split along their seams. most: triangles of a chart that is laid flat though
    it is no plane. threads: 0 for all of the machine's.

    A chart's state is FLATTENED; NOT_A_DISK: closed, more than one border, a handle, not a surface, or several pieces;
    NOT_FLAT: it has a triangle that double precision, or float32 at 1000 texels, does not tell from a mirrored or an
    empty one, or no area at all; or NOT_TRIED: too many triangles. The stretch of what is not flattened is 1.

    A plane is projected, of any outline; any other chart is unfolded from a coarse version of itself, intrinsic and
    down to a triangle where it can be developed, vertex by vertex and without ever turning a triangle over, as its
    symmetric Dirichlet energy (Smith and Schaefer 2015, "Bijective Parameterization with Free Boundaries") is brought
    down at each scale. Triangles are counter-clockwise where they turn so on the surface, seen from its front; the area
    of a chart is that of its surface. The border may lie over itself. Time is linear in the triangles. Same input, same
    output, on any number of threads.

    Raises InputError where a triangle names a vertex that does not exist, two charts share a vertex, or a point is not
    finite; Cancelled.
    """
    points = np.ascontiguousarray(points, np.float64)
    corners = np.ascontiguousarray(triangles, np.int32)
    starts = np.ascontiguousarray(starts, np.int64)
    uv = np.empty((len(points), 2))
    stretch, state = np.empty(len(corners)), np.empty(len(starts) - 1, np.int32)
    status = api.library().ob_flatten(
        api.address(points, np.float64, len(points), 3),
        len(points),
        api.address(corners, np.int32, len(corners), 3),
        len(corners),
        api.address(starts, np.int64, len(state) + 1),
        len(state),
        len(corners) if most is None else most,
        threads,
        api.address(uv, np.float64, len(points), 2),
        api.address(stretch, np.float64, len(corners)),
        api.address(state, np.int32, len(state)),
        api.pointer_to(control),
    )
    api.check(status)
    return uv, stretch, state
