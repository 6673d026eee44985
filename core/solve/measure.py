"""The error of a map, measured by as few probes as tell it well."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..base.arrays import Doubles, Flags, Floats, Longs
from ..rays.accumulators import Accumulator
from . import probes
from .goal import Goal, likely_error
from .probes import Error, Probes
from .ray_source import RaySource

_PROBED, _FEWEST_FIRST = 0.5, 1536  # of the rays may measure the error at first; at so many texels at least
_DOUBTED = 0.1  # of a measured square may be its doubt, or it is measured by more probes,
_LEAST_MORE = 0.25  # so many of those that are there at least; or by twice the rays each where their own noise is more
_NOISY = 8.0  # times the square
_PROBED_MORE = 0.25  # of the rays may measure it in the end, where that is more than so many probes usually take
_FAR = 2.0  # doubts above the goal an error needs no better measure


def measure(
    values: Floats,
    expected: Floats,
    covered: Flags,
    goal: Goal,
    seed: int,
    source: RaySource,
    traced: int,
    before: Probes | None = None,
    *,
    final: bool = False,
) -> tuple[Probes, Error]:
    """The error of a map that took so many rays, and its probes: those of the rounds before, and more where they tell
    too little. Few are begun with: most rounds are far from the goal, and any probes tell that.

    values, expected: (H, W) float32, the map and the square of its error as it is expected. covered: (H, W) bool.
    final: no round follows, so that an error far above the goal is measured well, too. Raises Cancelled.
    """
    measuring = _Measuring(expected, covered, seed, source, probes.rays_for(likely_error(goal)), _PROBED_MORE * traced)
    probed = before if before is not None else measuring.begin(int(_PROBED * traced))
    error = probed.error(values)
    far = None if final or goal.error is None else goal.error**2
    while _is_in_doubt(error, far) and (better := measuring.surer(probed, error)) is not None:
        probed, error = better, better.error(values)
    return probed, error


def _is_in_doubt(error: Error, far: float | None) -> bool:
    """Whether a measured square may well be another. far: not where it is above this one in any case."""
    beyond = far is not None and error.square - _FAR * error.doubt > far
    return error.doubt >= _DOUBTED * error.square and not beyond


@dataclass(frozen=True, eq=False)
class _Measuring:
    """expected, covered, seed, source: as `measure` has them. rays: of a lane, at first. affordable: rays that the
    probes may take in any case."""

    expected: Floats
    covered: Flags
    seed: int
    source: RaySource
    rays: int
    affordable: float

    @cached_property
    def usual(self) -> int:
        """So many probes there may be in any case."""
        return probes.how_many(int(np.count_nonzero(self.covered)))

    def begin(self, affordable: int) -> Probes:
        """The first ones, of so many rays or of few texels; of maps of several rows, of which the first alone decides
        whether there are more, all."""
        few = max(affordable // probes.rays_of(1, self.rays), _FEWEST_FIRST)
        several = self.source.spec.accumulator is not Accumulator.VISIBILITY
        return self._placed(self.seed, self.usual if several else few, self.rays)

    def surer(self, probed: Probes, error: Error) -> Probes | None:
        """Probes that tell the error better; None where they would cost too much."""
        noisy = probed.noise > _NOISY * error.square and probed.rays < probes.MOST_LANE_RAYS
        if noisy and 2 * probed.cost <= max(self.affordable, probes.rays_of(self.usual, 2 * self.rays)):
            return self._drawn(probed.texels, probed.weight, 2 * probed.rays)
        most = max(int(self.affordable / probes.rays_of(1, probed.rays)), self.usual)
        more = min(_more(probed.placed, error), most - probed.placed)
        if more < _LEAST_MORE * probed.placed or more == 0:
            return None
        return probed.joined(self._placed(self.seed + probed.placed, more, probed.rays))

    def _placed(self, seed: int, count: int, rays: int) -> Probes:
        return self._drawn(*probes.place(self.expected, self.covered, seed, count), rays)

    def _drawn(self, texels: Longs, weight: Doubles, rays: int) -> Probes:
        self.source.enter("measuring the error")
        return probes.draw(texels, weight, rays, self.source.probe, self.source.spec.accumulator.totals)


def _more(count: int, error: Error) -> int:
    """How many more probes than so many may take the doubt away; at most as many again, for it is an estimate, too."""
    if not error.square > 0.0:
        return count
    ratio = error.doubt / (_DOUBTED * error.square)
    return math.ceil(count * min(max(ratio * ratio - 1.0, _LEAST_MORE), 1.0))
