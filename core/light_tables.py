"""How to draw directions in proportion to the light that comes from them: cumulative tables over the cells of a map.

First a row is drawn, then a column in it, then a point of the cell, uniform in the map (Pharr, Jakob & Humphreys,
Physically Based Rendering, 2D piecewise constant distributions). All probabilities are whole steps of 2⁻²⁴, so that the
tables hold them exactly as float32 and what is told as the density is what is drawn; every cell that gives light has a
step at least, or light would be missed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .scene import Doubles, Floats

_STEPS = 1 << 24


@dataclass(frozen=True, eq=False)
class Sampling:
    """rows: (n,) float32, the cumulative probability of the rows; columns: (n, n) float32, of the columns of each row;
    both end in 1, and the part that is drawn is the first whose entry is above a number of [0, 1). density: (n, n)
    float32, the probability of the cell by its area in the square [-1, 1]²: with s = |x| + |y| + |z| a unit direction
    in it has the density `density` / s³ by solid angle."""

    rows: Floats
    columns: Floats
    density: Floats


def tables(weights: Doubles) -> Sampling:
    """Draw the cells in proportion to weights, (n, n) float64, at least one of them above 0."""
    n = len(weights)
    rows, columns = _shares(weights.sum(axis=1)), _shares(weights)
    probabilities = rows[:, np.newaxis] * columns / _STEPS**2
    return Sampling(_cumulative(rows), _cumulative(columns), (probabilities * (n * n / 4.0)).astype(np.float32))


def _shares(weights: Doubles) -> NDArray[np.int64]:
    """Whole steps that add up to all of them along the last axis, one at least for each weight above 0. Where no weight
    is, which is never drawn, they are equal."""
    total = weights.sum(axis=-1, keepdims=True)
    weights = np.where(total > 0.0, weights, 1.0)
    ends = np.cumsum(weights, axis=-1)
    lit = weights > 0.0
    spare = _STEPS - np.count_nonzero(lit, axis=-1, keepdims=True)
    steps = np.rint(ends / ends[..., -1:] * spare).astype(np.int64)
    return np.diff(steps, axis=-1, prepend=0) + lit


def _cumulative(steps: NDArray[np.int64]) -> Floats:
    return (np.cumsum(steps, axis=-1) / _STEPS).astype(np.float32)
