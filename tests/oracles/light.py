"""What is true of an environment."""

from __future__ import annotations

from ...core.base.arrays import Doubles
from ...core.spherical.environment import Environment
from ...core.spherical.octahedral_map import solid_angles


def energy(environment: Environment) -> Doubles:
    """(3,) float64: the integral of its radiance over all directions."""
    total: Doubles = (environment.radiance * solid_angles(len(environment.radiance))[..., None]).sum(axis=(0, 1))
    return total
