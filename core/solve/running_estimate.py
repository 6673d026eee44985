"""What is known of one map while its rays are traced, round by round: values, their precision, a crude noise."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..base.arrays import Flags, Floats, Longs

# Half the difference between a texel's first and second half of rays would be the error of their mean, were the halves
# independent. They are not: each completes the other's points, and the mean is better than that. Measured on the mesh
# of the sample `suzanne`, AO and RO of exponents 0, 10 and 100, against 8192 rays: the true error is 0.73 to 0.80 of it
# at 4 to 256 rays (0.81 to 0.86 at 1024), and 0.65 to 0.70 at 2 and 3.
_FEW, _FEW_RAYS, _MANY = 0.68, 4, 0.76

# Halves of few rays agree by chance; where values lie between 0 and 1 there is noise even so. N independent rays of
# mean p vary by p (1 - p) / N, and those of a net by 1.3 / √N of that, as measured for visibility under a sphere and
# beside a wall. The mean of both estimates is steadier than either.
_NET = 1.3

# With a single ray neither tells, and the most that one ray of weight 1 can vary stands in.
_ONE_RAY = 0.25

# What is known otherwise counts for no more than a round of 2.5 times the first one's rays: its errors are of one kind.
_MOST_PRECISION = 4.0


@dataclass(eq=False)
class RunningEstimate:
    """One map so far. Where a texel's rays go on depends on what they found so far, which biases its value by a little;
    the probes measure that with all else. All images are (H, W) float32, 0 where there are no rays.

    value: the mean of all rays. precision: 1 for `unit` of them. noise: for each texel an unbiased but crude estimate
    of the variance of a value of precision 1.
    """

    value: Floats
    precision: Floats
    noise: Floats
    unit: int

    @classmethod
    def empty(cls, shape: tuple[int, ...], unit: int) -> RunningEstimate:
        """Before the first round. unit: the rays of a texel in it."""
        value, precision, noise = (np.zeros(shape, dtype=np.float32) for _ in range(3))
        return cls(value, precision, noise, unit)

    def begin(self, total: Floats, first_half: Floats, where: Flags) -> None:
        """Take in the first round: sums over each texel's `unit` rays and over the first half of them, (H, W), for the
        texels `where`."""
        value, noise = total * np.float32(1.0 / self.unit), _noise(total, first_half, self.unit)
        np.copyto(self.value, value, where=where)
        np.copyto(self.noise, noise, where=where)
        np.copyto(self.precision, np.float32(1.0), where=where)

    def go_on(self, total: Floats, first_half: Floats, before: int, after: int, texels: Longs) -> None:
        """Take in a round that goes on in the sequences of some texels, y · W + x, from `before` rays to `after`, twice
        as many at least: sums over each one's rays, (N,), and over those of them that are of the first half of `after`.
        What faces away in a round has none: at the next the mean that it had stands in."""
        value, precision, noise = (image.reshape(-1) for image in (self.value, self.precision, self.noise))
        so_far = value[texels] * np.float32(before)
        share = np.float32(_gain(after / self.unit))
        value[texels] = (so_far + total) * np.float32(1.0 / after)
        noise[texels] = _noise(so_far + total, so_far + first_half, after) * share
        precision[texels] = share

    def lend(self, own: Longs, others: Longs, value: Floats, square: Floats) -> None:
        """Give texels that have no rays values that are known otherwise, until `take_back`. own: those that have some.
        value, square: (H, W), what is known, and the square of its error as it is expected."""
        noise = np.float32(self.noise.reshape(-1)[own].mean())
        known = noise / np.maximum(square.reshape(-1)[others], np.float32(1e-12))
        self.value.reshape(-1)[others] = value.reshape(-1)[others]
        self.precision.reshape(-1)[others] = np.minimum(known, np.float32(_MOST_PRECISION))
        self.noise.reshape(-1)[others] = noise

    def take_back(self, others: Longs) -> None:
        """Texels have no rays any more that had none before."""
        self.precision.reshape(-1)[others] = 0.0


def _gain(times: float) -> float:
    """How many times less the variance is by so many times the rays: it falls as N^-1.5, for they are a scrambled net,
    and the integrand has edges."""
    return times * math.sqrt(times)


def _noise(total: Floats, first_half: Floats, rays: int) -> Floats:
    if rays == 1:
        return np.full_like(total, _ONE_RAY)
    half = rays // 2
    calibrated = 0.5 * (_FEW if rays < _FEW_RAYS else _MANY)
    difference = first_half * np.float32(calibrated / half + calibrated / (rays - half))
    difference -= total * np.float32(calibrated / (rays - half))
    mean = total * np.float32(1.0 / rays)
    spread = 1.0 - mean
    spread *= mean
    np.maximum(spread, np.float32(0.0), out=spread)
    spread *= np.float32(_NET / _gain(rays))
    noise: Floats = np.square(difference, out=difference)  # in place: these are large, and new memory costs more
    noise += spread
    noise *= np.float32(0.5)
    return noise
