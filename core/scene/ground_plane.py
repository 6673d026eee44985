"""A ground for things to stand on, where the scene has none."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..base.vectors import length_of
from .parts import parts_of
from .scene import Instance, Mesh
from .world_mesh import boxes_of

NAME = "Occlusion Bake Ground"
_GAP = 1e-4  # of the diagonal of what stands on it: faces that lie on the ground see it, and are dark
_EXTENT = 1e3  # diagonals of the scene to each side, at least: what passes under its rim is below 1e-6 of all light
_STEP = 0.125  # of its size: the raster of its middle
_WIDEST = 1e11  # units to each side: it can be traced


def ground_below(standing: Sequence[Instance]) -> Instance:
    """A level square a hair below the lowest point of a scene, about it, as wide as to be without end. Its width and
    middle are rounded, so that it stays where it is when something of the scene moves a little.

    standing: all meshes that block light there, whichever are baked; those without faces do not count. The hair is a
    share of the size of the one that stands lowest, but for what strays from it.
    """
    boxes = boxes_of(standing)
    there = np.isfinite(boxes).all(axis=(1, 2))
    low, high = boxes[there, 0].min(axis=0), boxes[there, 1].max(axis=0)
    lowest = standing[int(np.flatnonzero(there)[np.argmin(boxes[there, 0, 2])])]
    gap = _GAP * 2.0 * parts_of(lowest)[0].radius
    size = math.ldexp(1.0, math.frexp(float(length_of(high - low)))[1])  # the next power of two
    x, y = _STEP * size * np.rint(0.5 * (low + high)[:2] / (_STEP * size))
    corners = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], dtype=np.float32)
    matrix = np.diag([min(_EXTENT * size, _WIDEST)] * 2 + [1.0, 1.0])
    matrix[:3, 3] = x, y, low[2] - gap
    return Instance(NAME, Mesh(NAME, corners, np.array([(0, 1, 2), (0, 2, 3)], dtype=np.int32)), matrix, NAME)
