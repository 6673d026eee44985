"""How to draw directions in proportion to the light that comes from them: cumulative tables over the cells of a map.

First a row is drawn, then a column in it, then a point of the cell, uniform in the map (Pharr, Jakob & Humphreys,
Physically Based Rendering, 2D piecewise constant distributions). All probabilities are whole steps of 2⁻²⁴, so that the
tables hold them exactly as float32 and what is told as the density is what is drawn; every cell that gives light has a
step at least, or light would be missed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.arrays import Doubles, Floats

_STEPS = 1 << 24


@dataclass(frozen=True, eq=False)
class PiecewiseConstant2D:
    """rows: (n,) float32, the cumulative probability of the rows; columns: (n, n) float32, of the columns of each row;
    both end in 1, and the part that is drawn is the first whose entry is above a number of [0, 1). density: (n, n)
    float32, the probability of the cell by its area in the square [-1, 1]²: with s = |x| + |y| + |z| a unit direction
    in it has the density `density` / s³ by solid angle."""

    rows: Floats
    columns: Floats
    density: Floats


def tables(weights: Doubles) -> PiecewiseConstant2D:
    """Draw the cells in proportion to weights, (n, n) float64, at least one of them above 0."""
    rows, columns = _cumulative(weights.sum(axis=1)), _cumulative(weights)
    cells = np.diff(rows, prepend=0.0)[:, np.newaxis] * np.diff(columns, axis=1, prepend=0.0)
    density = cells * (weights.size / 4.0)
    return PiecewiseConstant2D(rows.astype(np.float32), columns.astype(np.float32), density.astype(np.float32))


def _cumulative(weights: Doubles) -> Doubles:
    """Shares added up along the last axis, in whole steps, one at least for each weight above 0. Where no weight is,
    which is never drawn, they are equal."""
    weights = np.where(weights.any(axis=-1, keepdims=True), weights, 1.0)
    ends, lit = np.cumsum(weights, axis=-1), np.cumsum(weights > 0.0, axis=-1, dtype=np.int64)
    steps = np.rint(ends / ends[..., -1:] * (_STEPS - lit[..., -1:])) + lit
    shares: Doubles = steps / _STEPS
    return shares
