"""Pictures as materials lay them over surfaces: texels, what lies between them, and what lies beyond the edges."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from .scene import Doubles, Floats


class Wrap(IntEnum):
    """What lies beyond a picture's edges, as Blender's image nodes name it."""

    REPEAT = 0
    EXTEND = 1  # the texels of the edge
    CLIP = 2  # nothing: clear
    MIRROR = 3


@dataclass(frozen=True, eq=False)
class Picture:
    """values: (h, w) or (h, w, C) float32, row 0 at the top; (1, 1) for a constant. linear: interpolated between the
    texels' middles, else the nearest texel's."""

    values: Floats
    linear: bool = True
    wrap: Wrap = Wrap.REPEAT


def sampled(picture: Picture, uv: Doubles) -> Floats:
    """(N,) or (N, C) float32: a picture's values at (N, 2) places, v up. Texel i lies between i / w and (i + 1) / w, as
    in Cycles (kernel/device/cpu/image.h)."""
    height, width = picture.values.shape[:2]
    column, row = (uv * (width, height)).T
    if not picture.linear:
        return _texels(picture, np.floor(column), np.floor(row))
    column, row = column - 0.5, row - 0.5
    left, below = np.floor(column), np.floor(row)
    shape = (-1,) + (1,) * (picture.values.ndim - 2)
    x, y = (column - left).reshape(shape), (row - below).reshape(shape)
    low = _texels(picture, left, below) * (1.0 - x) + _texels(picture, left + 1.0, below) * x
    high = _texels(picture, left, below + 1.0) * (1.0 - x) + _texels(picture, left + 1.0, below + 1.0) * x
    values: Floats = (low * (1.0 - y) + high * y).astype(np.float32)
    return values


def _texels(picture: Picture, column: Doubles, row: Doubles) -> Floats:
    """Texels by column, and by row from below: whole numbers of any size."""
    height, width = picture.values.shape[:2]
    x, y = _within(column, width, picture.wrap), _within(row, height, picture.wrap)
    values: Floats = picture.values[height - 1 - y, x]
    if picture.wrap == Wrap.CLIP:
        values[(x != column) | (y != row)] = 0.0
    return values


def _within(index: Doubles, size: int, wrap: Wrap) -> NDArray[np.int64]:
    """(N,) int64: the texel from 0 to size that stands at each place of a row."""
    if wrap == Wrap.REPEAT:
        inside = np.mod(index, size)
    elif wrap == Wrap.MIRROR:
        inside = np.mod(index, 2 * size)
        inside = np.minimum(inside, 2 * size - 1 - inside)
    else:
        inside = np.clip(index, 0, size - 1)
    return inside.astype(np.int64)
