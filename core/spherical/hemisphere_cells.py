"""Cells of equal solid angle that cut up the hemisphere about the normal, and integrals over them.

A direction is (x, y, z) in the frame of the texel: x the tangent, y the bitangent, z the shading normal. The unit
square of (u, v) goes onto the disk by the concentric map of Shirley & Chiu (A Low Distortion Map Between Disk and
Square, 1997) and the disk onto the hemisphere with r² = 1 − z, which keeps areas. So all of side × side cells of the
square have the solid angle 2π / side², and a cell of a coarse grid is 2 × 2 of the next finer one.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from ..base.arrays import Doubles, Floats, Longs, Reals
from ..base.elementary import arctan2, cos, sin
from ..base.errors import InputError

SIDES = (8, 16)  # of the grids that are baked: 64 and 256 cells
HEMISPHERE = 2.0 * np.pi


def check_side(side: int) -> None:
    """Raises InputError for a grid that is not baked."""
    if side not in SIDES:
        raise InputError(f"{side} x {side} cells: no such grid; choose 8 or 16 a side")


def check_cells(cells: Floats) -> None:
    """Raises InputError for anything but (N, side, side) mean visibilities of a grid that is baked."""
    if cells.ndim != 3 or cells.shape[1] != cells.shape[2]:
        raise InputError(f"cells of shape {cells.shape}: not a square grid a texel; give (N, side, side)")
    check_side(cells.shape[1])


def directions(u: ArrayLike, v: ArrayLike) -> Doubles:
    """Unit directions of places in the square: u, v of one shape (...), 0 to 1 → (..., 3) float64."""
    a, b = 2.0 * np.asarray(u, dtype=np.float64) - 1.0, 2.0 * np.asarray(v, dtype=np.float64) - 1.0
    wide = np.abs(a) > np.abs(b)
    radius, other = np.where(wide, a, b), np.where(wide, b, a)
    turn = 0.25 * np.pi * np.divide(other, radius, out=np.zeros_like(radius), where=radius != 0.0)
    angle = np.where(wide, turn, 0.5 * np.pi - turn)
    stretch = np.sqrt(2.0 - radius**2)  # sin θ over r, with cos θ = 1 − r²
    x, y = radius * stretch * cos(angle), radius * stretch * sin(angle)
    placed: Doubles = np.stack([x, y, 1.0 - radius**2], axis=-1)
    return placed


def square_of(ways: Reals) -> tuple[Doubles, Doubles]:
    """The places (u, v), each (...) float64, of unit directions (..., 3); those below the horizon lie on the rim."""
    x, y, z = (np.asarray(ways[..., axis], dtype=np.float64) for axis in range(3))
    radius = np.sqrt(np.clip(1.0 - z, 0.0, 1.0))
    wide = np.abs(x) > np.abs(y)
    long, short = np.where(wide, x, y), np.where(wide, y, x)
    share = arctan2(short * np.sign(long), np.abs(long)) / (0.25 * np.pi)  # 0 where both are 0
    major = np.copysign(radius, long)
    minor = major * share
    a, b = np.where(wide, major, minor), np.where(wide, minor, major)
    return 0.5 * (a + 1.0), 0.5 * (b + 1.0)


def cell_of(ways: Reals, side: int) -> Longs:
    """Which cell each of (..., 3) unit directions falls into: row · side + column, the row along v."""
    u, v = square_of(ways)
    column, row = (np.clip((each * side).astype(np.int64), 0, side - 1) for each in (u, v))
    which: Longs = row * side + column
    return which


def subcells(side: int, parts: int) -> Doubles:
    """(side², parts², 3) float64: the middles of parts × parts pieces of equal solid angle of every cell, in the order
    of `cell_of`."""
    steps = (np.arange(side * parts, dtype=np.int64) + 0.5) / (side * parts)
    v, u = np.meshgrid(steps, steps, indexing="ij")
    return _by_cell(directions(u, v), side, parts)


def integrals(function: Callable[[Doubles], Doubles], side: int) -> Doubles:
    """∫ f dω over every cell: (side², K) float64, in the order of `cell_of`, of a smooth f: (M, 3) → (M, K).

    By Gauss-Legendre on the halves of each cell: the map has kinks along the diagonals of the square, and nowhere else.
    Spherical harmonics to degree 6 come out to 1e-12.
    """
    u, v, weights = _halves(side)
    values = function(directions(u, v).reshape(-1, 3)).reshape(side * side, len(weights), -1)
    whole = np.zeros((len(values), values.shape[2]))
    for node, weight in enumerate(weights):  # one after the other, on all processors
        whole += weight * values[:, node]
    whole *= HEMISPHERE / side**2
    return whole


def coarser(cells: Floats) -> Floats:
    """(N, side, side) mean visibilities → (N, side / 2, side / 2), the means of 2 × 2 cells, which is exact."""
    count, side = len(cells), cells.shape[1] // 2
    means: Floats = cells.reshape(count, side, 2, side, 2).mean(axis=(2, 4), dtype=np.float32)
    return means


@lru_cache
def gauss(count: int) -> tuple[Doubles, Doubles]:
    """Nodes and weights of Gauss-Legendre quadrature from 0 to 1, (count,) float64 each, not to be written to.

    By Newton's method from cosines near the roots of the Legendre polynomial; numpy's go by LAPACK, which has bits of
    its own on each system.
    """
    roots = -cos(np.pi * (np.arange(count, dtype=np.int64) + 0.75) / (count + 0.5))
    for _ in range(_NEWTON):
        value, slope = _legendre(roots, count)
        roots = roots - value / slope
    _, slope = _legendre(roots, count)
    weights = 2.0 / ((1.0 - roots * roots) * slope * slope)
    found = 0.5 * (roots + 1.0), 0.5 * weights
    for each in found:
        each.flags.writeable = False
    return found


_NEWTON = 8  # steps: from so near four would do


def _legendre(x: Doubles, degree: int) -> tuple[Doubles, Doubles]:
    """P_n and its derivative between -1 and 1, by Bonnet's recurrence."""
    before, value = np.zeros_like(x), np.ones_like(x)
    for n in range(degree):
        before, value = value, ((2 * n + 1) * x * value - n * before) / (n + 1)
    return value, degree * (before - x * value) / (1.0 - x * x)


