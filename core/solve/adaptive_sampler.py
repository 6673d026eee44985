"""Rounds of rays of one map, each where it lowers the error most."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..base.arrays import Doubles, Flags, Floats, Ints, Longs
from ..rays.accumulators import Accumulator
from ..rays.map_spec import Axis
from .blocks import block_of, block_sums, grown, largest, lists_of, texels_in, texels_of
from .calibration import calibrated
from .goal import Goal, first_rays
from .probes import Error, Probes
from .ray_budget import Blocks, Budget, rays_after
from .ray_source import RaySource
from .running_estimate import RunningEstimate
from .surface_filter import SurfaceFilter
from .upsample import NOTHING_TOLD, Estimates, Upsampled

# How fast squared errors fall with the rays: as their power of -1.5 where noise alone makes them; of -1 where the
# filter takes most of it away and detail with it; of -1.3 where it takes nothing, as there are edges within texels.
_OF_NOISE, _OF_BLUR, _OF_EDGES = 1.5, 1.0, 1.3
MOST_ROUNDS = 12
MOST_MEAN_RAYS = 4096  # of the texels together, before a bake gives up on the error asked for
# Of the error asked for: what a round aims at, so that the last of them seldom falls just short. After two that did it
# is so much less again each time: the errors are not where they are expected, and a round costs more than its rays.
_AIM = 0.95
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
        self._rays = np.full(self._texels.shape, self._first, dtype=np.int64)  # of each texel, by block
        self._traced = np.ones(self._texels.shape, dtype=np.bool_)  # blocks that have rays of their own
        self._coarse: Estimates | None = None  # what tells the others
        self._part: _Part | None = None
        self._estimates: list[RunningEstimate] = []  # of each row
        self._round = 0
        self.values = self.expected = np.zeros(owner.shape, dtype=np.float32)

    @property
    def rays(self) -> int:
        """All rays so far."""
        own = int((self._own_rays * self._texels).sum())
        return own + (self._coarse.rays if self._coarse is not None else 0)

    @property
    def _own_rays(self) -> Longs:
        """Of each texel, by block: 0 where a coarser image tells it."""
        return np.where(self._traced, self._rays, 0)

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

    def _trace(self, goal: Longs) -> None:
        """Bring each block's texels to so many rays of their own, where those are more than they have."""
        had = self._own_rays
        more = goal > had
        for before in np.unique(had[more]):
            for after in np.unique(goal[more & (had == before)]):
                for blocks in lists_of(more & (had == before) & (goal == after)):
                    self._trace_listed(blocks, int(before), int(after))
        self._rays = np.where(more, goal, self._rays)
        if (more & ~self._traced).any():
            self._traced, self._part = self._traced | more, None

    def _trace_listed(self, blocks: Longs, before: int, after: int) -> None:
        total, first = self._source.trace(blocks, before, after - before)
        texels, there = texels_in(blocks, self.covered)
        there &= total[0] >= 0.0  # some may face away this time
        for estimate, *row in zip(self._estimates, total, first, strict=True):
            estimate.go_on(row[0][there], row[1][there], before, after, texels[there])

    def go_on(self, probed: Probes, error: Error) -> bool:
        """A further round, where it lowers the error most. Returns whether there was anything left to do."""
        self._round += 1
        if self._round > MOST_ROUNDS or self.rays > MOST_MEAN_RAYS * self._texels.sum():
            return False
        goal = self._wanted(probed, error)
        if not self._added(goal) > 0.0:
            return False
        self._trace(goal)
        self._filter()
        return True

    def growth(self, probed: Probes, error: Error) -> float:
        """How many times the rays so far a further round would add."""
        return self._added(self._wanted(probed, error)) / max(self.rays, 1)

    def _wanted(self, probed: Probes, error: Error) -> Longs:
        """The rays of its own that each texel of each block should have after a further round."""
        assert self._goal.error is not None
        aim = math.prod([_AIM] * max(self._round - 1, 1)) * self._goal.error
        budget = Budget(
            (aim**2 - error.allowance(self._goal.error)) * float(self._texels.sum()),
            MOST_MEAN_RAYS * float(self._texels.sum()) - self.rays,
            self._rate(probed),
        )
        return rays_after(Blocks(self._squares(probed), self._texels, self._rays, self._traced), budget)

    def _added(self, goal: Longs) -> float:
        """All rays that it takes to get there."""
        return float(((goal - self._own_rays) * self._texels).sum())

    def _rate(self, probed: Probes) -> float:
        """As what power of the rays the squared error will fall: by the part of it that the filter leaves."""
        if not self._goal.filters:
            return _OF_NOISE
        own = self._estimates[0]
        traced = own.precision.reshape(-1)[probed.texels] > 0.0
        noisy, filtered = (
            float((probed.weight * probed.squares(each))[traced].sum()) for each in (own.value, self.values)
        )
        left = min(max(filtered / noisy, 0.0), 1.0) if noisy > 0.0 else 0.0
        return _OF_BLUR + left * (_OF_EDGES - _OF_BLUR)

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
        """Each block's squared error, summed over its texels."""
        expected = block_sums(self.expected) / np.maximum(self._texels, 1.0)
        of = block_of(probed.texels, self._owner.shape)
        return self._texels * calibrated(expected, of, probed.squares(self.values), probed.weight)


def missed_share(coarse: Upsampled, covered: Flags, error: float) -> float:
    """The share of the texels, 0 to 1, that what a coarser image tells is not enough for. error: the RMSE wanted."""
    texels = block_sums(covered)
    return float(texels.sum(where=_missed(coarse, texels, error)) / max(texels.sum(), 1.0))


def _missed(coarse: Upsampled, texels: Doubles, error: float) -> Flags:
    """The blocks with detail that a coarser image misses, and those where it tells nothing of some texel."""
    detail = block_sums(coarse.detail)
    return largest(detail, _MISSED * error**2 * float(texels.sum())) | (detail >= NOTHING_TOLD)
