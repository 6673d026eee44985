"""Textures as materials lay them over surfaces: texels, what lies between them, and what lies beyond the edges."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from ..base.arrays import Doubles, Floats, Longs


class Wrap(IntEnum):
    """What lies beyond a texture's edges, as Blender's image nodes name it."""

    REPEAT = 0
    EXTEND = 1  # the texels of the edge
    CLIP = 2  # nothing: clear
    MIRROR = 3


@dataclass(frozen=True, eq=False)
class ImageTexture:
    """values: (h, w) or (h, w, C) float32, row 0 at the top; (1, 1) for a constant. linear: interpolated between the
    texels' middles, else the nearest texel's."""

    values: Floats
    linear: bool = True
    wrap: Wrap = Wrap.REPEAT


def sampled(texture: ImageTexture, uv: Doubles) -> Floats:
    """(N,) or (N, C) float32: a texture's values at (N, 2) places, v up. Texel i lies between i / w and (i + 1) / w, as
    in Cycles (kernel/device/cpu/image.h)."""
    height, width = texture.values.shape[:2]
    column, row = (uv * (width, height)).T
    if not texture.linear:
        return _texels(texture, np.floor(column), np.floor(row))
    column, row = column - 0.5, row - 0.5
    left, below = np.floor(column), np.floor(row)
    shape = (-1,) + (1,) * (texture.values.ndim - 2)
    x, y = (column - left).reshape(shape), (row - below).reshape(shape)
    low = _texels(texture, left, below) * (1.0 - x) + _texels(texture, left + 1.0, below) * x
    high = _texels(texture, left, below + 1.0) * (1.0 - x) + _texels(texture, left + 1.0, below + 1.0) * x
    values: Floats = (low * (1.0 - y) + high * y).astype(np.float32)
    return values


def _texels(texture: ImageTexture, column: Doubles, row: Doubles) -> Floats:
    """Texels by column, and by row from below: whole numbers of any size."""
    height, width = texture.values.shape[:2]
    x, y = _within(column, width, texture.wrap), _within(row, height, texture.wrap)
    values: Floats = texture.values[height - 1 - y, x]
    if texture.wrap == Wrap.CLIP:
        values[(x != column) | (y != row)] = 0.0
    return values


def _within(index: Doubles, size: int, wrap: Wrap) -> Longs:
    """(N,) int64: the texel from 0 to size that stands at each place of a row."""
    if wrap == Wrap.REPEAT:
        inside = np.mod(index, size)
    elif wrap == Wrap.MIRROR:
        inside = np.mod(index, 2 * size)
        inside = np.minimum(inside, 2 * size - 1 - inside)
    else:
        inside = np.clip(index, 0, size - 1)
    return inside.astype(np.int64)
