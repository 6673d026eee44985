"""From rays to values whose error is known: rounds of rays where the error is, the filter, the measured error."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..base.arrays import Flags, Floats, Ints
from .adaptive_sampler import AdaptiveSampler
from .goal import Goal
from .measure import measure
from .probes import Error, Probes
from .ray_source import RaySource
from .upsample import Estimates, Upsampled


@dataclass(frozen=True, eq=False)
class Solved:
    """One map. values: (H, W) float32, its first row. covered: (H, W) bool, texels with a value. error: over
    them. rays: all that made the values; those that measured the error not among them. met: whether the error asked for
    was reached. more: (R - 1, H, W) float32, the other rows, and more_error theirs together."""

    values: Floats
    covered: Flags
    error: Error
    rays: int
    met: bool = True
    more: Floats | None = None
    more_error: Error | None = None


def solve(opening: tuple[Floats, Floats | None], owner: Ints, goal: Goal, seed: int, source: RaySource) -> Solved:
    """Solve one map. opening: the first round, as the source traces one, of `first_rays` rays; the half of it may be
    None where neither an error nor the filter is asked for. Its first row decides where rays go.

    Texels that face away from the camera (a sum of -1) are not covered. A map without any covered texel has error 0.
    Raises Cancelled, MemoryError.
    """
    covered = (owner >= 0) & (opening[0][0] >= 0.0)
    if goal.plain:
        count = int(np.count_nonzero(covered))
        values, *more = (np.where(covered, row / np.float32(goal.rays), np.float32(0.0)) for row in opening[0])
        probed, error = measure(values, np.zeros_like(values), covered, goal, seed, source, goal.rays * count)
        return _with_more(Solved(values, covered, error, count * goal.rays), more, probed, source)
    rounds = AdaptiveSampler(owner, covered, goal, source)
    rounds.open(opening)
    del opening  # as large as the image
    return _to_goal(rounds, goal, seed, source)


def solve_from(coarse: Upsampled, owner: Ints, goal: Goal, seed: int, source: RaySource) -> Solved:
    """Solve one map of which a coarser image tells most. The goal is an error, and no texel faces away.

    Raises as `solve`."""
    rounds = _refined(coarse, owner, goal, source)
    del coarse  # its detail is as large as the image
    return _to_goal(rounds, goal, seed, source)


def begin(opening: tuple[Floats, Floats | None], owner: Ints, goal: Goal, source: RaySource) -> AdaptiveSampler:
    """The first round of a coarse image."""
    rounds = AdaptiveSampler(owner, owner >= 0, goal, source)
    rounds.open(opening)
    return rounds


@dataclass(frozen=True, eq=False)
class Begun:
    """The rounds of a coarse image when the first one's error is measured, which the probes did. growth: how many times
    its rays the second would add, 0 where the error is small enough: the error is measured once more on finer images,
    so that the doubt about it is let go here."""

    rounds: AdaptiveSampler
    probed: Probes
    error: Error
    growth: float


def measured(rounds: AdaptiveSampler, goal: Goal, seed: int, source: RaySource) -> Begun:
    """What the first round brought."""
    probed, error = measure(rounds.values, rounds.expected, rounds.covered, goal, seed, source, rounds.rays)
    return Begun(rounds, probed, error, 0.0 if _is_enough(goal)(error) else rounds.growth(probed, error))


def estimate(begun: Begun, goal: Goal, seed: int, source: RaySource) -> Estimates:
    """One map of a coarse image, to be told to finer ones."""
    _rounds_on(begun.rounds, begun.probed, begun.error, goal, seed, source, _is_enough(goal))
    return begun.rounds.estimates()


def _is_enough(goal: Goal) -> Callable[[Error], bool]:
    return lambda error: error.square <= (goal.error or 0.0) ** 2


def estimate_from(coarse: Upsampled, owner: Ints, goal: Goal, source: RaySource) -> Estimates:
    """That of an image between a coarser one and finer ones."""
    return _refined(coarse, owner, goal, source).estimates()


def _refined(coarse: Upsampled, owner: Ints, goal: Goal, source: RaySource) -> AdaptiveSampler:
    rounds = AdaptiveSampler(owner, owner >= 0, goal, source)
    rounds.refine(coarse)
    return rounds


def _to_goal(rounds: AdaptiveSampler, goal: Goal, seed: int, source: RaySource) -> Solved:
    wanted = goal.error
    probed, error = _rounds_to(rounds, goal, seed, source, lambda error: wanted is None or error.within(wanted))
    met = wanted is None or error.within(wanted) or error.rmse <= wanted
    return _with_more(Solved(rounds.values, rounds.covered, error, rounds.rays, met), rounds.more(), probed, source)


def _rounds_to(
    rounds: AdaptiveSampler, goal: Goal, seed: int, source: RaySource, enough: Callable[[Error], bool]
) -> tuple[Probes, Error]:
    """Rounds until the error that is measured is enough."""
    probed, error = measure(rounds.values, rounds.expected, rounds.covered, goal, seed, source, rounds.rays)
    return _rounds_on(rounds, probed, error, goal, seed, source, enough)


def _rounds_on(
    rounds: AdaptiveSampler,
    probed: Probes,
    error: Error,
    goal: Goal,
    seed: int,
    source: RaySource,
    enough: Callable[[Error], bool],
) -> tuple[Probes, Error]:
    """The same from a measured error on."""
    goes_on = True
    while goes_on and not enough(error):
        goes_on = rounds.go_on(probed, error)
        known = rounds.values, rounds.expected, rounds.covered
        probed, error = measure(*known, goal, seed, source, rounds.rays, probed, final=not goes_on)
    return probed, error


def _with_more(solved: Solved, rows: Sequence[Floats], probed: Probes, source: RaySource) -> Solved:
    if not rows:
        return solved
    more: Floats = np.stack(rows)
    return replace(solved, more=more, more_error=probed.error_of_more(more, source.spec.accumulator))
