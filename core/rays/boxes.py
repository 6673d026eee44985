"""Boxes about occluders, and which of them rays can reach."""

from __future__ import annotations

import numpy as np

from ..base.arrays import Doubles, Flags
from ..base.vectors import length_of

# Occluders larger than this, or farther off, are left out: lengths cubed would leave float32's range (scene.py).
FARTHEST = 1e12


class Boxes:
    """Of (N, 2, 3) corners, low and high, in world space. finite: (N,) bool."""

    def __init__(self, corners: Doubles) -> None:
        self.finite: Flags = np.isfinite(corners).all(axis=(1, 2))
        kept = corners[self.finite]
        self._low, self._high = np.ascontiguousarray(kept[:, 0]), np.ascontiguousarray(kept[:, 1])

    def within_reach(self, low: Doubles, high: Doubles, reach: float) -> Flags:
        """(N,) bool: which come as near another box, low to high, (3,) each, as rays of this length go; none that is
        not finite."""
        near = self.finite.copy()
        near[near] = gaps(self._low, self._high, low, high) <= min(reach * (1.0 + 1e-6), FARTHEST)
        return near


def gaps(low: Doubles, high: Doubles, other_low: Doubles, other_high: Doubles) -> Doubles:
    """(N,): how far boxes are from another."""
    found: Doubles = length_of(np.maximum(np.maximum(low - other_high, other_low - high), 0.0))
    return found
