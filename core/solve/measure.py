"""The error of a map, measured by as few probes as tell it well."""

from __future__ import annotations

import math

import numpy as np

from ..base.arrays import Doubles, Flags, Floats, Longs
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
) -> tuple[Probes, Error]:
    """The error of a map that took so many rays, and its probes: those of the rounds before, and more where they tell
    too little. Few are begun with: most rounds are far from the goal, and any probes tell that.

    values, expected: (H, W) float32, the map and the square of its error as it is expected. covered: (H, W) bool.
    Raises Cancelled.
    """
    most, rays = probes.how_many(int(np.count_nonzero(covered))), probes.rays_for(likely_error(goal))

    def drawn(texels: Longs, weight: Doubles, rays: int) -> Probes:
        source.enter("measuring the error")
        return probes.draw(texels, weight, rays, source.probe, source.spec.accumulator.totals)

    def surer(probed: Probes, error: Error) -> Probes | None:
        """Probes that tell the error better; None where they would cost too much."""
        affordable = _PROBED_MORE * traced
        if probed.noise > _NOISY * error.square and probed.rays < probes.MOST_LANE_RAYS:  # it is far below the goal
            if 2 * probed.cost > max(affordable, probes.rays_of(most, 2 * rays)):
                return None
            return drawn(probed.texels, probed.weight, 2 * probed.rays)
        count = len(probed.texels)
        more = min(_more(count, error), max(int(affordable / probes.rays_of(1, probed.rays)), most) - count)
        if more < _LEAST_MORE * count:
            return None
        return probed.joined(drawn(*probes.place(expected, covered, seed + count, more), probed.rays))

    if (probed := before) is None:
        count = max(int(_PROBED * traced / probes.rays_of(1, rays)), _FEWEST_FIRST)
        probed = drawn(*probes.place(expected, covered, seed, count), rays)
    error = probed.error(values)
    while _is_in_doubt(error, goal) and (better := surer(probed, error)) is not None:
        probed, error = better, better.error(values)
    return probed, error


def _more(count: int, error: Error) -> int:
    """How many more probes than so many may take the doubt away; at most as many again, for it is an estimate, too."""
    enough = (error.doubt / max(_DOUBTED * error.square, 1e-30)) ** 2
    return math.ceil(count * min(max(enough - 1.0, _LEAST_MORE), 1.0))


def _is_in_doubt(error: Error, goal: Goal) -> bool:
    """Whether a measured error may be another, and that matters: not where it is above the goal by far."""
    far = goal.error is not None and error.square - _FAR * error.doubt > goal.error**2
    return error.doubt > _DOUBTED * error.square and not far
