"""Light from far away: the radiance of every direction, on an octahedral map, and how it comes to be there.

It is constant over each cell of the map (octahedral_map.py), so that everything that is asked of it, energy, densities
and the light of an open surface, has one answer, whatever it was made from.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..base.arrays import Doubles, Floats, Reals
from ..base.errors import InputError
from ..base.vectors import dot
from .equirectangular import averaged
from .octahedral_map import block_sums, directions, middles, sample_weights, solid_angles
from .prefilter import PrefilteredEnvironment
from .sampling_tables import PiecewiseConstant2D, tables

LARGEST_SIZE = 1024
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # ITU-R BT.709
_BAND = 64  # rows of samples at a time


@dataclass(frozen=True, eq=False)
class Environment:
    """radiance: (n, n, 3) float32, linear RGB from 0, of the cells of the octahedral map in world axes, z up; n a power
    of two from 2 to 1024. Raises InputError for anything else."""

    radiance: Floats

    def __post_init__(self) -> None:
        n = len(self.radiance)
        if self.radiance.shape != (n, n, 3):
            raise InputError(f"Environment: a map of shape {self.radiance.shape}; give (n, n, 3)")
        _check_size(n)
        _check_light(self.radiance)
        object.__setattr__(self, "radiance", np.ascontiguousarray(self.radiance, dtype=np.float32))

    @cached_property
    def luminance(self) -> Doubles:
        """(n, n) float64, of each cell."""
        luminance: Doubles = dot(self.radiance.astype(np.float64), _LUMINANCE)
        return luminance

    @cached_property
    def sampling(self) -> PiecewiseConstant2D:
        """How to draw directions in proportion to luminance; by solid angle where all is black."""
        angles = solid_angles(len(self.radiance))
        return tables(self.luminance * angles if self.luminance.any() else angles)

    @cached_property
    def prefiltered(self) -> PrefilteredEnvironment:
        """The same as points, for sums."""
        return PrefilteredEnvironment(self.radiance, self.luminance)


def open_light(
    environment: Environment, axes: Doubles, normals: Doubles, exponent: float, *, threads: int = 0
) -> Doubles:
    """The light that open surfaces get: ∫ L (e+1)/(2π) max(a·ω, 0)^e dω over the hemisphere of the normal.

    axes, normals: (N, 3) unit vectors, the same object where they are the same. exponent: e ≥ 0; 1 about the normal is
    irradiance over π. threads 0: all. Returns (N, 3) float64; prefilter.py tells how exact it is. Many at a time are
    faster, about the normal above all.
    """
    return environment.prefiltered.gathered(axes, normals, exponent, threads)


def from_octahedral(radiance: Reals, n: int) -> Environment:
    """The mean by solid angle over each cell, of a finer octahedral map (m, m, 3), m a multiple of n."""
    _check_size(n)
    weights = sample_weights(n, len(radiance) // n)
    sums = block_sums(radiance * weights[..., np.newaxis], n)
    return Environment((sums / solid_angles(n)[..., np.newaxis]).astype(np.float32))


def from_function(radiance: Callable[[Doubles], Doubles], n: int) -> Environment:
    """The means of a function over the cells; it is called with unit directions, (N, 3), and gives their light, (N, 3).

    Raises InputError."""
    _check_size(n)
    side = n * _samples(n)
    values = np.empty((side, side, 3))
    for start in range(0, side, _BAND):
        rows = slice(start, start + _BAND)
        ways = directions(middles(side, rows))
        values[rows] = radiance(ways.reshape(-1, 3)).reshape(ways.shape)
    return from_octahedral(values, n)


def from_equirectangular(pixels: Floats, n: int, rotation: Doubles | None = None) -> Environment:
    """An equirectangular image, (h, w, 3) float32 linear RGB, row 0 at the top, laid around as equirectangular.py says.

    rotation: (3, 3), from world directions to the image's; None: they are the same. Its energy is kept, that of a sun
    of one pixel too. Raises InputError for values that are no light, and for a size that no map has.
    """
    _check_size(n)
    _check_light(pixels)
    means = averaged(pixels, dot(pixels.astype(np.float64), _LUMINANCE), n, _samples(n), rotation)
    return Environment(means.astype(np.float32))


def broken_pixels(values: Reals) -> str:
    """How many of the pixels, (..., 3), are not finite, in words; empty where all are."""
    broken = int(np.count_nonzero(~np.isfinite(values).all(axis=-1)))
    return "" if not broken else "1 pixel is not finite" if broken == 1 else f"{broken} pixels are not finite"


def _samples(n: int) -> int:
    """How many there are along the side of a cell, of what is averaged over it."""
    return min(max(2048 // n, 4), 16)


def _check_size(n: int) -> None:
    if not 2 <= n <= LARGEST_SIZE or n & (n - 1):
        raise InputError(f"Environment: a map of size {n}; give a power of two from 2 to {LARGEST_SIZE}")


def _check_light(values: Reals) -> None:
    if broken := broken_pixels(values):
        raise InputError(f"Environment: {broken}; mend the image, or choose another")
    if (values < 0.0).any():
        raise InputError("Environment: there is light below 0; clamp it to 0")
