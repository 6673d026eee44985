"""Directions and weights that integrate over a lobe of any exponent, clipped at the horizon, to rounding.

The lobe is (e+1)/(2π) max(R·ω, 0)^e. About R it is cut into circles of the angle α off it. Those with α up to 90° less
the angle of R lie above the horizon whole, of the others the arc |β| ≤ β₀, cos β₀ = −cot α cot θ, β from the upward
direction and θ the angle between R and the normal. In the square root of how far α lies beyond the first of these β₀ is
smooth, so that Gauss-Legendre converges as for any smooth function.
"""

from __future__ import annotations

import math

import numpy as np

from ..base.arrays import Doubles
from ..base.elementary import arccos, arcsin, cos, exp, log1p, sin
from ..base.errors import InputError
from .hemisphere_cells import gauss

_RINGS, _ARC = 32, 12  # nodes along α, of each of both kinds of circle, and along β
_FAR = 9.0  # nothing lies beyond so many times 1/√(e + 1): e^-40


def check_exponent(exponent: float) -> float:
    """The exponent of a lobe. Raises InputError for one below 0 or not finite."""
    if not math.isfinite(exponent) or exponent < 0.0:
        raise InputError(f"RO exponent {exponent:g}: give a finite number of 0 or more")
    return float(exponent)


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
    along, off = cos(alpha)[..., None], sin(alpha)[..., None]
    upward = off * cos(beta)
    ways = np.stack([along * sine - upward * cosine, off * sin(beta), along * cosine + upward * sine], axis=-1)
    count = len(cosines)
    return ways.reshape(count, -1, 3), weights.reshape(count, -1)


def _rings(exponent: float, cosines: Doubles) -> tuple[Doubles, Doubles]:
    """α of the circles, (C, 2 · _RINGS), and the lobe's weight on each, as if they were whole."""
    nodes, shares = gauss(_RINGS)
    last = min(0.5 * np.pi, _FAR / np.sqrt(exponent + 1.0))
    whole = np.minimum(arcsin(np.clip(cosines, 0.0, 1.0)), last)[:, None]
    cut = last - whole
    alpha = np.concatenate([whole * nodes, whole + cut * nodes**2], axis=1)
    steps = np.concatenate([whole * shares, cut * 2.0 * nodes * shares], axis=1)
    power = exp(exponent * log1p(-2.0 * sin(0.5 * alpha) ** 2)) if exponent else np.ones_like(alpha)  # at 90° exp(-∞)
    return alpha, (exponent + 1.0) * power * sin(alpha) * steps


def _arcs(alpha: Doubles, cosines: Doubles) -> Doubles:
    """β₀ of each circle: how far it goes to either side before it meets the horizon, π where it does not."""
    theta = arccos(np.clip(cosines, 0.0, 1.0))[:, None]
    below = cos(alpha) * cos(theta)
    level = sin(alpha) * sin(theta)
    reach: Doubles = np.where(below >= level, np.pi, arccos(-below / np.maximum(level, below)))
    return reach


_STEPS = 1 << 13  # the table is linear between them: 6e-8 off at most
_POWER_ENDS = 12.0  # of cos(x)^e as good as nothing lies beyond so many times 1/√e: e^-72


def open_horizon(exponent: float, cosines: Doubles) -> Doubles:
    """H_e(α) = 1 − ∫₀^α sinᵉ / ∫₀^π sinᵉ for each cos α: the share above the horizon of a lobe of exponent e ≥ 0.

    cosines: any shape, 0 to 1; below 0 they are taken for 0, the horizon, where half of the lobe is left. Interpolated
    in a table: to 1e-6, and to 1e-5 for exponents below 0.5. With φ = π/2 − α it is ½ + ½ ∫₀^φ cosᵉ / ∫₀^{π/2} cosᵉ.
    """
    elevations = np.linspace(0.0, min(0.5 * np.pi, _POWER_ENDS / np.sqrt(max(exponent, 1.0))), _STEPS + 1)
    middles = 0.5 * (elevations[1:] + elevations[:-1])
    lobe, between = _cosine_power(elevations, exponent), _cosine_power(middles, exponent)
    pieces = lobe[:-1] + 4.0 * between + lobe[1:]  # Simpson's rule; the width cancels
    integral = np.concatenate([[0.0], np.cumsum(pieces)])
    openness: Doubles = 0.5 + 0.5 * np.interp(arcsin(np.clip(cosines, 0.0, 1.0)), elevations, integral / integral[-1])
    return openness


def _cosine_power(angles: Doubles, exponent: float) -> Doubles:
    """cosᵉ, by log cos x = log1p(−2 sin²(x/2)): the cosine of a small angle would lose what a large exponent needs."""
    with np.errstate(invalid="ignore"):
        power: Doubles = exp(exponent * log1p(-2.0 * sin(0.5 * angles) ** 2))
    return np.where(angles >= 0.5 * np.pi, float(exponent == 0.0), power)
