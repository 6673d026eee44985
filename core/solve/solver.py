"""From rays to values whose error is known: rounds of rays where the error is, the filter, the measured error."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Doubles, Flags, Floats, Ints
from ..base.errors import InputError
from ..rays.accumulators import Accumulator
from ..rays.map_spec import Axis
from . import probes
from .probes import Error, Probes
from .ray_source import RaySource
from .running_estimate import RunningEstimate

BLOCK = 4  # texels along a side of the blocks that get rays together: a packet's sixteen
# Rays of the first round: about what brings a smooth scene to the error asked for, as measured on the samples. With the
# filter 16 rays give about 0.006 where there is detail and 0.004 where there is little; as many as that asks for are
# begun with, and the rounds after it go where there is more. Without it 0.048, and a quarter is begun with: few texels
# need them all.
FEWEST_FIRST_RAYS, MOST_FIRST_RAYS = 4, 256
_FILTERED, _PLAIN = (0.0042, 1.5), (0.048, 4.0 / 3.0)
GROWTHS = (0, 2, 4, 8, 16)  # rays that a round may add to a block's texels, over those that they had before
# How fast squared errors fall with the rays: as their power of -1.5 where noise makes them, of -1 where the filter
# blurs detail. Which it is, the rounds before tell; a filtered map is taken for the second before it has had two.
_FASTEST, _SLOWEST = 1.5, 1.0
MAX_RAYS = 1 << 20  # of a texel
LEAST_ERROR, MOST_ERROR = 1e-5, 0.5
MOST_RAYS = 1 << 16  # of a texel in one round
MOST_ROUNDS = 12
MOST_MEAN_RAYS = 4096  # of the texels together, before a bake gives up on the error asked for
_AIM = 0.95  # of the error asked for: what the rounds aim at, so that the last of them seldom falls just short
_EVEN = 0.05  # of the error that the filter expects is taken to be anywhere: where it errs, it does not know
_PROBED = 0.08  # of the rays may measure the error, where that is more than the least they need
_DOUBTED = 0.15  # of a measured square may be its doubt, or it is measured again by twice the rays


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


def first_rays(goal: Goal) -> int:
    """Rays of each texel in the first round."""
    if goal.error is None:
        return goal.rays
    known, power = _FILTERED if goal.filters else _PLAIN
    rays = 16.0 * (known / goal.error) ** power
    rays = min(rays, MOST_FIRST_RAYS) if goal.filters else min(rays / 4.0, MOST_FIRST_RAYS / 4)
    return 1 << round(math.log2(max(rays, FEWEST_FIRST_RAYS)))


def _likely_error(goal: Goal) -> float:
    """The error asked for, or that of so many rays."""
    known, power = _FILTERED if goal.filters else _PLAIN
    return goal.error or known * (16.0 / goal.rays) ** (1.0 / power)


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
        probed, error = _measure(values, np.zeros_like(values), covered, goal, seed, source, goal.rays * count)
        return _with_more(Solved(values, covered, error, count * goal.rays), more, probed, source)
    rounds = AdaptiveSampler(owner, covered, goal, source)
    rounds.open(opening)
    del opening  # as large as the image
    probed, error = _measure(rounds.values, rounds.expected, covered, goal, seed, source, rounds.rays)
    while goal.error is not None and not error.within(goal.error) and rounds.go_on(probed, error):
        probed, error = _measure(rounds.values, rounds.expected, covered, goal, seed, source, rounds.rays, probed)
    met = goal.error is None or error.within(goal.error) or error.rmse <= goal.error
    return _with_more(Solved(rounds.values, covered, error, rounds.rays, met), rounds.more(), probed, source)


def _with_more(solved: Solved, rows: Sequence[Floats], probed: Probes, source: RaySource) -> Solved:
    if not rows:
        return solved
    more: Floats = np.stack(rows)
    return replace(solved, more=more, more_error=probed.error_of_more(more, source.spec.accumulator))


def _measure(
    values: Floats,
    expected: Floats,
    covered: Flags,
    goal: Goal,
    seed: int,
    source: RaySource,
    traced: int,
    before: Probes | None = None,
) -> tuple[Probes, Error]:
    """The error of a map that took so many rays, and its probes: those of the rounds before where they are as good."""
    count = probes.how_many(int(np.count_nonzero(covered)))
    rays = max(probes.rays_for(_likely_error(goal)), probes.rays_within(_PROBED * traced, count))
    probed = before
    if probed is None or rays >= 2 * probed.rays:
        source.enter("measuring the error")
        probed = probes.draw(*probes.place(expected, covered, seed), rays, source.probe, source.spec.accumulator.totals)
    error = probed.error(values)
    if error.doubt > _DOUBTED * error.square and probed.rays < probes.MOST_LANE_RAYS:  # it is far below the goal
        probed = probes.draw(
            probed.texels, probed.weight, 2 * probed.rays, source.probe, source.spec.accumulator.totals
        )
        error = probed.error(values)
    return probed, error


class AdaptiveSampler:
    """One map's rounds. values, expected: (H, W) float32, the map and the square of its error so far, as the filter
    expects it."""

    def __init__(self, owner: Ints, covered: Flags, goal: Goal, source: RaySource) -> None:
        self._owner, self._covered, self._goal, self._source = owner, covered, goal, source
        self._texels = _block_sums(covered.astype(np.float32))
        self._rays = np.full(self._texels.shape, first_rays(goal))  # of each texel, by block
        self._estimate = RunningEstimate.empty(owner.shape, first_rays(goal))
        self._more: list[RunningEstimate] = []
        self._round = 0
        self._rate = _SLOWEST if goal.filters else _FASTEST
        self._before: tuple[int, float] | None = None  # rays and squared error before the last round
        self.values = self.expected = np.zeros(owner.shape, dtype=np.float32)

    @property
    def rays(self) -> int:
        """All rays so far."""
        return int((self._rays * self._texels).sum())

    def open(self, opening: tuple[Floats, Floats | None]) -> None:
        """Take in the first round, of every texel."""
        total, first = opening
        assert first is not None
        self._more = [RunningEstimate.empty(self._owner.shape, first_rays(self._goal)) for _ in total[1:]]
        self._add(total, first, first_rays(self._goal), self._covered)
        self._filter()

    def more(self) -> list[Floats]:
        """The other rows, which had the same rays."""
        shares = self._source.spec.accumulator is not Accumulator.BENT  # whose other rows are directions
        return [self._filtered(each, shares=shares)[0] for each in self._more]

    def _add(self, total: Floats, first: Floats, rays: int, where: Flags) -> None:
        for estimate, *row in zip((self._estimate, *self._more), total, first, strict=True):
            estimate.add(row[0], row[1], rays, where)

    def go_on(self, probed: Probes, error: Error) -> bool:
        """A further round, where it lowers the error most. Returns whether there was anything left to do."""
        assert self._goal.error is not None
        self._round += 1
        if self._round > MOST_ROUNDS or self.rays > MOST_MEAN_RAYS * self._texels.sum():
            return False
        self._learn_rate(error)
        extra = self._choose(self._squares(probed), (_AIM * self._goal.error) ** 2 - error.allowance(self._goal.error))
        if not extra.any():
            return False
        for rays in np.unique(extra[extra > 0]):
            where = _unblocked(extra == rays, self._owner.shape) & self._covered
            total, first = self._source.trace(np.where(where, self._owner, -1), int(rays))
            self._add(total, first, int(rays), where & (total[0] >= 0.0))  # some may face away this time
        self._rays += extra
        self._filter()
        return True

    def _learn_rate(self, error: Error) -> None:
        """How fast the error of a filtered map falls, from what the last round did to it."""
        square = max(error.square, error.doubt)
        if self._before is not None and self._goal.filters:
            rays, before = self._before
            seen = math.log(before / square) / math.log(self.rays / rays)
            self._rate = min(max(seen, _SLOWEST), _FASTEST)
        self._before = self.rays, square

    def _filter(self) -> None:
        self.values, self.expected = self._filtered(self._estimate)
        self._source.show(self.values)

    def _filtered(self, estimate: RunningEstimate, *, shares: bool = True) -> tuple[Floats, Floats]:
        """shares: whether the values are shares of the map's lobe."""
        surface_filter, spec = self._source.filter, self._source.spec
        control = self._source.enter("filtering")
        values, expected = surface_filter.filter(
            estimate.value,
            estimate.noise,
            estimate.precision,
            spec.exponent,
            about_normal=shares and spec.axis is Axis.NORMAL,
            plain=not self._goal.filters,
            control=control,
        )
        for image in (values, expected):
            np.copyto(image, np.float32(0.0), where=~self._covered)
        return values, expected

    def _squares(self, probed: Probes) -> Doubles:
        """Each block's squared error, summed over its texels: as the filter expects it, to the measured scale."""
        squares = _block_sums(self.expected)
        expected = float(probed.weight @ self.expected.reshape(-1)[probed.texels])
        measured = float(probed.weight @ probed.squares(self.values))
        scale = measured / expected if measured > 0.0 and expected > 0.0 else 1.0
        for rays in np.unique(self._rays):
            here = self._rays == rays
            mean = squares[here].sum() / max(self._texels[here].sum(), 1.0)
            squares[here] = scale * ((1.0 - _EVEN) * squares[here] + _EVEN * mean * self._texels[here])
        return squares

    def _choose(self, squares: Doubles, wanted: float) -> NDArray[np.int_]:
        """Rays to add to each texel of each block, so that about the wanted mean square is reached with the fewest.

        More rays of r times a texel's number bring its squared error to 1 / (1 + r^rate) of what it was. For a price
        of a ray each block takes the growth that costs least, rays and error together; the price is found by
        bisection, and goes no lower than the rays that are left can pay for.
        """
        left = _left(self._rate)
        steps = np.diff(_GROWTHS) / -np.diff(left)  # from which worth on, in prices, a growth beats the one before
        worth = squares / np.maximum(self._texels * self._rays, 1.0)
        goal = wanted * self._texels.sum()
        affordable = MOST_MEAN_RAYS * self._texels.sum() - self.rays
        low, high = worth.max() * 1e-9, worth.max()
        if not high > 0.0:
            return np.zeros_like(self._rays)
        # Blocks in order of their worth: of those with one growth each sum is a difference of two running ones.
        order = np.argsort(worth, axis=None)
        ladder = worth.reshape(-1)[order]
        squares_to, rays_to = (_running_sums(each, order) for each in (squares, self._rays * self._texels))
        for _ in range(40):
            price = math.sqrt(low * high)
            ends = [0, *np.searchsorted(ladder, steps * price, side="right"), len(ladder)]
            enough = np.diff(squares_to[ends]) @ left <= goal
            too_much = np.diff(rays_to[ends]) @ _GROWTHS > affordable
            low, high = (price, high) if enough or too_much else (low, price)
        extra = np.minimum(_GROWTHS[np.searchsorted(steps, worth / low)] * self._rays, MOST_RAYS)
        powers: NDArray[np.int_] = np.where(extra > 0, 1 << np.frexp(extra / 0.75)[1].astype(np.int_) - 1, 0)
        return powers


