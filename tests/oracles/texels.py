"""Texels and their triangles, by float64 geometry."""

from __future__ import annotations

import numpy as np

from ...core.base.arrays import Doubles, Flags, Floats, Ints


def whole_texels(uv: Floats, owner: Ints) -> Flags:
    """(H, W): texels that lie in their triangle with all four corners. uv: (T, 3, 2); owner: (H, W), row 0 the top."""
    height, width = owner.shape
    y, x = np.nonzero(owner >= 0)
    corners = uv[owner[y, x]].astype(np.float64) * (width, -height) + (0, height)
    inside = np.ones(len(x), dtype=np.bool_)
    for dx, dy in ((0, 0), (1, 0), (0, 1), (1, 1)):
        place = np.column_stack([x + dx, y + dy]).astype(np.float64)
        turns = np.array([_turn(corners[:, i], corners[:, (i + 1) % 3], place) for i in range(3)])
        inside &= (turns >= 0).all(axis=0) | (turns <= 0).all(axis=0)
    mask = np.zeros((height, width), dtype=np.bool_)
    mask[y, x] = inside
    return mask


def _turn(a: Doubles, b: Doubles, c: Doubles) -> Doubles:
    """Above 0 where a, b, c turn one way, below where the other."""
    along, to = b - a, c - a
    turn: Doubles = along[:, 0] * to[:, 1] - along[:, 1] * to[:, 0]
    return turn
