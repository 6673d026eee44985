"""What is estimated, and by which rays: AO, RO of any exponent, and the naive estimators of the study.

Every map is ∫ V(ω) (e+1)/(2π) max(a·ω, 0)^e dω over the hemisphere of the shading normal n: a lobe of exponent e about
an axis a. With a = n and e = 1 it is AO; with a = R, the reflected direction, RO. An estimator draws N directions from
a density p and takes the mean of V times the integrand over p.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import IntEnum

from ..base.errors import InputError
from .accumulators import Counts


class Sampler(IntEnum):
    """Densities by name; the values are the kernel's."""

    LOBE = 0  # the integrand's own: every weight is 1. For AO this is the cosine
    UNIFORM_HEMISPHERE = 1  # 1/(2π) about the normal
    UNIFORM_SPHERE = 2  # 1/(4π)


class Falloff(IntEnum):
    """How much an occluder blocks at a share s of the distance; the values are the kernel's."""

    NONE = 0  # all
    LINEAR = 1  # 1 - s
    SMOOTH = 2  # 1 - s² (3 - 2 s)


class Axis(IntEnum):
    """Where the lobe points."""

    NORMAL = 0
    REFLECTED = 1


@dataclass(frozen=True)
class Estimator:
    """One map to bake. `name` is what files and reports call it: ao, ro_10, … lobe_share: of a map of light, the rays
    that are drawn from the lobe; the others are drawn from the light (0 to 1)."""

    name: str
    exponent: float
    axis: Axis = Axis.NORMAL
    sampler: Sampler = Sampler.LOBE
    counts: Counts = Counts.VISIBILITY
    lobe_share: float = 0.5

    @property
    def is_light(self) -> bool:
        """Whether it needs the scene's environment."""
        return self.counts is Counts.LIGHT


AO = Estimator("ao", 1.0)
_NAMES = {
    "importance": Sampler.LOBE,
    "uniform_hemisphere": Sampler.UNIFORM_HEMISPHERE,
    "uniform_sphere": Sampler.UNIFORM_SPHERE,
}


def reflection(exponent: float, *, from_camera: bool = False) -> Estimator:
    """RO of one exponent. Raises InputError for an exponent below 0 or not finite."""
    if not math.isfinite(exponent) or exponent < 0.0:
        raise InputError(f"RO exponent {exponent:g}: give a finite number of 0 or more")
    return Estimator(f"ro_{exponent:g}", float(exponent), Axis.REFLECTED if from_camera else Axis.NORMAL)


def light(exponent: float | None = None, *, from_camera: bool = False) -> Estimator:
    """The share of the environment's light that gets through, of each colour: diffuse, or by the lobe of an exponent.

    Raises InputError as `reflection`.
    """
    if exponent is None:
        return Estimator("light", 1.0, counts=Counts.LIGHT)
    return replace(reflection(exponent, from_camera=from_camera), name=f"light_{exponent:g}", counts=Counts.LIGHT)


def sampled(estimator: Estimator, sampler: str) -> Estimator:
    """The same map by another sampler: importance, uniform_hemisphere or uniform_sphere.

    Raises InputError for an unknown name, and for the hemisphere where the lobe is about the reflected direction.
    """
    if sampler not in _NAMES:
        raise InputError(f"sampler {sampler!r}: choose one of {', '.join(_NAMES)}")
    if _NAMES[sampler] is Sampler.UNIFORM_HEMISPHERE and estimator.axis is Axis.REFLECTED:
        raise InputError(
            "uniform_hemisphere is about the normal; with R from the camera use importance or uniform_sphere"
        )
    return replace(estimator, sampler=_NAMES[sampler])


def open_horizon(exponent: float, angle: float) -> float:
    """RO of an open plane: H_e(α) = 1 − ∫₀^α sinᵉ / ∫₀^π sinᵉ, α the angle between R and the normal, in radians.

    It is 1 at α = 0 and falls as R leans towards the horizon and part of the lobe goes below it.
    """
    steps = 4096
    reach = min(0.5 * math.pi, 9.0 / math.sqrt(exponent + 1.0))  # beyond it sinᵉ is below e⁻⁴⁰: narrow lobes need steps
    start = 0.5 * math.pi - reach

    def integral(end: float) -> float:  # Simpson's rule; the integrand is smooth and bounded
        width = (end - start) / steps
        ordinates: list[float] = [math.sin(start + width * i) ** exponent for i in range(steps + 1)]
        return (
            width / 3.0 * (ordinates[0] + ordinates[-1] + 4.0 * sum(ordinates[1:-1:2]) + 2.0 * sum(ordinates[2:-1:2]))
        )

    end = min(max(angle, start), start + 2.0 * reach)
    return float(1.0 - integral(end) / integral(start + 2.0 * reach))
