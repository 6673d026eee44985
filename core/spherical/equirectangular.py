"""Equirectangular images of all directions, as Blender lays them around, brought onto the octahedral map.

Columns go by ½ − atan2(y, x) / 2π, so that the middle of the image lies along +x and its left quarter along +y; rows go
by acos(z) / π, from the top, which is up.
"""

from __future__ import annotations

import numpy as np

from ..base.arrays import Doubles, Flags, Floats, Ints
from ..base.elementary import arccos, arctan2, cos, sin
from ..base.vectors import mapped
from .octahedral_map import block_sums, cell_of, directions, middles, octahedral, sample_weights, solid_angles

_BAND = 64  # rows of samples at a time
_BRIGHT = 4.0  # times the mean


def pixel_angles(shape: tuple[int, int]) -> Doubles:
    """(h, 1) float64: the solid angle of the pixels of each row."""
    height, width = shape
    edges = cos(np.linspace(0.0, np.pi, height + 1))
    angles: Doubles = (-np.diff(edges) * 2.0 * np.pi / width)[:, np.newaxis]
    return angles


def averaged(pixels: Floats, luminance: Doubles, n: int, count: int, rotation: Doubles | None) -> Doubles:
    """Means over the cells of an n × n map, (n, n, 3) float64, by count × count samples a cell.

    pixels: (h, w, 3), each one radiance; luminance: (h, w). rotation: (3, 3), from world directions to the image's.

    How many samples meet a pixel is a matter of luck, and of a sun of one pixel so would be its energy. So the samples
    that meet a bright pixel share its own solid angle among them, and one that no sample met goes to the cell that its
    middle lies in. Others keep the samples' solid angles, so that an even sky stays even.
    """
    height, width = luminance.shape[:2]
    shape = height, width
    met = _pixels_met(shape, n * count, rotation)
    weights = sample_weights(n, count)
    found = np.bincount(met.ravel(), weights.ravel(), luminance.size).reshape(shape)
    angles = np.broadcast_to(pixel_angles(shape), shape)
    bright = luminance > _BRIGHT * (luminance * angles).sum() / (4.0 * np.pi)
    scaled = pixels.astype(np.float64)
    meant = bright & (found > 0.0)
    scaled[meant] *= (angles[meant] / found[meant])[:, np.newaxis]
    sums = block_sums(scaled.reshape(-1, 3)[met] * weights[..., np.newaxis], n).reshape(-1, 3)
    missed = bright & (found == 0.0)
    cells = cell_of(octahedral(_middles_of(missed, rotation)), n)
    np.add.at(sums, cells, pixels[missed] * angles[missed][:, np.newaxis])
    means: Doubles = sums.reshape(n, n, 3) / solid_angles(n)[..., np.newaxis]
    return means


def _pixels_met(shape: tuple[int, int], side: int, rotation: Doubles | None) -> Ints:
    """(side, side) int32: the pixel, row · w + column, in the direction of each sample."""
    height, width = shape
    met = np.empty((side, side), dtype=np.int32)
    for start in range(0, side, _BAND):
        rows = slice(start, start + _BAND)
        ways = directions(middles(side, rows))
        x, y, z = np.moveaxis(ways if rotation is None else mapped(ways, rotation), -1, 0)
        columns = np.floor((0.5 - arctan2(y, x) / (2.0 * np.pi)) * width).astype(np.int32) % width
        lines = np.floor(arccos(np.clip(z, -1.0, 1.0)) / np.pi * height).astype(np.int32)
        met[rows] = np.minimum(lines, height - 1) * width + columns
    return met


def _middles_of(which: Flags, rotation: Doubles | None) -> Doubles:
    """(N, 3) float64: the world directions of the middles of some pixels, (h, w) bool."""
    rows, columns = np.nonzero(which)
    polar = (rows + 0.5) / which.shape[0] * np.pi
    turn = 2.0 * np.pi * (0.5 - (columns + 0.5) / which.shape[1])
    ways: Doubles = np.stack([sin(polar) * cos(turn), sin(polar) * sin(turn), cos(polar)], axis=-1)
    return ways if rotation is None else mapped(ways, rotation.T)
