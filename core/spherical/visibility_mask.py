"""Visibility over the hemisphere in cells of equal solid angle, a bit or a mean each, and reflection occlusion from it.

A bit says whether at least half of its cell is open. Bit k = row · side + column of the grid (`cells`) is bit k mod 8,
from the least, of byte k div 8: 8 × 8 cells are a byte a row, 16 × 16 two, their left half first.

RO is the lobe's integral over the open cells, as a share of that over all of them, times the open horizon H_e: so an
open texel comes out exactly.
"""

from __future__ import annotations

from math import ceil, pi, sqrt

import numpy as np

from ..base.arrays import Bytes, Doubles, Floats, Reals
from ..base.elementary import powers, product
from ..base.errors import InputError
from ..base.vectors import length_of
from .hemisphere_cells import check_cells, check_side, subcells
from .lobe import check_exponent, open_horizon

_PARTS = 2.0  # pieces of a cell to a side, for each 1/√(e + 1) that the cell is wide
_MOST_PARTS = 24  # enough for exponent 1000; a lobe that falls between pieces takes the nearest
_AT_A_TIME = 1 << 22  # values of the lobe


def pack(cells: Floats) -> Bytes:
    """Mean visibilities (N, side, side) → (N, side² / 8) uint8. Raises InputError for a grid that is not baked."""
    check_cells(cells)
    return np.ascontiguousarray(np.packbits(cells.reshape(len(cells), -1) >= 0.5, axis=1, bitorder="little"))


def unpack(masks: Bytes) -> Floats:
    """(N, side² / 8) uint8 → (N, side, side) float32, 0 or 1. Raises InputError for a grid that is not baked."""
    side = round(sqrt(8 * masks.shape[1]))
    if side * side != 8 * masks.shape[1]:
        raise InputError(f"{masks.shape[1]} bytes a mask: no square grid; give 8 or 32")
    check_side(side)
    bits = np.unpackbits(masks, axis=1, bitorder="little")
    return bits.reshape(-1, side, side).astype(np.float32)


def rebuild(cells: Floats, reflected: Reals, exponent: float) -> Floats:
    """RO from means, or unpacked bits, (N, side, side), and unit R in the texels' frames, (N, 3) → (N,) float32.

    R below the horizon is taken for one on it. Each cell is one visibility, and the lobe is integrated over it. Raises
    InputError for a grid that is not baked or an exponent below 0.
    """
    check_cells(cells)
    exponent = check_exponent(exponent)
    side = cells.shape[1]
    pieces = subcells(side, _parts(side, exponent)).astype(np.float32)
    step = max(1, _AT_A_TIME // pieces[..., 0].size)
    rebuilt = np.empty(len(cells), dtype=np.float32)
    for start in range(0, len(cells), step):
        part = slice(start, start + step)
        ways = _above(np.asarray(reflected[part], dtype=np.float64))
        weights = _lobe(pieces, ways, exponent)
        share = (weights * cells[part].reshape(len(ways), -1)).sum(axis=1) / weights.sum(axis=1)
        rebuilt[part] = share * open_horizon(exponent, ways[:, 2])
    return rebuilt


def _parts(side: int, exponent: float) -> int:
    """Into how many pieces a side each cell is cut, so that none is wide against the lobe: RO is then off by 0.008 at
    most where bits are drawn at random, and by a few times less where they hang together."""
    return min(max(3, ceil(_PARTS * sqrt(2.0 * pi * (exponent + 1.0)) / side)), _MOST_PARTS)


def _above(ways: Doubles) -> Doubles:
    """Unit directions, those below the horizon moved up onto it; straight down goes to the tangent."""
    if (ways[:, 2] >= 0.0).all():
        return ways
    level = np.where(ways[:, 2:] < 0.0, ways * (1.0, 1.0, 0.0), ways)
    length = length_of(level)[:, None]
    above: Doubles = np.where(length > 0.0, level / np.maximum(length, 1e-300), (1.0, 0.0, 0.0))
    return above


def _lobe(pieces: Floats, ways: Doubles, exponent: float) -> Doubles:
    """(N, side²): the lobe about each R, summed over the pieces of each cell, as a share of its greatest value."""
    cosines = np.maximum(product(ways.astype(np.float32), pieces.reshape(-1, 3).T), np.float32(1e-30))
    # As a share of the greatest: a narrow lobe may pass between the pieces, and leave nothing but zeros.
    shares = cosines / cosines.max(axis=1, keepdims=True)
    lobe = powers(shares, exponent).reshape(len(ways), len(pieces), -1)
    sums: Doubles = lobe.sum(axis=2, dtype=np.float64)
    return sums
