"""The octahedral map: all directions on a square, and what its cells are on the sphere.

A unit direction w has s = |x| + |y| + |z| and the point p = (x, y) / s of the square [-1, 1]²; below z = 0 the point is
folded outwards, to ((1 − |p.y|) · sign p.x, (1 − |p.x|) · sign p.y), a sign of 0 being +1 (Engelhardt & Dachsbacher,
Octahedron Environment Maps, 2008). Of n × n cells, that in row j and column i begins at (-1 + 2i/n, -1 + 2j/n).

On each face of the octahedron the map is linear, so straight lines are arcs of great circles, and a cell, cut along the
diagonal that the fold takes, is two spherical triangles: solid angles are exact.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..base.arrays import Doubles, Longs, Reals
from ..base.elementary import arctan2
from ..base.vectors import dot, length_of


def octahedral(directions: Reals) -> Doubles:
    """Points of the square, (..., 2) float64, of unit directions (..., 3)."""
    unfolded = np.asarray(directions, dtype=np.float64)
    unfolded = unfolded / np.abs(unfolded).sum(axis=-1, keepdims=True)
    points: Doubles = np.where(unfolded[..., 2:] < 0.0, _folded(unfolded[..., :2]), unfolded[..., :2])
    return points


def on_octahedron(points: Reals) -> Doubles:
    """Points of the square, (..., 2), as points of the octahedron |x| + |y| + |z| = 1: (..., 3) float64. Times 1 over
    their length they are unit directions; the cube of that, s³, is the solid angle of an area of the square."""
    flat = np.asarray(points, dtype=np.float64)
    z = 1.0 - np.abs(flat).sum(axis=-1, keepdims=True)
    return np.concatenate([np.where(z < 0.0, _folded(flat), flat), z], axis=-1)


def directions(points: Reals) -> Doubles:
    """Unit directions, (..., 3) float64, of points of the square (..., 2)."""
    vectors = on_octahedron(points)
    unit: Doubles = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return unit


def spread_of(points: Reals) -> Doubles:
    """(...) float64, s³: the solid angle over the area of the square, at its points (..., 2)."""
    length = length_of(on_octahedron(points))
    spread: Doubles = 1.0 / (length * length * length)
    return spread


def cell_of(points: Reals, n: int) -> Longs:
    """The cell, row · n + column, that points of the square (..., 2) lie in: (...) int64."""
    along = np.clip(np.floor(0.5 * n * (np.asarray(points) + 1.0)).astype(np.int64), 0, n - 1)
    cells: Longs = along[..., 1] * n + along[..., 0]
    return cells


def middles(n: int, rows: slice = slice(None)) -> Doubles:
    """(rows, n, 2) float64: the middles of the cells, of all rows or of some."""
    along = (2.0 * np.arange(n, dtype=np.int64) + 1.0) / n - 1.0
    return np.stack(np.broadcast_arrays(along[np.newaxis, :], along[rows, np.newaxis]), axis=-1)


@lru_cache(maxsize=4)
def solid_angles(n: int) -> Doubles:
    """(n, n) float64, in steradians, for an even n; not to be written to. A. van Oosterom & J. Strackee, The Solid
    Angle of a Plane Triangle, 1983."""
    a, b, c = np.moveaxis(_triangles(n), -2, 0)
    volume = dot(a, np.cross(b, c))
    edges = 1.0 + sum(dot(one, other) for one, other in ((a, b), (b, c), (c, a)))
    angles: Doubles = 2.0 * arctan2(volume, edges).sum(axis=0)
    angles.setflags(write=False)
    return angles


def sample_weights(n: int, count: int) -> Doubles:
    """(n · count, n · count) float64: the solid angles that the middles of count × count parts of each cell stand for;
    they add up to the cell's own, for an even n."""
    side = n * count
    weights = spread_of(middles(side))
    shares: Doubles = weights * repeated(solid_angles(n) / block_sums(weights, n), count)
    return shares


def block_sums(values: Reals, n: int) -> Doubles:
    """Sums over the n × n blocks that (n · count, n · count, ...) values lie in: (n, n, ...) float64."""
    count = len(values) // n
    sums: Doubles = values.reshape(n, count, n, count, *values.shape[2:]).sum(axis=(1, 3), dtype=np.float64)
    return sums


def repeated(values: Reals, count: int) -> Reals:
    """(n, n, ...) values over count × count parts of each cell."""
    over: Reals = np.repeat(np.repeat(values, count, axis=0), count, axis=1)
    return over


def _folded(points: Doubles) -> Doubles:
    """(..., 2): the point of the other side of the fold."""
    folded: Doubles = (1.0 - np.abs(points[..., ::-1])) * np.where(points < 0.0, -1.0, 1.0)
    return folded


def _triangles(n: int) -> Doubles:
    """(2, n, n, 3, 3) float64: unit directions of the corners of each cell's two triangles."""
    along = np.linspace(-1.0, 1.0, n + 1)
    grid = directions(np.stack(np.meshgrid(along, along), axis=-1))
    around = np.stack([grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]])
    below = np.arange(n, dtype=np.int64) < n // 2
    falling = (below[:, np.newaxis] == below)[..., np.newaxis]  # the fold goes from the second corner to the fourth
    a, b, c, d = np.where(falling, around, np.roll(around, -1, axis=0))
    return np.stack([np.stack([a, b, d], axis=-2), np.stack([b, c, d], axis=-2)])