_NODES = 8  # of the quadrature, along a side


def _halves(side: int) -> tuple[Doubles, Doubles, Doubles]:
    """Nodes in every cell: u and v, (side², Q) float64 each, and their weights, (Q,), whose sum is 1.

    A cell is cut from its corner nearest to the middle of the square to the one across, and each half has its nodes
    along rays from that corner, where the map of the four cells in the middle is not smooth (Duffy's coordinates).
    """
    nodes, shares = gauss(_NODES)
    out, across = np.repeat(nodes, _NODES), np.tile(nodes, _NODES)
    weight = np.repeat(shares * nodes, _NODES) * np.tile(shares, _NODES)
    along, aside = np.concatenate([out, out * across]), np.concatenate([out * across, out])
    row, column = (each.reshape(-1, 1) for each in np.indices((side, side), dtype=np.int64))
    v, u = (_from_middle(index, offset, side) for index, offset in ((row, aside), (column, along)))
    return u, v, np.concatenate([weight, weight])


def _from_middle(index: Longs, offset: Doubles, side: int) -> Doubles:
    """Places at an offset, in cells, from the edge of a cell that is nearer to the middle of the square."""
    outward = index >= side // 2
    place: Doubles = np.where(outward, index + offset, index + 1.0 - offset) / side
    return place


def _by_cell(grid: Doubles, side: int, parts: int) -> Doubles:
    """(side · parts, side · parts, 3) → (side², parts², 3)."""
    blocks = grid.reshape(side, parts, side, parts, 3).swapaxes(1, 2)
    return blocks.reshape(side * side, parts * parts, 3)
