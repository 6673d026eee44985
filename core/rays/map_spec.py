"""What a map asks of its rays: AO, RO of any exponent, light, and the naive samplers of the study.

Every map is ∫ V(ω) (e+1)/(2π) max(a·ω, 0)^e dω over the hemisphere of the shading normal n: a lobe of exponent e about
an axis a. With a = n and e = 1 it is AO; with a = R, the reflected direction, RO. An estimator draws N directions from
a density p and takes the mean of V times the integrand over p.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from itertools import accumulate, pairwise

from ..base.errors import InputError
from ..spherical.lobe import check_exponent
from .accumulators import Accumulator


class Sampler(IntEnum):
    """Densities by name; the values are the kernel's."""

    LOBE = 0  # the integrand's own: every weight is 1. For AO this is the cosine
    UNIFORM_HEMISPHERE = 1  # 1/(2π) about the normal
    UNIFORM_SPHERE = 2  # 1/(4π)


class Axis(IntEnum):
    """Where the lobe points."""

    NORMAL = 0
    REFLECTED = 1


@dataclass(frozen=True)
class MapSpec:
    """A lobe, how its rays are drawn, and what is summed up of them. name: what lines about it call it: ao, ro_10, …
    lobe_share: of a map of light, the rays that are drawn from the lobe; the others are drawn from the light (0 to 1).
    divided: the map becomes a share of what an open surface would get, for its lobe may lie below the horizon in part.
    """

    name: str
    exponent: float
    axis: Axis = Axis.NORMAL
    sampler: Sampler = Sampler.LOBE
    accumulator: Accumulator = Accumulator.VISIBILITY
    lobe_share: float = 0.5
    divided: bool = False

    @property
    def is_light(self) -> bool:
        """Whether it needs the scene's environment."""
        return self.accumulator is Accumulator.LIGHT

    def serves(self, other: MapSpec) -> bool:
        """Whether its rays give the other's map, too."""
        return self == other or (
            self.accumulator is Accumulator.BENT and self == replace(other, accumulator=Accumulator.BENT)
        )


AO = MapSpec("ao", 1.0)
SAMPLERS = {
    "importance": Sampler.LOBE,
    "uniform_hemisphere": Sampler.UNIFORM_HEMISPHERE,
    "uniform_sphere": Sampler.UNIFORM_SPHERE,
}


def reflection(exponent: float, *, from_camera: bool = False, divided: bool = False) -> MapSpec:
    """RO of one exponent. divided: by the horizon, where R is the camera's; about the normal nothing is below it.

    Raises InputError for an exponent below 0 or not finite.
    """
    axis = Axis.REFLECTED if from_camera else Axis.NORMAL
    return MapSpec(f"ro_{exponent:g}", check_exponent(exponent), axis, divided=divided and from_camera)


def bent() -> MapSpec:
    """AO with the mean open direction."""
    return replace(AO, accumulator=Accumulator.BENT)


def light(exponent: float | None = None, *, from_camera: bool = False) -> MapSpec:
    """The share of the environment's light that gets through, of each colour: diffuse, or by the lobe of an exponent.

    Raises InputError as `reflection`.
    """
    if exponent is None:
        return MapSpec("light", 1.0, accumulator=Accumulator.LIGHT)
    lobe = reflection(exponent, from_camera=from_camera)
    return replace(lobe, name=f"light_{exponent:g}", accumulator=Accumulator.LIGHT)


def sampled(spec: MapSpec, sampler: str) -> MapSpec:
    """The same map by another sampler: importance, uniform_hemisphere or uniform_sphere.

    Raises InputError for an unknown name, and for the hemisphere where the lobe is about the reflected direction.
    """
    if sampler not in SAMPLERS:
        raise InputError(f"sampler {sampler!r}: choose one of {', '.join(SAMPLERS)}")
    if SAMPLERS[sampler] is Sampler.UNIFORM_HEMISPHERE and spec.axis is Axis.REFLECTED:
        raise InputError(
            "uniform_hemisphere is about the normal; with R from the camera use importance or uniform_sphere"
        )
    return replace(spec, sampler=SAMPLERS[sampler])


def merged(specs: Iterable[MapSpec]) -> list[MapSpec]:
    """What is traced for maps that ask for these rays: each but once, and bent normals' serve AO. Those come first, for
    the artist sees the first of all fill in."""
    once = list(dict.fromkeys(specs))
    needed = [each for each in once if not any(other != each and other.serves(each) for other in once)]
    return sorted(needed, key=lambda each: each.accumulator is not Accumulator.BENT)


def count_images(specs: Sequence[MapSpec]) -> int:
    """How many images the sums of these take."""
    return sum(each.accumulator.images for each in specs)


def image_slices(specs: Sequence[MapSpec]) -> list[slice]:
    """Where each one's images stand among those."""
    ends = accumulate((each.accumulator.images for each in specs), initial=0)
    return [slice(first, end) for first, end in pairwise(ends)]
