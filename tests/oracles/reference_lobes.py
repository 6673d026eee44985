"""The formulas of the bake written a second time, in float64 numpy, to test the kernel by: lobes, densities, BRDFs.

Nothing here is shared with the kernel. Directions are unit vectors in the last axis of an array; angles are radians.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial.legendre import leggauss
from numpy.typing import ArrayLike

from ...core.base.arrays import Doubles

NODES = 64


def lobe(cosine: ArrayLike, exponent: float) -> Doubles:
    """(e+1)/(2π) max(cos, 0)^e by the cosine to the lobe's axis; e = 1 is cos/π. 1 over the sphere."""
    positive = np.maximum(np.asarray(cosine, dtype=np.float64), 0.0)
    value: Doubles = np.where(np.asarray(cosine) > 0.0, (exponent + 1.0) / (2.0 * np.pi) * positive**exponent, 0.0)
    return value


def mirrored(direction: Doubles, normal: Doubles) -> Doubles:
    """The direction on the other side of the normal: 2 (n·ω) n − ω. Both point away from the surface."""
    turned: Doubles = 2.0 * np.sum(direction * normal, axis=-1, keepdims=True) * normal - direction
    return turned


def lambert_brdf(incoming: Doubles, outgoing: Doubles) -> Doubles:
    """1/π whatever the directions."""
    return np.full(np.broadcast_shapes(incoming.shape, outgoing.shape)[:-1], 1.0 / np.pi)


def phong_brdf(incoming: Doubles, outgoing: Doubles, normal: Doubles, exponent: float) -> Doubles:
    """(e+1)/(2π) max(R(ωᵢ)·ωₒ, 0)^e, as RO has it: its integral over ωₒ is taken without a cosine."""
    return lobe(np.sum(mirrored(incoming, normal) * outgoing, axis=-1), exponent)


def lobe_beyond(polar: ArrayLike, exponent: float) -> Doubles:
    """The share of a lobe farther than `polar` from its axis: cos^(e+1)."""
    share: Doubles = np.maximum(np.cos(np.asarray(polar, dtype=np.float64)), 0.0) ** (exponent + 1.0)
    return share


def sphere_beyond(polar: ArrayLike) -> Doubles:
    """The share of all directions farther than `polar` from an axis."""
    share: Doubles = 0.5 * (1.0 + np.cos(np.asarray(polar, dtype=np.float64)))
    return share


def over_lobe(exponent: float, breaks: ArrayLike = (), nodes: int = NODES) -> tuple[Doubles, Doubles]:
    """Polar angles and weights: Gauss-Legendre for integrals of f(θ) times a lobe about its axis.

    The variable is the lobe's own cumulative share, so that narrow lobes need no more nodes than wide ones. breaks:
    angles where f has a kink or a square root; each piece is drawn out at its ends (t = sin²), which smooths roots.
    """
    ends = np.unique(np.concatenate([[0.0, 1.0], lobe_beyond(np.asarray(breaks, dtype=np.float64), exponent)]))
    node, weight = leggauss(nodes)  # type: ignore[no-untyped-call] # of numpy
    stage = 0.25 * np.pi * (node + 1.0)
    inner = np.sin(stage) ** 2
    slope = 0.25 * np.pi * np.sin(2.0 * stage) * weight
    share = (ends[:-1, None] + np.diff(ends)[:, None] * inner).ravel()
    weights = (np.diff(ends)[:, None] * slope).ravel()
    with np.errstate(divide="ignore"):
        versine = -np.expm1(np.log(share) / (exponent + 1.0))  # 1 - cos, without cancellation
    return 2.0 * np.arcsin(np.sqrt(0.5 * np.clip(versine, 0.0, 1.0))), weights


def above_horizon(polar: Doubles, lean: float) -> Doubles:
    """The share of a circle at `polar` about an axis that lies above the horizon of a normal `lean` from the axis."""
    upward, swing = np.cos(polar) * np.cos(lean), np.sin(polar) * np.sin(lean)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(swing > 0.0, -upward / swing, np.where(upward > 0.0, -np.inf, np.inf))
    share: Doubles = np.arccos(np.clip(ratio, -1.0, 1.0)) / np.pi
    return share


def cosine_above_horizon(polar: Doubles, lean: float) -> Doubles:
    """The mean over such a circle of max(n·ω, 0)."""
    end = np.pi * above_horizon(polar, lean)
    mean: Doubles = (np.cos(polar) * np.cos(lean) * end + np.sin(polar) * np.sin(lean) * np.sin(end)) / np.pi
    return mean


def lobe_above_horizon(exponent: float, lean: float) -> float:
    """The share of a lobe above the horizon of a normal that is `lean` from the lobe's axis, by quadrature."""
    polar, weight = over_lobe(exponent, [abs(0.5 * np.pi - lean)])
    return float(np.sum(weight * above_horizon(polar, lean)))
