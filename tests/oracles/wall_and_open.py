"""What is studied: two points where occlusion is known exactly, the maps there, and the ways to choose directions.

One point is beside a wall without end, the other in the open. Both are the origin of a floor with its normal along +z.
A reflected direction R leans from the normal towards +x, where the wall stands.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np

from ...core.base.arrays import Doubles
from ...core.rays.map_spec import Axis, MapSpec, Sampler
from ...core.scene.scene import Camera, Instance, Mesh
from ...core.spherical.hemisphere_cells import gauss

DISTANCE, HEIGHT = 1.0, 8.0  # of the wall: its edge is 7.1 degrees off the vertical
LENGTH = 1e4  # to either side; what is missing beyond is of the order of (DISTANCE / LENGTH)^3
EDGE = {"wall": math.atan2(DISTANCE, HEIGHT), "open": math.pi / 2}  # from the vertical down to what blocks at +x
TILT = {"wall": 10.0, "open": 80.0}  # degrees of R towards +x, where it is not the normal
EXPONENTS = (10.0, 100.0)
SAMPLERS = {"uniform sphere": Sampler.UNIFORM_SPHERE, "uniform hemisphere": Sampler.UNIFORM_HEMISPHERE}
SOLID_ANGLE = {Sampler.UNIFORM_SPHERE: 4 * math.pi, Sampler.UNIFORM_HEMISPHERE: 2 * math.pi}


@dataclass(frozen=True)
class Case:
    """A map at a point, estimated in one way. exponent 1 about the normal is AO. tilt: degrees from the normal to R."""

    point: str
    exponent: float
    tilt: float
    sampler: Sampler

    @property
    def map(self) -> str:
        """AO, RO 10, RO 100."""
        return "AO" if self.exponent == 1.0 else f"RO {self.exponent:g}"

    @property
    def name(self) -> str:
        """What the estimator is called."""
        lobe = "cosine" if self.map == "AO" else "lobe"
        return next((name for name, sampler in SAMPLERS.items() if sampler is self.sampler), lobe)

    @property
    def exact(self) -> float:
        """The answer."""
        return lobe_seen(self.exponent, self.tilt, EDGE[self.point])

    @property
    def sigma(self) -> float:
        """Standard deviation of the estimate from one ray.

        A lobe ray is 0 or 1: p(1 - p). Else the estimate is V f Ω, and f², the lobe's square, is (e+1)²/(2π(2e+1))
        times the lobe of twice the exponent, for which the answer is known too.
        """
        mean = self.exact
        if self.sampler is Sampler.LOBE:
            return math.sqrt(max(mean * (1.0 - mean), 0.0))
        e = self.exponent
        squared = SOLID_ANGLE[self.sampler] * (e + 1) ** 2 / (2 * math.pi * (2 * e + 1))
        return math.sqrt(squared * lobe_seen(2 * e, self.tilt, EDGE[self.point]) - mean**2)

    @property
    def estimator(self) -> MapSpec:
        """The same for the bake's kernel, R being the direction mirrored from `camera`."""
        axis = Axis.REFLECTED if self.tilt else Axis.NORMAL
        return MapSpec(f"{self.map} {self.tilt:g} {self.name}", self.exponent, axis, self.sampler)


def cases(point: str) -> list[Case]:
    """All that is studied at a point, AO first."""
    ao = [Case(point, 1.0, 0.0, sampler) for sampler in (*SAMPLERS.values(), Sampler.LOBE)]
    return ao + [
        Case(point, exponent, tilt, sampler)
        for tilt in (0.0, TILT[point])
        for exponent in EXPONENTS
        for sampler in (Sampler.UNIFORM_SPHERE, Sampler.LOBE)
    ]


@cache
def lobe_seen(exponent: float, tilt: float, edge: float) -> float:
    """The share of a lobe that meets nothing, where all that blocks is without end along y.

    Of directions by their angle φ from R in the xz plane, the lobe holds cosᵉφ, as its part along y can be split off:
    ∫ cosᵉ over the φ from the horizon at -x to the edge at +x, divided by the same over ±π/2. tilt: degrees; edge:
    radians from the normal.
    """
    lean = math.radians(tilt)
    seen = (max(-math.pi / 2 - lean, -math.pi / 2), min(edge - lean, math.pi / 2))
    return _power_of_cosine(exponent, *seen) / _power_of_cosine(exponent, -math.pi / 2, math.pi / 2)


def _power_of_cosine(exponent: float, low: float, high: float) -> float:
    """∫ cosᵉ from low to high, by Gauss's rule."""
    nodes, weights = gauss(200)
    return float((high - low) * (weights @ np.cos(low + (high - low) * nodes) ** exponent))


def reflected(tilt: float) -> Doubles:
    """R, (3,)."""
    return np.array([math.sin(math.radians(tilt)), 0.0, math.cos(math.radians(tilt))])


def camera(point: str) -> Camera:
    """The view whose mirrored direction is R leaning by the point's TILT."""
    x, y, z = reflected(TILT[point])
    return Camera((0.0, 0.0, 0.0), (float(x), float(y), float(-z)), orthographic=True)


def blockers(point: str) -> list[Instance]:
    """What stands around the point: a wall or nothing."""
    if point == "open":
        return []
    corners = [(DISTANCE, -LENGTH, 0), (DISTANCE, LENGTH, 0), (DISTANCE, LENGTH, HEIGHT), (DISTANCE, -LENGTH, HEIGHT)]
    triangles = np.array([(0, 1, 2), (0, 2, 3)], dtype=np.int32)
    return [Instance("wall", Mesh("wall", np.array(corners, dtype=np.float32), triangles), np.eye(4))]
