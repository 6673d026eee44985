"""Charts packed into an image by their outlines."""

from __future__ import annotations

from ctypes import byref

import numpy as np

from ..base import kernel_api as api
from ..base.arrays import Doubles, Ints, Longs


def packed(
    uv: Doubles,
    piece: Longs | Ints,
    size: tuple[int, int],
    padding: int,
    *,
    align: bool = True,
    threads: int = 0,
    control: api.Control | None = None,
) -> tuple[Doubles, int]:
    """Lay charts out in the unit square, at the largest scale found: (T, 3, 2) UVs, and the padding kept.

    uv: (T, 3, 2), each chart in any place of its own, all at one scale; triangles counter-clockwise, in any number on
    one another. piece: (T,) the chart of each triangle, from 0. size: width and height of the image in texels, which
    are square. padding: texels to keep free between any two charts, of all that a chart touches at all, up to 65536;
    none at the image's border. align: charts are first turned so that the boxes about them are as small as can be; not
    those whose boxes are already. Beyond that they are turned by quarters where that makes them lie lower, and never
    mirrored. threads: 0 for as many as the machine has; the layout does not depend on it. control: tells how far it is,
    and stops it.

    The padding is halved, again and again, as long as less than half of the image is used and half the padding uses a
    tenth more: so it is kept by charts that are large beside it, and by those whose shapes leave the image empty
    whatever the padding. Charts that have no place without any come to share texels, and still do not overlap.

    Charts are placed one by one, large ones first, where they lie lowest in what is free, holes too, on a bitmap of the
    image: the "Tetris" packing of Levy et al. 2002, "Least Squares Conformal Maps for Automatic Texture Atlas
    Generation", without its horizon. Raises Cancelled; InputError for UVs that are not finite or a size out of range.
    """
    facing, chart = np.ascontiguousarray(uv, np.float64), np.ascontiguousarray(piece, np.int32)
    packing = api.Packing(width=size[0], height=size[1], padding=padding, align=int(align), threads=threads)
    layout = np.empty_like(facing)
    status = api.library().ob_pack(
        api.address(facing, np.float64, len(facing), 3, 2),
        api.address(chart, np.int32, len(facing)),
        len(facing),
        int(chart.max(initial=-1)) + 1,
        byref(packing),
        api.address(layout, np.float64, len(facing), 3, 2),
        api.pointer_to(control),
    )
    api.check(status)
    layout /= size
    return layout, int(packing.kept_padding)


def expected_scale(area: float, perimeter: float, count: int, size: tuple[int, int], padding: int) -> float:
    """At about how many texels a unit `packed` will lay charts out.

    area, perimeter, count: the charts' areas and the lengths of their borders in sum, in one unit of length, and how
    many they are. size, padding: as in `packed`, which may keep less padding. What is taken of an image by a chart with
    half of the padding about it is its area, and the width of that along its border; charts take about three quarters.
    0 where they have no room, or neither area nor border.
    """
    packing = api.Packing(width=size[0], height=size[1], padding=padding)
    api.check(api.library().ob_expect_packing(area, perimeter, count, byref(packing)))
    return float(packing.scale)
