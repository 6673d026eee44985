"""What the rays of a map are summed up to, and what is read from the sums: rows of values between 0 and 1.

A map of visibility has one row, its value. One with the bent direction has three more: the mean of V times each part
of the ray's direction, from -1 to 1, as (1 + mean) / 2. One of light has a row for each colour, the share of the light
that gets through, and before these their mean: by it rays are spread over the texels, and its error is told.

The share of light is a ratio of two sums over the same rays, so it is exact where all or nothing is visible; its bias
falls as one over the rays (Cochran, "Sampling Techniques", chapter 6).
"""

from __future__ import annotations

from enum import IntEnum
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Doubles, Floats, Reals

_Real = TypeVar("_Real", np.float32, np.float64)


class Accumulator(IntEnum):
    """What is summed up; the values are the kernel's."""

    VISIBILITY = 0
    BENT = 1
    LIGHT = 2

    @property
    def images(self) -> int:
        """Sums that the kernel fills."""
        return {Accumulator.VISIBILITY: 1, Accumulator.BENT: 4, Accumulator.LIGHT: 6}[self]

    def totals(self, sums: Floats, rays: int) -> Floats:
        """The rows, times the rays: (images, …) float32 sums over so many rays → (rows, …) float32; -1 stays where the
        first sum is -1, a texel that faces away. One of visibility is given back as it is."""
        if self is Accumulator.VISIBILITY:
            return sums
        away = sums[0] < 0.0
        if self is Accumulator.BENT:
            rows = np.concatenate([sums[:1], 0.5 * (np.float32(rays) + sums[1:])])
        else:
            lit = sums[3:] > 0.0
            shares = np.divide(sums[:3], sums[3:], out=np.ones_like(sums[:3]), where=lit) * np.float32(rays)
            rows = np.concatenate([shares.mean(axis=0, keepdims=True), shares])
        rows[:, away] = -1.0
        totals: Floats = rows.astype(np.float32)
        return totals


def directions(rows: Reals) -> Doubles:
    """What the rows after the first, (R - 1, …), stand for, where their error is told: of three for a bent direction
    that direction, at unit length; zero stays."""
    vectors = bent_vectors(rows.astype(np.float64))
    length = np.linalg.norm(vectors, axis=0, keepdims=True)
    unit: Doubles = np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 1e-6)
    return unit


def bent_vectors(rows: NDArray[_Real]) -> NDArray[_Real]:
    """The means of V times direction, (3, …), from the three rows after the first of a map with the bent direction."""
    vectors: NDArray[_Real] = 2.0 * rows - 1.0
    return vectors
