"""Charts too long for an image, or too bent to lie close to others, cut across, so that none of them decides how small
all the others become."""

from __future__ import annotations

import numpy as np

from ..base.arrays import Doubles, Flags
from ..base.kernel_api import Control
from ..base.triangles import uv_area_of
from .chart_boxes import ChartBoxes
from .chart_mesh import ChartMesh
from .divide import divided
from .flat_charts import Cuts
from .packing import expected_scale
from .repair import Layout, split

# A chart may be this long, a part of the image's longer side, unless it fills so much of the square of its length: then
# it takes the room of many, and is no longer than they would be.
_LONGEST, _COMPACT = 0.8, 0.5
# A chart that fills less than this of its box is bent; it may be this long, a part of the longer side.
_BENT, _LONGEST_BENT = 0.3, 0.4
# Where charts fill less than this of their boxes in sum, those are cut that leave so much of what is left empty, or a
# good part of what the emptiest one leaves.
_FILLED, _GOOD_PART = 0.3, 0.25


def shortened(
    mesh: ChartMesh, layout: Layout, size: tuple[int, int], padding: int, control: Control | None = None
) -> Layout:
    """The layout, its charts such as will fit when they are packed into an image of `size` texels. Raises Cancelled."""
    uv, cuts = layout.uv, layout.cuts
    pending = np.ones(cuts.count, np.bool_)
    while (unfit := pending & _unfit(mesh, cuts, uv, size, padding)).any():
        side = divided(mesh, cuts, unfit, control=control)
        cuts, before, _ = split(mesh, cuts, side.astype(np.int64))
        pending = (pending & ~(unfit & (np.bincount(before) == 1)))[before]  # what could not be cut stays
    return Layout(cuts, _as_large(mesh, cuts, uv))


def _as_large(mesh: ChartMesh, cuts: Cuts, uv: Doubles) -> Doubles:
    """(T, 3, 2) UVs, each chart as large as its surface: a part of one that was need not be."""
    drawn = np.bincount(cuts.label, np.maximum(uv_area_of(uv), 0.0), cuts.count)
    surface = np.bincount(cuts.label, mesh.area, cuts.count)
    scale = np.sqrt(np.divide(surface, drawn, out=np.ones_like(drawn), where=(drawn > 0.0) & (surface > 0.0)))
    return np.asarray(uv * scale[cuts.label][:, None, None])


def _unfit(mesh: ChartMesh, cuts: Cuts, uv: Doubles, size: tuple[int, int], padding: int) -> Flags:
    """(C,) bool: charts that are too long, or too bent."""
    area: Doubles = np.bincount(cuts.label, np.maximum(uv_area_of(uv), 0.0), cuts.count).astype(np.float64)
    perimeter = float(mesh.lengths[~cuts.joined(mesh)].sum())
    scale = expected_scale(float(area.sum()), perimeter, cuts.count, size, padding)
    box = ChartBoxes.of(cuts.label, cuts.count, uv)
    bent = area < _BENT * box.area
    compact = area >= _COMPACT * box.length**2
    long = box.length * scale > np.where(bent, _LONGEST_BENT, _LONGEST) * max(size)
    return np.asarray((long & ~compact) | _spread(area, box.area))


def _spread(area: Doubles, box: Doubles) -> Flags:
    """(C,) bool: charts, each of an area in a box of another, most of which are to be cut if an image is to be filled:
    arcs, that leave their insides empty."""
    empty = np.where(area < _FILLED * box, box - area, 0.0)
    if area.sum() >= _FILLED * box.sum():
        return np.zeros(len(area), np.bool_)
    return np.asarray(empty > _GOOD_PART * empty.max())