_GROWTHS = np.asarray(GROWTHS)


def _left(rate: float) -> Doubles:
    """What each growth leaves of the squared error, where that falls as the rays to the power of -rate."""
    left: Doubles = 1.0 / (1.0 + _GROWTHS.astype(np.float64) ** rate)
    return left


def _running_sums(values: Doubles, order: NDArray[np.intp]) -> Doubles:
    """Of the values in an order, from 0 on: one more than there are values."""
    return np.concatenate([[0.0], np.cumsum(values.reshape(-1)[order])])


def _block_sums(image: Floats) -> Doubles:
    """(H, W) → sums over blocks, float64; the last ones may be cut short by the image's edge."""
    height, width = image.shape
    whole = height % BLOCK == width % BLOCK == 0
    padded = image if whole else np.pad(image, ((0, -height % BLOCK), (0, -width % BLOCK)))
    blocks = padded.reshape(padded.shape[0] // BLOCK, BLOCK, padded.shape[1] // BLOCK, BLOCK)
    sums: Doubles = np.einsum("iajb->ij", blocks, dtype=np.float64, casting="safe")
    return sums


def _unblocked(blocks: Flags, shape: tuple[int, ...]) -> Flags:
    """The texels of the marked blocks, (H, W) bool."""
    return blocks.repeat(BLOCK, axis=0).repeat(BLOCK, axis=1)[: shape[0], : shape[1]]
