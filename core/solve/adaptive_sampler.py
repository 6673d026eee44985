"""Rounds of rays of one map, each where it lowers the error most."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Doubles, Flags, Floats, Ints, Longs
from ..rays.accumulators import Accumulator
from ..rays.map_spec import Axis
from .blocks import block_sums, grown, largest, lists_of, texels_of
from .goal import Goal, first_rays
from .probes import Error, Probes
from .ray_source import RaySource
from .running_estimate import RunningEstimate
from .surface_filter import SurfaceFilter
from .upsample import NOTHING_TOLD, Estimates, Upsampled

GROWTHS = (0, 2, 4, 8, 16)  # rays that a round may add to a block's texels, over those that they had before
# How fast squared errors fall with the rays: as their power of -1.5 where noise makes them, of -1 where the filter
# blurs detail. Which it is, the rounds before tell; a filtered map is taken for the second before it has had two.
_FASTEST, _SLOWEST = 1.5, 1.0
MOST_RAYS = 1 << 16  # of a texel in one round
MOST_ROUNDS = 12
MOST_MEAN_RAYS = 4096  # of the texels together, before a bake gives up on the error asked for
# Of the error asked for: what a round aims at, so that the last of them seldom falls just short. After two that did it
# is so much less again each time: the errors are not where they are expected, and a round costs more than its rays.
_AIM = 0.95
_EVEN = 0.05  # of the error that the filter expects is taken to be anywhere: where it errs, it does not know
# Where a finer image begins with what a coarser one tells: detail that this misses may leave so much of the wanted
# square, and where there is more texels get rays of their own; before they are taken for as good as some part of those.
_MISSED = 0.15
_TOLD_RAYS = 0.5


@dataclass(frozen=True, eq=False)
class _Part:
    """Texels of an image of which a coarser one tells the rest, y · W + x. own: those that have rays. around: those
    beside them. filter: of both."""

    own: Longs
    around: Longs
    filter: SurfaceFilter


class AdaptiveSampler:
    """One map's rounds. values, expected: (H, W) float32, the map and the square of its error so far, as the filter
    expects it. covered: (H, W) bool."""

    def __init__(self, owner: Ints, covered: Flags, goal: Goal, source: RaySource) -> None:
        self._owner, self.covered, self._goal, self._source = owner, covered, goal, source
        self._texels = block_sums(covered)
        self._first = first_rays(goal)
        self._rays = np.full(self._texels.shape, self._first)  # of each texel, by block
        self._traced = np.ones(self._texels.shape, dtype=np.bool_)  # blocks that have rays of their own
        self._coarse: Estimates | None = None  # what tells the others
        self._part: _Part | None = None
        self._estimates: list[RunningEstimate] = []  # of each row
        self._round = 0
        self._rate = _SLOWEST if goal.filters else _FASTEST
        self._before: tuple[int, float] | None = None  # rays and squared error before the last round
        self.values = self.expected = np.zeros(owner.shape, dtype=np.float32)

    @property
    def rays(self) -> int:
        """All rays so far."""
        own = int((self._rays * self._texels).sum(where=self._traced))
        return own + (self._coarse.rays if self._coarse is not None else 0)

    def open(self, opening: tuple[Floats, Floats | None]) -> None:
        """Take in the first round, of every texel."""
        total, first = opening
        assert first is not None
        for row in zip(total, first, strict=True):
            self._estimates.append(RunningEstimate.empty(self._owner.shape, self._first))
            self._estimates[-1].begin(*row, self.covered)
        self._filter()

    def refine(self, coarse: Upsampled) -> None:
        """Begin with what a coarser image tells, which is taken over. Where that is not enough texels get rays of their
        own."""
        assert self._goal.error is not None
        self._coarse = Estimates(coarse.rows, coarse.expected, coarse.rays)  # its detail is let go
        self.values, self.expected = coarse.rows[0], coarse.expected
        self._estimates = [RunningEstimate.empty(self._owner.shape, self._first) for _ in coarse.rows]
        self._traced[:] = False
        self._rays[:] = max(int(_TOLD_RAYS * self._first), 1)
        self._trace(np.where(_missed(coarse, self._texels, self._goal.error), self._first, 0))
        self._filter()

    def estimates(self) -> Estimates:
        """All that is known of the map, for finer images."""
        return Estimates((self.values, *self.more()), self.expected, self.rays)

    def more(self) -> list[Floats]:
        """The other rows, which had the same rays."""
        shares = self._source.spec.accumulator is not Accumulator.BENT  # whose other rows are directions
        return [self._filtered(row, shares=shares)[0] for row in range(1, len(self._estimates))]

    def _trace(self, extra: NDArray[np.int_]) -> None:
        """So many rays more to the texels of each block."""
        for rays in np.unique(extra[extra > 0]):
            for texels in lists_of(extra == rays, self.covered):
                self._trace_listed(texels, int(rays))
        self._rays = np.where(self._traced, self._rays + extra, np.where(extra > 0, extra, self._rays))
        if (extra[~self._traced] > 0).any():
            self._traced, self._part = self._traced | (extra > 0), None

    def _trace_listed(self, texels: Longs, rays: int) -> None:
        total, first = self._source.trace(texels, rays)
        seen = total[0] >= 0.0  # some may face away this time
        if not seen.all():
            texels, total, first = texels[seen], total[:, seen], first[:, seen]
        for estimate, *row in zip(self._estimates, total, first, strict=True):
            estimate.add(row[0], row[1], rays, texels)

    def go_on(self, probed: Probes, error: Error) -> bool:
        """A further round, where it lowers the error most. Returns whether there was anything left to do."""
        self._round += 1
        if self._round > MOST_ROUNDS or self.rays > MOST_MEAN_RAYS * self._texels.sum():
            return False
        self._learn_rate(error)
        extra = self._wanted(probed, error)
        if not extra.any():
            return False
        self._trace(extra)
        self._filter()
        return True

    def growth(self, probed: Probes, error: Error) -> float:
        """How many times the rays so far a further round would add."""
        return float((self._wanted(probed, error) * self._texels).sum()) / max(self.rays, 1)

    def _wanted(self, probed: Probes, error: Error) -> NDArray[np.int_]:
        """Rays that a further round adds to each texel of each block."""
        assert self._goal.error is not None
        aim = _AIM ** max(self._round - 1, 1) * self._goal.error
        return self._choose(self._squares(probed), aim**2 - error.allowance(self._goal.error))

    def _learn_rate(self, error: Error) -> None:
        """How fast the error of a filtered map falls, from what the last round did to it."""
        square = max(error.square, error.doubt)
        if self._before is not None and self._goal.filters:
            rays, before = self._before
            seen = math.log(before / square) / math.log(self.rays / rays)
            self._rate = min(max(seen, _SLOWEST), _FASTEST)
        self._before = self.rays, square

    def _filter(self) -> None:
        self.values, self.expected = self._filtered(0)
        # A view, by which who looks tells rounds apart: values may stay where they are.
        self._source.show(self.values[:])

    def _filtered(self, row: int, *, shares: bool = True) -> tuple[Floats, Floats]:
        """A row of the map and its expected squared error. shares: whether the values are shares of the map's lobe."""
        if self._coarse is not None:
            return self._filtered_part(self._coarse, row, shares=shares)
        values, expected = self._apply(self._source.filter, self._estimates[row], shares=shares)
        for image in (values, expected):
            np.copyto(image, np.float32(0.0), where=~self.covered)
        return values, expected

    def _filtered_part(self, coarse: Estimates, row: int, *, shares: bool) -> tuple[Floats, Floats]:
        """As the coarser image tells it, but for texels that have rays of their own."""
        if not self._traced.any():
            return coarse.rows[row], coarse.expected
        part = self._own_part()
        known = self._estimates[row]
        known.lend(part.own, part.around, coarse.rows[row], coarse.expected)
        values, expected = self._apply(part.filter, known, part.own, shares=shares)
        known.take_back(part.around)
        coarse.rows[row].reshape(-1)[part.own] = values.reshape(-1)[part.own]
        if row == 0:
            coarse.expected.reshape(-1)[part.own] = expected.reshape(-1)[part.own]
        return coarse.rows[row], coarse.expected

    def _own_part(self) -> _Part:
        if self._part is None:
            own, around = (
                texels_of(each, self.covered) for each in (self._traced, grown(self._traced) & ~self._traced)
            )
            owner = np.full_like(self._owner, -1)
            for texels in (own, around):
                owner.reshape(-1)[texels] = self._owner.reshape(-1)[texels]
            self._part = _Part(own, around, self._source.filter_of(owner))
        return self._part

    def _apply(
        self, surface_filter: SurfaceFilter, known: RunningEstimate, texels: Longs | None = None, *, shares: bool
    ) -> tuple[Floats, Floats]:
        spec = self._source.spec
        return surface_filter.filter(
            known.value,
            known.noise,
            known.precision,
            spec.exponent,
            about_normal=shares and spec.axis is Axis.NORMAL,
            plain=not self._goal.filters,
            texels=texels,
            control=self._source.enter("filtering"),
        )

    def _squares(self, probed: Probes) -> Doubles:
        """Each block's squared error, summed over its texels: as the filter expects it, to the measured scale."""
        squares = block_sums(self.expected)
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


def missed_share(coarse: Upsampled, covered: Flags, error: float) -> float:
    """The share of the texels, 0 to 1, that what a coarser image tells is not enough for. error: the RMSE wanted."""
    texels = block_sums(covered)
    return float(texels.sum(where=_missed(coarse, texels, error)) / max(texels.sum(), 1.0))


def _missed(coarse: Upsampled, texels: Doubles, error: float) -> Flags:
    """The blocks with detail that a coarser image misses, and those where it tells nothing of some texel."""
    detail = block_sums(coarse.detail)
    return largest(detail, _MISSED * error**2 * float(texels.sum())) | (detail >= NOTHING_TOLD)
