"""Blocks of texels that get rays together."""

from __future__ import annotations

import numpy as np

from ..base.arrays import Doubles, Flags, Floats, Longs

BLOCK = 4  # texels along a side: a packet's sixteen

# A block's texels in the order of a packet's lanes, that of Morton: two by two, and those again.
_X, _Y = (np.array([(lane >> shift & 1) + (lane >> shift + 1 & 2) for lane in range(BLOCK**2)]) for shift in (0, 1))


def block_sums(image: Floats) -> Doubles:
    """(H, W) → sums over blocks, float64; the last ones may be cut short by the image's edge."""
    height, width = image.shape
    whole = height % BLOCK == width % BLOCK == 0
    padded = image if whole else np.pad(image, ((0, -height % BLOCK), (0, -width % BLOCK)))
    blocks = padded.reshape(padded.shape[0] // BLOCK, BLOCK, padded.shape[1] // BLOCK, BLOCK)
    sums: Doubles = np.einsum("iajb->ij", blocks, dtype=np.float64, casting="safe")
    return sums


def texels_of(blocks: Flags, covered: Flags) -> Longs:
    """The covered texels of the marked blocks, y · W + x, block by block."""
    height, width = covered.shape
    rows, columns = np.nonzero(blocks)
    y, x = (BLOCK * each[:, np.newaxis] + offset for each, offset in ((rows, _Y), (columns, _X)))
    texels = y * width + x
    if height % BLOCK or width % BLOCK:
        texels = texels[(y < height) & (x < width)]
    texels = texels.reshape(-1)
    found: Longs = texels[covered.reshape(-1)[texels]]
    return found


def grown(blocks: Flags) -> Flags:
    """The marked blocks and those beside them."""
    padded = np.pad(blocks, 1)
    height, width = blocks.shape
    beside: Flags = np.logical_or.reduce([padded[y : y + height, x : x + width] for y in range(3) for x in range(3)])
    return beside


def largest(sums: Doubles, rest: float) -> Flags:
    """The fewest of the blocks without which the sum is no more than the rest."""
    order = np.argsort(sums, axis=None)
    count = int(np.searchsorted(np.cumsum(sums.reshape(-1)[order]), rest, side="right"))
    marked = np.zeros(sums.size, dtype=np.bool_)
    marked[order[count:]] = True
    return marked.reshape(sums.shape)
