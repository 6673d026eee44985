"""RO as engines make it of what they have of a texel: AO and, at best, a bent normal.

Each takes AO, (N, 1), bent normals of unit length, (N, 3), both in the texels' frames, V views, (V, 3), and an
exponent, and gives (N, V).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from ...core.base.arrays import Doubles
from ...core.spherical.hemisphere_cells import HEMISPHERE
from ...core.spherical.lobe import open_horizon

Formula = Callable[[Doubles, Doubles, Doubles, float], Doubles]


def ao_as_it_is(ao: Doubles, bent: Doubles, looked: Doubles, exponent: float) -> Doubles:
    """AO in the place of RO."""
    return np.repeat(ao, len(looked), axis=1)


def ao_over_horizon(ao: Doubles, bent: Doubles, looked: Doubles, exponent: float) -> Doubles:
    """AO times what an open surface gets."""
    return ao * open_horizon(exponent, looked[:, 2])


def lagarde(ao: Doubles, bent: Doubles, looked: Doubles, exponent: float) -> Doubles:
    """Lagarde & de Rousiers, Moving Frostbite to Physically Based Rendering (2014): of AO, n·v and roughness."""
    power = np.exp2(-16.0 * roughness(exponent) - 1.0)
    ro: Doubles = np.clip((looked[:, 2] + ao) ** power - 1.0 + ao, 0.0, 1.0)
    return ro


def cones(ao: Doubles, bent: Doubles, looked: Doubles, exponent: float) -> Doubles:
    """Jimenez et al., Practical Realtime Strategies for Accurate Indirect Occlusion (2016): the share of the lobe's
    cone within the cone of visibility, cos² of whose half angle is 1 − AO, by the intersection of Oat & Sander
    (Ambient Aperture Lighting, 2007)."""
    visible = np.arccos(np.sqrt(np.clip(1.0 - ao, 0.0, 1.0)))
    lobe = np.arccos(10.0 ** -(roughness(exponent) ** 2))
    apart = np.arccos(np.clip(bent @ looked.T, -1.0, 1.0))
    differ = np.abs(visible - lobe)
    beyond = np.clip((apart - differ) / np.maximum(visible + lobe - differ, 1e-9), 0.0, 1.0)
    within = 1.0 - beyond**2 * (3.0 - 2.0 * beyond)  # smoothstep
    cap = HEMISPHERE * (1.0 - np.cos(np.minimum(visible, lobe)))
    ro: Doubles = cap * within / (HEMISPHERE * (1.0 - np.cos(lobe)))
    return ro


def roughness(exponent: float) -> float:
    """The width α of a Beckmann or GGX lobe that is as wide as Phong's."""
    return float(np.sqrt(2.0 / (exponent + 2.0)))


FORMULAS: Mapping[str, Formula] = {
    "AO as it is": ao_as_it_is,
    "AO times the open horizon": ao_over_horizon,
    "AO by Lagarde's formula": lagarde,
    "AO and bent normal, cones (Jimenez et al.)": cones,
}
