"""A ground for things to stand on, where the scene has none."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .scene import Instance, Mesh
from .world_mesh import bounds_of

NAME = "Occlusion Bake Ground"
_GAP = 1e-4  # of the diagonal of what stands on it: faces that lie on the ground see it, and are dark
_EXTENT = 1e3  # such diagonals to each side: what light still passes under its rim is below 1e-6 of the whole


def ground_below(targets: Sequence[Instance]) -> Instance:
    """A level square a hair below the lowest point of the targets, about them, as wide as to be without end."""
    boxes = np.array([bounds_of(target) for target in targets])
    low, high = boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)
    diagonal = float(np.linalg.norm(high - low))
    x, y = 0.5 * (low + high)[:2]
    corners = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], dtype=np.float32)
    matrix = np.diag([_EXTENT * diagonal] * 2 + [1.0, 1.0])
    matrix[:3, 3] = x, y, low[2] - _GAP * diagonal
    return Instance(NAME, Mesh(NAME, corners, np.array([(0, 1, 2), (0, 2, 3)], dtype=np.int32)), matrix, NAME)
