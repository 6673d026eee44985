"""Exact visibility of points, vectorised over texels. Formulas: the tables of form factors."""

from __future__ import annotations

import numpy as np

from ....core.scene import Doubles


def ball_above_floor(points: Doubles, centre: tuple[float, float, float], radius: float) -> Doubles:
    """Floor points under a ball that stays above the floor: A = 1 - r² h / l³, h its centre's height over the point."""
    to = np.asarray(centre) - points
    answer: Doubles = 1.0 - radius**2 * to[..., 2] / np.linalg.norm(to, axis=-1) ** 3
    return answer


def ball_half_sunk(points: Doubles, radius: float) -> Doubles:
    """Floor points about a ball whose centre lies in the floor: 0 inside; outside, H = distance / radius,
    F = 1/2 - asin(q/H)/π - q/(π H²), q² = H² - 1."""
    ratio = np.maximum(np.linalg.norm(points[..., :2], axis=-1) / radius, 1.0)
    q = np.sqrt(ratio**2 - 1.0)
    blocked = 0.5 - np.arcsin(q / ratio) / np.pi - q / (np.pi * ratio**2)
    return np.where(ratio > 1.0, 1.0 - blocked, 0.0)


def rectangle_above(points: Doubles, low: tuple[float, float], high: tuple[float, float], height: float) -> Doubles:
    """Floor points under a rectangle parallel to the floor: the sum of the four with a corner above the point."""
    blocked = np.zeros(points.shape[:-1])
    for x, sign_x in ((high[0], 1.0), (low[0], -1.0)):
        for y, sign_y in ((high[1], 1.0), (low[1], -1.0)):
            a, b = (x - points[..., 0]) / height, (y - points[..., 1]) / height
            root_a, root_b = np.sqrt(1.0 + a**2), np.sqrt(1.0 + b**2)
            corner = (a / root_a * np.arctan(b / root_a) + b / root_b * np.arctan(a / root_b)) / (2.0 * np.pi)
            blocked += sign_x * sign_y * corner
    return 1.0 - blocked


def endless_wall(distance: Doubles, height: float) -> Doubles:
    """Floor points before a wall without ends: A = 1 - (1 - d/√(d² + h²))/2."""
    answer: Doubles = 0.5 + 0.5 * distance / np.hypot(distance, height)
    return answer
