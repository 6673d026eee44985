"""Charts too thin to be told from a line in float32 made thicker."""

from __future__ import annotations

import numpy as np

from ..base.triangles import uv_area_of
from .chart_boxes import ChartBoxes, across, diagonals
from .repair import Layout

_LEAST = 0.05  # units, a good part of a texel in most images; float32 tells apart a thousandth of that


def thickened(layout: Layout) -> Layout:
    """The layout, each of its charts at least 0.05 units long and broad: what is a needle as a whole is stretched."""
    label, count, uv = layout.cuts.label, layout.cuts.count, layout.uv.copy()
    area = np.bincount(label, np.abs(uv_area_of(uv)), count)
    may = area < _LEAST * diagonals(label, count, uv)  # a chart fills no more than its length times its breadth
    some = np.flatnonzero(may[label])
    if not len(some):
        return layout
    number = np.cumsum(may, dtype=np.int64) - 1
    box = ChartBoxes.of(number[label[some]], int(may.sum()), uv[some])
    thin = (box.breadth < _LEAST) & (box.breadth > 0.0)
    chosen = some[thin[number[label[some]]]]
    chart = number[label[chosen]]
    off = uv[chosen] - box.middle[chart][:, None]
    placed = np.zeros_like(off)
    for axis, span in ((box.along, box.length), (across(box.along), box.breadth)):
        direction = axis[chart][:, None]
        growth = np.maximum(_LEAST / span[chart], 1.0)[:, None, None]
        placed += (off * direction).sum(axis=2, keepdims=True) * growth * direction
    uv[chosen] = placed
    return Layout(layout.cuts, uv)
