"""What counts as an occluder: how far, how near, by which falloff, within which cone, from which side."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum

from ..base.elementary import cos
from ..base.errors import InputError

LEAST_SPREAD, WHOLE_SPREAD = 1.0, 180.0  # degrees; narrower cones are rays


class Falloff(IntEnum):
    """How much an occluder blocks at a share s of the distance; the values are the kernel's."""

    NONE = 0  # all
    LINEAR = 1  # 1 - s
    SMOOTH = 2  # 1 - s² (3 - 2 s)


@dataclass(frozen=True)
class RayOptions:
    """distance: scene units, None for no limit. nearest: scene units; what is nearer blocks nothing. falloff: by which
    occluders block less up to the distance. spread: degrees across the cone about a lobe's axis that its rays stay in.
    front_only: faces block nothing from behind.

    Raises InputError, one line, for a value out of range.
    """

    distance: float | None = None
    nearest: float = 0.0
    falloff: Falloff = Falloff.NONE
    spread: float = WHOLE_SPREAD
    front_only: bool = False

    def __post_init__(self) -> None:
        if self.distance is not None and not (math.isfinite(self.distance) and self.distance > 0.0):
            raise InputError(f"distance {self.distance:g}: give a number above 0, or none for no limit")
        if not (math.isfinite(self.nearest) and 0.0 <= self.nearest < self.reach):
            raise InputError(f"minimum distance {self.nearest:g}: give a number from 0 on, and below the distance")
        if self.falloff is not Falloff.NONE and self.distance is None:
            raise InputError(f"falloff {self.falloff.name.lower()}: it needs a distance to fall off over; give one")
        if not LEAST_SPREAD <= self.spread <= WHOLE_SPREAD:
            raise InputError(f"spread {self.spread:g}: give {LEAST_SPREAD:g} to 180 degrees")

    @property
    def reach(self) -> float:
        """The distance as a number: inf for no limit."""
        return math.inf if self.distance is None else self.distance

    @property
    def lobe_cosine(self) -> float:
        """The cosine of the angle off a lobe's axis that rays stay within, as the kernel takes it; 0 for all."""
        return float(cos(math.radians(0.5 * self.spread))) if self.spread < WHOLE_SPREAD else 0.0


ALL_OCCLUDERS = RayOptions()  # at any distance, from both sides
