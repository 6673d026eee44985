"""How far to go, and with how many rays to begin."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..base import elementary
from ..base.errors import InputError

# Rays of the first round: about what brings a smooth scene to the error asked for, as measured on the samples. With the
# filter 16 rays give about 0.006 where there is detail and 0.004 where there is little; as many as that asks for are
# begun with, and the rounds after it go where there is more. Without it 0.048, and a quarter is begun with: few texels
# need them all.
FEWEST_FIRST_RAYS, MOST_FIRST_RAYS = 4, 256
_FILTERED, _PLAIN = (0.0042, 1.5), (0.048, 4.0 / 3.0)
MAX_RAYS = 1 << 20  # of a texel
LEAST_ERROR, MOST_ERROR = 1e-5, 0.5


@dataclass(frozen=True)
class Goal:
    """How far to go. rays: of every texel and map; error: the RMSE to reach instead, with as many rays as that takes.
    filtered: by the filter that knows the surface; None: where an error is asked for.

    Raises InputError, one line, for a value out of range.
    """

    rays: int = 64
    error: float | None = None
    filtered: bool | None = None

    def __post_init__(self) -> None:
        if not 1 <= self.rays <= MAX_RAYS:
            raise InputError(f"rays {self.rays}: give 1 to {MAX_RAYS}")
        if self.error is not None and not LEAST_ERROR <= self.error <= MOST_ERROR:
            raise InputError(f"error {self.error:g}: give an RMSE of {LEAST_ERROR:g} to {MOST_ERROR:g}, e.g. 0.004")

    @property
    def filters(self) -> bool:
        """Whether the filter is used."""
        return self.error is not None if self.filtered is None else self.filtered

    @property
    def plain(self) -> bool:
        """Whether all is done after one round of rays."""
        return self.error is None and not self.filters


def first_rays(goal: Goal) -> int:
    """Rays of each texel in the first round."""
    if goal.error is None:
        return goal.rays
    known, power = _FILTERED if goal.filters else _PLAIN
    rays = 16.0 * float(elementary.power(known / goal.error, power))
    rays = min(rays, MOST_FIRST_RAYS) if goal.filters else min(rays / 4.0, MOST_FIRST_RAYS / 4)
    return 1 << round(math.log2(max(rays, FEWEST_FIRST_RAYS)))


def likely_error(goal: Goal) -> float:
    """The RMSE asked for, or about that of so many rays."""
    known, power = _FILTERED if goal.filters else _PLAIN
    return goal.error or known * float(elementary.power(16.0 / goal.rays, 1.0 / power))
