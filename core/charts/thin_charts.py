"""Charts too thin to be told from a line in float32 made thicker."""

from __future__ import annotations

import numpy as np

from .chart_boxes import ChartBoxes, across
from .repair import Layout

_LEAST = 0.05  # units, a good part of a texel in most images; float32 tells apart a thousandth of that


def thickened(layout: Layout) -> Layout:
    """The layout, each of its charts at least 0.05 units long and broad: what is a needle as a whole is stretched."""
    label = layout.cuts.label
    box = ChartBoxes.of(label, layout.cuts.count, layout.uv)
    thin = (box.breadth < _LEAST) & (box.breadth > 0.0)
    chosen = np.flatnonzero(thin[label])
    if not len(chosen):
        return layout
    chart, uv = label[chosen], layout.uv.copy()
    off = uv[chosen] - box.middle[chart][:, None]
    placed = np.zeros_like(off)
    for axis, span in ((box.along, box.length), (across(box.along), box.breadth)):
        direction = axis[chart][:, None]
        growth = np.maximum(_LEAST / span[chart], 1.0)[:, None, None]
        placed += (off * direction).sum(axis=2, keepdims=True) * growth * direction
    uv[chosen] = placed
    return Layout(layout.cuts, uv)
