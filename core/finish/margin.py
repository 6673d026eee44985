"""What is done to a baked image before it is written: the margin about its charts."""

from __future__ import annotations

import numpy as np

from ..base import kernel_api as api
from ..base.arrays import Flags, Floats
from ..base.errors import InputError


def fill_margin(values: Floats, covered: Flags, pixels: int) -> Floats:
    """Carry the charts' borders outward by up to `pixels` texels and calm what lies beyond.

    values: (h, w) float32; what it holds where nothing is covered is ignored. covered: (h, w) bool. Returns (h, w)
    float32. Ring by ring, each texel next to known ones (of its eight neighbours) takes their mean; the rings are those
    of the chessboard distance. Covered texels keep their bits. A texel out of reach takes the mean of all the covered
    ones: mip-maps average over it, and that mean pulls them least, where 0 or 1 would draw dark or bright seams. An
    image with nothing covered is 1, open. Raises InputError for a negative margin or shapes that differ, MemoryError.
    """
    if pixels < 0:
        raise InputError(f"margin {pixels}: cannot be negative; give 0 texels or more")
    if values.ndim != 2 or values.shape != covered.shape:
        raise InputError(f"margin: values {values.shape} and coverage {covered.shape} differ; give two (h, w) arrays")
    filled = np.array(values, dtype=np.float32, order="C")
    covered = np.ascontiguousarray(covered)
    (height, width), beyond = filled.shape, covered_mean(values, covered)
    places = (api.address(covered, np.bool_, height, width), api.address(filled, np.float32, height, width))
    texels = min(pixels, max(height, width))  # more reach no farther
    api.check(api.library().ob_fill_margin(places[0], width, height, texels, beyond, places[1]))
    return filled


def covered_mean(values: Floats, covered: Flags) -> float:
    """The mean of (h, w) values, or of all channels of (h, w, c), under (h, w) bool; 1, as of an open surface, where
    nothing is covered."""
    where = covered if values.ndim == 2 else covered[..., np.newaxis]
    return float(values.mean(dtype=np.float64, where=where)) if covered.any() else 1.0


def fill_margins(values: Floats, covered: Flags, pixels: int) -> Floats:
    """`fill_margin` for (h, w) values, or (h, w, c), each channel by itself; these are filled where they are, for
    a second array of a directional code can be too large."""
    if values.ndim == 2:
        return fill_margin(values, covered, pixels)
    for channel in range(values.shape[2]):
        values[..., channel] = fill_margin(values[..., channel], covered, pixels)
    return values
