"""What is done to a baked image before it is written: the margin about its charts."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Doubles, Flags, Floats
from ..base.errors import InputError

Kind = TypeVar("Kind", bound=np.generic)


def fill_margin(values: Floats, covered: Flags, pixels: int) -> Floats:
    """Carry the charts' borders outward by up to `pixels` texels and calm what lies beyond.

    values: (h, w) float32; what it holds where nothing is covered is ignored. covered: (h, w) bool. Returns (h, w)
    float32. Ring by ring, each texel next to known ones (of its eight neighbours) takes their mean; the rings are those
    of the chessboard distance. Covered texels keep their bits. A texel out of reach takes the mean of all the covered
    ones: mip-maps average over it, and that mean pulls them least, where 0 or 1 would draw dark or bright seams. An
    image with nothing covered is 1, open. Raises InputError for a negative margin or shapes that differ.
    """
    if pixels < 0:
        raise InputError(f"margin {pixels}: cannot be negative; give 0 texels or more")
    if values.ndim != 2 or values.shape != covered.shape:
        raise InputError(f"margin: values {values.shape} and coverage {covered.shape} differ; give two (h, w) arrays")
    stride = values.shape[1] + 2
    filled = _framed(np.where(covered, values, np.float32(0.0)))  # unknown texels add nothing to a sum
    known = _framed(covered)
    waiting = _framed(~covered)  # the frame waits for nothing, so no ring leaves the image or wraps around it
    ring = _first_ring(known, waiting, stride)
    for _ in range(pixels):
        if len(ring) == 0:
            break
        filled[ring] = _mean_of_known(filled, known, ring, stride)
        known[ring] = True
        ring = _next_ring(ring, waiting, stride)
    np.copyto(filled, np.float32(covered_mean(values, covered)), where=~known)
    return np.ascontiguousarray(filled.reshape(-1, stride)[1:-1, 1:-1])


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


def _framed(image: NDArray[Kind]) -> NDArray[Kind]:
    """The image, flat, in a frame of zeros one texel wide."""
    return np.pad(image, 1).ravel()


def _axes(stride: int) -> tuple[int, int, int, int]:
    """Steps to four of the eight neighbours; the other four are opposite."""
    return 1, stride, stride - 1, stride + 1


def _first_ring(known: Flags, waiting: Flags, stride: int) -> NDArray[np.intp]:
    """Waiting texels that touch a known one, no longer waiting: the only pass over the whole image."""
    touched = np.zeros_like(known)
    for step in _axes(stride):
        touched[step:] |= known[:-step]
        touched[:-step] |= known[step:]
    ring = np.flatnonzero(touched & waiting)
    waiting[ring] = False
    return ring


def _next_ring(ring: NDArray[np.intp], waiting: Flags, stride: int) -> NDArray[np.intp]:
    """Waiting texels that touch the ring. Each is found once, for it waits no longer when it has been found."""
    found = []
    for step in _axes(stride):
        for neighbours in (ring - step, ring + step):
            fresh = neighbours[waiting[neighbours]]
            waiting[fresh] = False
            found.append(fresh)
    return np.concatenate(found)


def _mean_of_known(filled: Floats, known: Flags, ring: NDArray[np.intp], stride: int) -> Doubles:
    """Means over the known neighbours of each texel of the ring.

    Opposite neighbours are added first, then straight to diagonal ones: turning or mirroring the image only swaps the
    two sides of an addition, so the result turns with it to the last bit.
    """
    sums = []
    count = np.zeros(len(ring), dtype=np.uint8)
    for step in _axes(stride):
        before, after = ring - step, ring + step
        sums.append(filled[before].astype(np.float64) + filled[after])
        count += known[before]
        count += known[after]
    mean: Doubles = ((sums[0] + sums[1]) + (sums[2] + sums[3])) / count
    return mean
