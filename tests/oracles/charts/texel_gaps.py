"""How many texels lie free between charts, of all texels that a chart touches at all."""

from __future__ import annotations

import numpy as np

from ....core.base.arrays import Doubles, Longs
from .row_spans import row_spans

TOUCH = 1e-3  # texels: a chart that reaches no farther into one is not in it
_NONE = -1


def touched(corners: Doubles, chart: Longs, width: int, height: int) -> tuple[Longs, bool]:
    """(H, W) the chart that touches each texel, row 0 at v = 0, or -1; and whether any is touched by two.

    corners: (T, 3, 2) in texels. chart: (T,).
    """
    spans = row_spans(corners, within=TOUCH)
    first = np.floor(spans.start + TOUCH).astype(np.int64)
    last = np.ceil(spans.end - TOUCH).astype(np.int64) - 1
    short = last < first  # by a border it is in the texel of its middle, not in the next
    first[short] = last[short] = np.floor(0.5 * (spans.start + spans.end)[short])
    first, last = np.clip(first, 0, width - 1), np.clip(last, 0, width - 1)
    count = last - first + 1
    column = np.repeat(first - np.cumsum(count) + count, count) + np.arange(count.sum(), dtype=np.int64)
    row = np.repeat(np.clip(spans.row, 0, height - 1), count)
    owner = np.repeat(chart[spans.triangle], count)
    image = np.full((height, width), _NONE, np.int64)
    image[row, column] = owner
    return image, bool((image[row, column] != owner).any())


def kept_padding(corners: Doubles, chart: Longs, width: int, height: int, enough: int) -> int:
    """The least number of free texels between two charts, along rows, columns and diagonals; no more is looked for than
    `enough`. -1 where two charts touch one texel."""
    image, shared = touched(corners, chart, width, height)
    if shared:
        return -1
    return next((reach - 1 for reach in range(1, enough + 1) if _strangers(image, reach)), enough)


def _strangers(image: Longs, reach: int) -> bool:
    """Whether any two texels of different charts are within `reach` of one another, up, across or both."""
    held = image != _NONE
    most = _spread(np.where(held, image, -1), reach, np.maximum)
    least = _spread(np.where(held, image, np.iinfo(np.int64).max), reach, np.minimum)
    return bool((held & ((most != image) | (least != image))).any())


def _spread(image: Longs, reach: int, pick: np.ufunc) -> Longs:
    """The most, or the least, within a square about each texel."""
    wide = image.copy()
    for shift in range(1, reach + 1):
        pick(wide[:, shift:], image[:, :-shift], out=wide[:, shift:])
        pick(wide[:, :-shift], image[:, shift:], out=wide[:, :-shift])
    tall = wide.copy()
    for shift in range(1, reach + 1):
        pick(tall[shift:], wide[:-shift], out=tall[shift:])
        pick(tall[:-shift], wide[shift:], out=tall[:-shift])
    return tall
