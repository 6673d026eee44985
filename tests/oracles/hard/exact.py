"""The closed forms of formulas.py for all texels at once."""

from __future__ import annotations

from functools import partial
from math import pi

import numpy as np

from ....core.base.arrays import Doubles
from .. import formulas


def ball_above_floor(points: Doubles, centre: tuple[float, float, float], radius: float) -> Doubles:
    """Floor points under a ball that stays above the floor."""
    to = np.asarray(centre) - points
    distance = np.linalg.norm(to, axis=-1)
    visible: Doubles = np.vectorize(partial(formulas.sphere_above, radius))(distance, np.arccos(to[..., 2] / distance))
    return visible


def ball_half_sunk(points: Doubles, radius: float) -> Doubles:
    """Floor points about a ball whose centre lies in the floor; 0 inside."""
    distance = np.linalg.norm(points[..., :2], axis=-1)
    outside = np.vectorize(partial(formulas.sphere_cut, radius, theta=0.5 * pi))(np.maximum(distance, radius))
    return np.where(distance > radius, outside, 0.0)


def rectangle_above(points: Doubles, low: tuple[float, float], high: tuple[float, float], height: float) -> Doubles:
    """Floor points under a rectangle parallel to the floor: the sum of the four with a corner above the point."""
    visible = np.vectorize(partial(formulas.parallel_rectangle, height=height))
    blocked = np.zeros(points.shape[:-1])
    for x, sign_x in ((high[0], 1.0), (low[0], -1.0)):
        for y, sign_y in ((high[1], 1.0), (low[1], -1.0)):
            blocked += sign_x * sign_y * (1.0 - visible(x - points[..., 0], y - points[..., 1]))
    return 1.0 - blocked


def endless_wall(distance: Doubles, height: float) -> Doubles:
    """Floor points before a wall without ends."""
    visible: Doubles = np.vectorize(partial(formulas.long_wall, height=height))(distance)
    return visible
