"""Which blocks of texels get how many more rays, so that a wanted error is reached with the fewest."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..base.arrays import Doubles, Flags, Longs
from ..base.elementary import power

MOST_RAYS = 1 << 16  # of a texel
# As many rays as before a block may have after a round: nets have powers of two.
_TIMES = np.array([1, 2, 4, 8, 16], dtype=np.int64)
_STEPS = 40  # of the bisection


@dataclass(frozen=True, eq=False)
class Blocks:
    """What is known of each block of texels; all of one shape. squares: float64, its texels' squared errors, summed.
    texels: float64, how many are covered. rays: int, what each of them has so far, a power of two. traced: bool,
    whether those are its own; else what is told of it is as good as so many, and goes when it has its own."""

    squares: Doubles
    texels: Doubles
    rays: Longs
    traced: Flags


@dataclass(frozen=True)
class Budget:
    """wanted: the squared errors that may be left, summed over the texels. affordable: rays that may be added. rate:
    squared errors fall as the rays to the power of -rate."""

    wanted: float
    affordable: float
    rate: float

    @property
    def left(self) -> Doubles:
        """Of a squared error after each growth."""
        return power(_TIMES, -self.rate)


def rays_after(blocks: Blocks, budget: Budget) -> Longs:
    """Of each texel of each block the rays that it should have, its own; what it has where more do not pay.

    For a price of a ray each block takes the growth that costs least, rays and error together; the price is found by
    bisection, and goes no lower than the rays that may be added can pay for.
    """
    growing = blocks.rays < MOST_RAYS
    ladders = [_Ladder(blocks, growing & (blocks.traced == traced), traced, budget) for traced in (True, False)]
    high = max(each.most for each in ladders)
    goal = np.where(blocks.traced, blocks.rays, 0)
    if not high > 0.0:
        return goal
    rest = float(blocks.squares.sum(where=~growing))

    def outcome(price: float) -> tuple[float, float]:
        left, added = np.sum([each.at(price) for each in ladders], axis=0)
        return rest + left, added

    low = high * 1e-9
    for _ in range(_STEPS):
        price = math.sqrt(low * high)
        left, added = outcome(price)
        low, high = (price, high) if left <= budget.wanted or added > budget.affordable else (low, price)
    price = low if outcome(low)[1] <= budget.affordable else high
    for each in ladders:
        each.take(price, goal)
    return goal


class _Ladder:
    """Blocks that are traced, or that are not, in order of their worth: of those with one growth each sum is a
    difference of two running ones. most: the highest worth."""

    def __init__(self, blocks: Blocks, where: Flags, traced: bool, budget: Budget) -> None:
        self._where = where
        self._left, self._cost = budget.left, (_TIMES - int(traced)) * (_TIMES > 1)
        # The worths, in prices, from which on each growth beats the one before; they rise.
        self._steps = np.diff(self._cost) / -np.diff(self._left)
        self._rays = blocks.rays[self._where]
        squares, rays = blocks.squares[self._where], self._rays * blocks.texels[self._where]
        self._worth = squares / np.maximum(rays, 1.0)
        self.most = float(self._worth.max(initial=0.0))
        order = np.argsort(self._worth, kind="stable")
        self._sorted = self._worth[order]
        self._squares_to, self._rays_to = (np.concatenate([[0.0], np.cumsum(each[order])]) for each in (squares, rays))

    def at(self, price: float) -> tuple[float, float]:
        """The squared errors that are left and the rays that are added at a price."""
        ends = [0, *np.searchsorted(self._sorted, self._steps * price, side="right"), len(self._sorted)]
        squares, rays = (np.diff(each[ends]) for each in (self._squares_to, self._rays_to))
        return float((squares * self._left).sum()), float((rays * self._cost).sum())

    def take(self, price: float, goal: Longs) -> None:
        """Write into it what the blocks that grow at a price should have."""
        times = _TIMES[np.searchsorted(self._steps, self._worth / price)]
        goal[self._where] = np.where(times > 1, np.minimum(times * self._rays, MOST_RAYS), goal[self._where])
