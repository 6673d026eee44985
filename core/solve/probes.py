"""The error of a map, measured: some of its texels are traced again by rays of their own.

At a probe, two more estimates P and Q by independent rays stand beside the finished value F. Neither knows of F or of
the other, so the mean of (F - P)(F - Q) is the mean square of F's error, whatever made it: noise, a filter's bias,
rounds that stopped too soon. No constant has to be calibrated (sample splitting, as in cross-validation).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..base.arrays import Doubles, Flags, Floats, Longs, Reals
from ..base.elementary import power
from ..rays.accumulators import Accumulator, directions
from .blocks import block_sums, texels_in

MOST, FEWEST, SHARE = 4096, 256, 4  # probes: one texel of SHARE, but between these, and no more than there are
LANES = 16  # an estimate of a probe has LANES times so many rays: packets of one texel's rays
FEWEST_LANE_RAYS, MOST_LANE_RAYS = 4, 512
_MOST_DOUBT = 0.1  # of a wanted square

# Texels and rays each → sums, by other rays at each call: (images, N) float32.
Trace = Callable[[Longs, int], Floats]
Totals = Callable[[Floats, int], Floats]  # images of sums over so many rays → rows of values times the rays


@dataclass(frozen=True)
class Error:
    """square: the mean square over the covered texels, which noise may carry below 0, and doubt its standard error.
    p99: the error that 99 of 100 texels stay within."""

    square: float
    doubt: float
    p99: float

    @property
    def rmse(self) -> float:
        """What is told: a mean within its own noise of 0 tells no more than that."""
        return math.sqrt(max(self.square, self.doubt))

    def within(self, wanted: float) -> bool:
        """Whether the RMSE is the wanted one or less, its doubt allowed for."""
        return self.square + self.allowance(wanted) <= wanted**2

    def allowance(self, wanted: float) -> float:
        """What the square must stay below that of the wanted error, or a lucky measurement would end a bake. Never so
        much that a bake goes on for the sake of the doubt alone."""
        return min(self.doubt, _MOST_DOUBT * wanted**2)


@dataclass(frozen=True, eq=False)
class Probes:
    """texels: (N,) int64, y · W + x. weight: (N,) float64, 1 on average over the texels. first, second: (R, N) float64,
    the two estimates of each of the map's rows. rays: of each lane. placed: how many were traced, those that turned out
    to face away among them."""

    texels: Longs
    weight: Doubles
    first: Doubles
    second: Doubles
    rays: int
    placed: int

    @property
    def cost(self) -> int:
        """All their rays."""
        return rays_of(self.placed, self.rays)

    @property
    def noise(self) -> float:
        """The mean square of each estimate's own error, of the first row; 0 of no probes."""
        if not len(self.texels):
            return 0.0
        return 0.5 * float(np.average((self.first[0] - self.second[0]) ** 2, weights=self.weight))

    def joined(self, others: Probes) -> Probes:
        """With others, of as many rays each, that were placed by other numbers."""
        first, second = (
            np.concatenate(pair, axis=1) for pair in ((self.first, others.first), (self.second, others.second))
        )
        texels, weight = np.concatenate([self.texels, others.texels]), np.concatenate([self.weight, others.weight])
        return Probes(texels, weight, first, second, self.rays, self.placed + others.placed)

    def error(self, values: Floats) -> Error:
        """The error of a finished map, (H, W) float32, its first row."""
        return self._error(values[np.newaxis], slice(0, 1))

    def error_of_more(self, rows: Floats, accumulator: Accumulator) -> Error:
        """That of all rows after the first, (R - 1, H, W) float32, together: the length of the difference, of bent
        directions at unit length. Of these each counts by its AO: what is closed has no direction."""
        if accumulator is not Accumulator.BENT:
            return self._error(rows, slice(1, None))
        estimates = (np.concatenate([each[:1], directions(each[1:])]) for each in (self.first, self.second))
        open_share = 0.5 * (self.first[0] + self.second[0])
        if not open_share.any():
            return Error(0.0, 0.0, 0.0)
        told = replace(self, first=next(estimates), second=next(estimates), weight=self.weight * open_share)
        return told._error(directions(rows), slice(1, None))

    def _error(self, rows: Reals, which: slice) -> Error:
        if not len(self.texels):
            return Error(0.0, 0.0, 0.0)
        there = rows.reshape(len(rows), -1)[:, self.texels].astype(np.float64)
        squares = ((there - self.first[which]) * (there - self.second[which])).sum(axis=0)
        mean = float(np.average(squares, weights=self.weight))
        doubt = math.sqrt(float(((self.weight * (squares - mean)) ** 2).sum())) / float(self.weight.sum())
        # The probes' own noise widens the differences; their shape is taken as it is, their width as measured.
        apart = np.linalg.norm(there - 0.5 * (self.first[which] + self.second[which]), axis=0)
        width = math.sqrt(float(np.average(apart**2, weights=self.weight)))
        narrowed = math.sqrt(max(mean, doubt)) / width if width > 0.0 else 0.0
        return Error(mean, doubt, narrowed * _quantile(apart, self.weight, 0.99))

    def squares(self, values: Floats) -> Doubles:
        """(N,) float64: an unbiased estimate of each probe's squared error, which noise may carry below 0."""
        there = values.reshape(-1)[self.texels].astype(np.float64)
        squares: Doubles = (there - self.first[0]) * (there - self.second[0])
        return squares


