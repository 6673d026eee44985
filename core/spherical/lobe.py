"""Directions and weights that integrate over a lobe of any exponent, clipped at the horizon, to rounding.

The lobe is (e+1)/(2π) max(R·ω, 0)^e. About R it is cut into circles of the angle α off it. Those with α up to 90° less
the angle of R lie above the horizon whole, of the others the arc |β| ≤ β₀, cos β₀ = −cot α cot θ, β from the upward
direction and θ the angle between R and the normal. In the square root of how far α lies beyond the first of these β₀ is
smooth, so that Gauss-Legendre converges as for any smooth function.
"""

from __future__ import annotations

import numpy as np

from ..scene.scene import Doubles
from .hemisphere_cells import gauss

_RINGS, _ARC = 32, 12  # nodes along α, of each of both kinds of circle, and along β
_FAR = 9.0  # nothing lies beyond so many times 1/√(e + 1): e^-40


def lobe_nodes(exponent: float, cosines: Doubles) -> tuple[Doubles, Doubles]:
    """Nodes of lobes about R = (sin θ, 0, cos θ): (C, Q, 3) float64 unit directions of y ≥ 0 and (C, Q) weights.

    cosines: (C,), cos θ from 0 to 1. The weights count the mirror images in y, too, and hold the lobe, so that
    ∫_H f L_R dω is Σ weight · f for every f that is even in y. Their sum is the open horizon H_e(θ).
    """
    alpha, ring = _rings(exponent, cosines)
    nodes, shares = gauss(_ARC)
    reach = _arcs(alpha, cosines)[..., None]
    beta = reach * nodes
    weights = ring[..., None] * reach * shares / np.pi  # both halves of the circle
    sine, cosine = (each[:, None, None] for each in (np.sqrt(np.maximum(1.0 - cosines**2, 0.0)), cosines))
    along, off = np.cos(alpha)[..., None], np.sin(alpha)[..., None]
    upward = off * np.cos(beta)
    ways = np.stack([along * sine - upward * cosine, off * np.sin(beta), along * cosine + upward * sine], axis=-1)
    count = len(cosines)
    return ways.reshape(count, -1, 3), weights.reshape(count, -1)


def _rings(exponent: float, cosines: Doubles) -> tuple[Doubles, Doubles]:
    """α of the circles, (C, 2 · _RINGS), and the lobe's weight on each, as if they were whole."""
    nodes, shares = gauss(_RINGS)
    last = min(0.5 * np.pi, _FAR / np.sqrt(exponent + 1.0))
    whole = np.minimum(np.arcsin(np.clip(cosines, 0.0, 1.0)), last)[:, None]
    cut = last - whole
    alpha = np.concatenate([whole * nodes, whole + cut * nodes**2], axis=1)
    steps = np.concatenate([whole * shares, cut * 2.0 * nodes * shares], axis=1)
    with np.errstate(divide="ignore"):  # log 0 at 90° is power 0
        power = np.exp(exponent * np.log1p(-2.0 * np.sin(0.5 * alpha) ** 2)) if exponent else np.ones_like(alpha)
    return alpha, (exponent + 1.0) * power * np.sin(alpha) * steps


def _arcs(alpha: Doubles, cosines: Doubles) -> Doubles:
    """β₀ of each circle: how far it goes to either side before it meets the horizon, π where it does not."""
    theta = np.arccos(np.clip(cosines, 0.0, 1.0))[:, None]
    below = np.cos(alpha) * np.cos(theta)
    level = np.sin(alpha) * np.sin(theta)
    reach: Doubles = np.where(below >= level, np.pi, np.arccos(-below / np.maximum(level, below)))
    return reach
