"""Blocks of texels that get rays together."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..base.arrays import Doubles, Flags, Floats, Longs
from ..rays.tracer import BLOCK

_LISTED = 1 << 18  # blocks of one list: some 100 MB on the way

# A block's texels in the order of a packet's lanes, that of Morton: two by two, and those again.
_X, _Y = (np.array([(lane >> shift & 1) + (lane >> shift + 1 & 2) for lane in range(BLOCK**2)]) for shift in (0, 1))


def block_sums(image: Floats | Flags) -> Doubles:
    """(H, W) → sums over blocks; the last ones may be cut short by the image's edge."""
    height, width = image.shape
    whole = height % BLOCK == width % BLOCK == 0
    padded = image if whole else np.pad(image, ((0, -height % BLOCK), (0, -width % BLOCK)))
    # Sums of four need no more digits than the image has; and numpy is slow where it sums few numbers many times.
    kind = np.uint8 if padded.dtype == np.bool_ else padded.dtype
    columns = padded.reshape(-1, BLOCK, padded.shape[1]).sum(axis=1, dtype=kind)
    sums: Doubles = columns[:, ::BLOCK].astype(np.float64)
    for column in range(1, BLOCK):
        sums += columns[:, column::BLOCK]
    return sums


def texels_of(blocks: Flags, covered: Flags) -> Longs:
    """The covered texels of the marked blocks, y · W + x, block by block."""
    texels, there = texels_in(np.flatnonzero(blocks), covered)
    return texels[there]


def lists_of(blocks: Flags) -> Iterator[Longs]:
    """The numbers of the marked blocks, row by row, in lists of a bounded length."""
    marked = np.flatnonzero(blocks)
    for first in range(0, len(marked), _LISTED):
        yield marked[first : first + _LISTED]


def block_of(texels: Longs, shape: tuple[int, ...]) -> Longs:
    """The numbers of the blocks that texels, y · W + x, of an image of this shape are of."""
    width = shape[1]
    rows, columns = np.divmod(texels, width)
    found: Longs = rows // BLOCK * -(-width // BLOCK) + columns // BLOCK
    return found


def texels_in(listed: Longs, covered: Flags) -> tuple[Longs, Flags]:
    """(N, 16) int64: the texels of N blocks, by their numbers; and (N, 16) bool: whether each is covered."""
    texels, inside = all_texels_of(listed, covered.shape)
    there: Flags = covered.reshape(-1)[np.where(inside, texels, 0)] & inside
    return texels, there


def all_texels_of(listed: Longs, shape: tuple[int, ...]) -> tuple[Longs, Flags]:
    """(N, 16) int64: the texels of N blocks, y · W + x; and whether each lies in an image of this shape."""
    height, width = shape
    rows, columns = np.divmod(listed, -(-width // BLOCK))
    texels: Longs = (rows * (BLOCK * width) + columns * BLOCK)[:, np.newaxis] + (_Y * width + _X)
    if height % BLOCK == width % BLOCK == 0:
        return texels, np.broadcast_to(np.True_, texels.shape)
    inside = (BLOCK * rows[:, np.newaxis] + _Y < height) & (BLOCK * columns[:, np.newaxis] + _X < width)
    return texels, inside


def grown(blocks: Flags) -> Flags:
    """The marked blocks and those beside them."""
    padded = np.pad(blocks, 1)
    height, width = blocks.shape
    beside: Flags = np.logical_or.reduce([padded[y : y + height, x : x + width] for y in range(3) for x in range(3)])
    return beside


def largest(sums: Doubles, rest: float) -> Flags:
    """The fewest of the blocks without which the sum is no more than the rest; of equal ones all."""
    ladder = np.sort(sums, axis=None)
    count = int(np.searchsorted(np.cumsum(ladder), rest, side="right"))
    marked: Flags = sums >= ladder[count] if count < len(ladder) else np.zeros(sums.shape, dtype=np.bool_)
    return marked
