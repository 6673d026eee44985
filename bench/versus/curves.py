"""Seconds at a given RMSE, from a baker's measured points, and ratios of two bakers'.

The rules, for the page too:
- Of a baker's points those count that no faster one equals or betters in RMSE: the lower envelope.
- Between two of them the logarithm of the seconds is linear in that of the RMSE.
- Coarser than its coarsest point: that point's seconds. The baker could not have been slower.
- Finer than its finest point: the line through its last two goes on, always against us. A peer's no steeper than
  seconds ∝ RMSE⁻², ours no flatter. Ours goes no farther than to half the RMSE of its finest point; then there is none.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

Curve = Sequence[tuple[float, float]]  # (seconds, RMSE)

NOISE = 2.0  # seconds ∝ RMSE to the power of minus this, for independent rays
FARTHEST = 2.0  # how much finer than its finest point ours is carried on


class Kind(Enum):
    """Where a time comes from: between points, the coarsest, which is finer than asked, or beyond the finest."""

    MEASURED, COARSEST, CARRIED_ON = range(3)


@dataclass(frozen=True)
class Time:
    """Seconds to an RMSE."""

    seconds: float
    kind: Kind


@dataclass(frozen=True)
class Ratio:
    """A peer's seconds over ours at equal RMSE. mark: "" measured, "~" carried on beyond a finest point, "≥" at least,
    "≤" at most, since a coarsest point was finer than asked."""

    value: float
    mark: str

    def __str__(self) -> str:
        return f"{self.mark}{self.value:.3g}" if self.value < 100.0 else f"{self.mark}{self.value:.0f}"


def envelope(curve: Curve) -> list[tuple[float, float]]:
    """The points that no faster one equals or betters, coarsest first."""
    kept: list[tuple[float, float]] = []
    for seconds, rmse in sorted(curve):
        if not kept or rmse < kept[-1][1]:
            kept.append((seconds, rmse))
    return kept


def time_at(rmse: float, curve: Curve, *, ours: bool) -> Time | None:
    """Seconds to an RMSE by the rules above; None where there are no points, or ours does not get there."""
    points = envelope(curve)
    if not points:
        return None
    seconds, errors = (np.log([point[axis] for point in points]) for axis in (0, 1))
    goal = math.log(rmse)
    if goal >= errors[0]:
        return Time(points[0][0], Kind.COARSEST if goal > errors[0] else Kind.MEASURED)
    if goal >= errors[-1]:
        return Time(math.exp(np.interp(goal, errors[::-1], seconds[::-1])), Kind.MEASURED)
    beyond = errors[-1] - goal
    if ours and beyond > math.log(FARTHEST):
        return None
    slope = NOISE
    if len(points) > 1:
        last = (seconds[-1] - seconds[-2]) / (errors[-2] - errors[-1])
        slope = max(last, NOISE) if ours else min(last, NOISE)
    return Time(math.exp(seconds[-1] + slope * beyond), Kind.CARRIED_ON)


def ratio_at(rmse: float, ours: Curve, peer: Curve) -> Ratio | None:
    """How many times as long the peer takes as ours; None where either has no time."""
    mine, other = time_at(rmse, ours, ours=True), time_at(rmse, peer, ours=False)
    if mine is None or other is None:
        return None
    return Ratio(other.seconds / mine.seconds, _mark(mine.kind, other.kind))


def _mark(mine: Kind, other: Kind) -> str:
    if Kind.CARRIED_ON in (mine, other) or mine is other is Kind.COARSEST:
        return "~"
    if mine is Kind.COARSEST:
        return "≥"
    return "≤" if other is Kind.COARSEST else ""


def geometric_mean(values: Sequence[float]) -> float:
    """The mean of ratios."""
    return math.exp(sum(map(math.log, values)) / len(values))
