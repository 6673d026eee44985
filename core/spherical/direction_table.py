"""A smooth function of direction, tabulated over the sphere and interpolated.

Rows go by the polar angle and columns around, so that it is as smooth in the table as on the sphere: beyond a pole the
table goes on, half a turn away. Four points each way make the cubic through them (Lagrange), whose error falls with the
fourth power of the step.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..base.arrays import Doubles
from ..base.elementary import arctan2, cos, sin

_BAND = 1 << 15  # directions at a time
_PAD = 2


class SphereTable:
    """function: unit directions (N, 3) → values (N, C). rows: of the table, even; it has twice as many columns."""

    def __init__(self, function: Callable[[Doubles], Doubles], rows: int) -> None:
        polar = (np.arange(rows, dtype=np.int64) + 0.5) * (np.pi / rows)
        turn = np.arange(2 * rows, dtype=np.int64) * (np.pi / rows)
        sine = sin(polar)[:, np.newaxis]
        height = np.broadcast_to(cos(polar)[:, np.newaxis], (rows, 2 * rows))
        ways = np.stack([sine * cos(turn), sine * sin(turn), height], axis=-1).reshape(-1, 3)
        values = function(ways).reshape(rows, 2 * rows, -1)
        beyond = np.roll(values, rows, axis=1)
        values = np.concatenate([beyond[:_PAD][::-1], values, beyond[-_PAD:][::-1]])
        self._rows = rows
        self._values = np.pad(values, ((0, 0), (_PAD, _PAD), (0, 0)), mode="wrap")

    def __call__(self, directions: Doubles) -> Doubles:
        """(N, 3) unit → (N, C) float64."""
        found = np.empty((len(directions), self._values.shape[2]))
        for start in range(0, len(directions), _BAND):
            found[start : start + _BAND] = self._interpolated(directions[start : start + _BAND])
        return found

    def _interpolated(self, directions: Doubles) -> Doubles:
        x, y, z = directions.T
        row = arctan2(np.sqrt(x * x + y * y), z) * (self._rows / np.pi) - 0.5
        column = arctan2(y, x) * (self._rows / np.pi) % (2 * self._rows)
        first_row, first_column = np.floor(row).astype(np.int64), np.floor(column).astype(np.int64)
        down, along = _cubic(row - first_row), _cubic(column - first_column)
        first_column %= 2 * self._rows  # an angle a hair below 0 is rounded to a whole turn
        found = np.zeros((len(directions), self._values.shape[2]))
        for i in range(4):
            for j in range(4):
                at = self._values[first_row + (_PAD - 1 + i), first_column + (_PAD - 1 + j)]
                found += (down[i] * along[j])[:, np.newaxis] * at
        return found


def _cubic(t: Doubles) -> tuple[Doubles, Doubles, Doubles, Doubles]:
    """What values at -1, 0, 1 and 2 count at t, from 0 to 1."""
    back, there, after = t + 1.0, t - 1.0, t - 2.0
    return (-t * there * after / 6.0, back * there * after / 2.0, -back * t * after / 2.0, back * t * there / 6.0)