def how_many(texels: int) -> int:
    """Probes that a map of so many covered texels usually has, at most."""
    return min(max(texels // SHARE, FEWEST), MOST, texels)


def rays_of(count: int, rays: int) -> int:
    """All that so many probes take, of so many rays a lane."""
    return 2 * LANES * rays * count


def place(expected: Floats, covered: Flags, seed: int, most: int = MOST) -> tuple[Longs, Doubles]:
    """Choose texels to probe, half of them evenly and half by the expected squared error; texels and weights.

    expected: (H, W) float32, 0 where nothing is covered. most: no more than so many. Stratified: one texel from each of
    equal shares of the image, block by block.
    """
    texels, squares = block_sums(covered), block_sums(expected)
    count = min(how_many(int(texels.sum())), most)
    if count == 0:
        return np.zeros(0, dtype=np.int64), np.zeros(0)
    mean = float(squares.sum() / texels.sum())
    even, steered = (0.5, 0.5 / mean) if mean > 0.0 else (1.0, 0.0)
    ladder = np.concatenate([[0.0], np.cumsum(even * texels + steered * squares)])
    jitter = np.random.default_rng(seed & 0xFFFFFFFFFFFFFFFF).random(count)  # one for all would alias with the rows
    steps = np.minimum(
        (np.arange(count, dtype=np.int64) + jitter) * (ladder[-1] / count), np.nextafter(ladder[-1], 0.0)
    )
    block = np.searchsorted(ladder, steps, side="right") - 1
    # Within its block a step goes on by the block's texels; rounding may carry it past the last of them.
    among, there = texels_in(block, covered)
    among = np.where(there, among, among[:, :1])
    density = np.where(there, even + steered * expected.reshape(-1)[among].astype(np.float64), 0.0)
    rungs = np.cumsum(density, axis=1)
    rest = np.minimum(steps - ladder[block], np.nextafter(rungs[:, -1], 0.0))
    lane = (rungs <= rest[:, np.newaxis]).sum(axis=1)[:, np.newaxis]
    chosen: Longs = np.take_along_axis(among, lane, axis=1)[:, 0]
    return chosen, 1.0 / np.take_along_axis(density, lane, axis=1)[:, 0]


def rays_for(error: float) -> int:
    """Rays of a lane, for a map of about this error: a probe's own noise is then one to three times that.

    By the error of plain rays on the samples, 0.048 at 16 and falling as N^-0.75.
    """
    rays = 0.5 * float(power(0.048 / max(error, 1e-9), 4.0 / 3.0))
    return 1 << round(math.log2(min(max(rays, FEWEST_LANE_RAYS), MOST_LANE_RAYS)))


def draw(texels: Longs, weight: Doubles, rays: int, trace: Trace, totals: Totals) -> Probes:
    """Trace the probes, `rays` a lane. Those that turn out to face away from the camera are dropped."""
    listed = np.repeat(texels, LANES)
    images = [each.reshape(len(each), -1, LANES).astype(np.float64) for each in (trace(listed, rays) for _ in range(2))]
    seen = np.all([each[0].min(axis=1, initial=0.0) >= 0.0 for each in images], axis=0)
    together = LANES * rays
    first, second = (totals(each[:, seen].sum(axis=2), together) / together for each in images)
    return Probes(texels[seen], weight[seen], first, second, rays, len(texels))


def _quantile(values: Doubles, weight: Doubles, share: float) -> float:
    order = np.argsort(values, kind="stable")
    ladder = np.cumsum(weight[order])
    return float(values[order][np.searchsorted(ladder, share * ladder[-1])])
