"""Light from far away as points on the sphere, few or many, for sums over lobes.

A point stands for a block of the map's cells, or for a part of one, and is where the energy of the block has its mean,
with the covariance of its directions: so a sun in a wide block stays where it is, and as small, and sums of a smooth
function are right to second order in the width of the blocks.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Doubles, Floats
from .octahedral_map import block_sums, middles, on_octahedron, repeated, solid_angles


@dataclass(frozen=True, eq=False)
class LightClusters:
    """energy: (P, 3) float64, radiance times solid angle. mean: (P, 3) float64, of its directions, shorter than 1.
    covariance: (P, 6) float64, of these: xx, yy, zz, xy, yz, zx. width: (P,) float64, the side of a square with it."""

    energy: Doubles
    mean: Doubles
    covariance: Doubles
    width: Doubles

    def part(self, which: NDArray[Any]) -> LightClusters:
        """Some of them, by indices or by whether."""
        return LightClusters(self.energy[which], self.mean[which], self.covariance[which], self.width[which])


def light_clusters(radiance: Floats, luminance: Doubles, side: int) -> LightClusters:
    """The light of an octahedral map, radiance (n, n, 3), luminance (n, n), in side × side points, less black ones."""
    finest = max(len(radiance), side)
    count = finest // len(radiance)
    radiance, luminance = repeated(radiance, count), repeated(luminance, count)
    weights = np.maximum(luminance, 1e-6 * luminance.max(initial=1e-30))[..., np.newaxis]
    energy = block_sums(radiance * solid_angles(finest)[..., np.newaxis], side).reshape(-1, 3)
    sums = block_sums(weights * _moments(finest), side).reshape(-1, 10)
    lit = energy.any(axis=1)
    energy, sums = energy[lit], sums[lit, 1:] / sums[lit, :1]
    mean = sums[:, :3]
    covariance = sums[:, 3:] - products(mean)
    variance = covariance[:, :3].sum(axis=1)  # of a square it is width² / 6
    return LightClusters(energy, mean, covariance, np.sqrt(6.0 * np.maximum(variance, 1e-12)))


def products(ways: Doubles) -> Doubles:
    """(..., 3) → (..., 6): xx, yy, zz, xy, yz and zx."""
    pairs: Doubles = np.concatenate([ways * ways, ways * np.roll(ways, -1, axis=-1)], axis=-1)
    return pairs


def _moments(n: int) -> Doubles:
    """(n, n, 10) float64: the integrals of 1, of ω and of its products over each cell, by 2 × 2 points of Gauss."""
    sums = np.zeros((n, n, 10))
    for signs in np.ndindex(2, 2):
        at = on_octahedron(middles(n) + (2.0 * np.array(signs) - 1.0) / (np.sqrt(3.0) * n))
        length = np.linalg.norm(at, axis=-1, keepdims=True)
        way = at / length
        sums += (1.0 / (length * length * length)) * np.concatenate([np.ones_like(length), way, products(way)], axis=-1)
    exact: Doubles = sums * (solid_angles(n) / sums[..., 0])[..., np.newaxis]
    return exact
