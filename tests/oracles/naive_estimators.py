"""Monte-Carlo integration with independent random numbers, as plainly as it can be written. Read this one first.

    AO    = ∫ V(ω) max(n·ω, 0)/π dω
    RO(R) = ∫ V(ω) (e+1)/(2π) max(R·ω, 0)^e dω      over the hemisphere of n

To estimate ∫ V f dω draw a direction ω from any density p that is above 0 where f is, and take V(ω) f(ω)/p(ω). Its
expectation is ∫ V f/p · p dω, the integral, whatever p is. Its spread is not: that is what the study is about.
"""

from __future__ import annotations

import numpy as np

from ...core.base.arrays import Doubles
from ...core.rays.embree import open_device
from ...core.rays.map_spec import Sampler
from ...core.rays.trace_scene import TraceScene
from .wall_and_open import Case, blockers, reflected

NORMAL = np.array([0.0, 0.0, 1.0])


def uniform_sphere(u: Doubles, v: Doubles) -> tuple[Doubles, Doubles]:
    """Every direction alike: density 1/(4π). Half of the rays go into the floor. Returns (N, 3), (N,)."""
    cosine = 1.0 - 2.0 * u  # Archimedes: equal slices of the sphere have equal areas
    return about_z(cosine, v), np.full(len(u), 1.0 / (4.0 * np.pi))


def uniform_hemisphere(u: Doubles, v: Doubles) -> tuple[Doubles, Doubles]:
    """Every direction above the floor alike: density 1/(2π)."""
    return about_z(u, v), np.full(len(u), 1.0 / (2.0 * np.pi))


def lobe(u: Doubles, v: Doubles, exponent: float, axis: Doubles) -> tuple[Doubles, Doubles]:
    """As the integrand itself is spread: density (e+1)/(2π) (axis·ω)^e. About the normal with e = 1: the cosine.

    The share of the lobe within the angle θ of its axis is 1 - cos^(e+1) θ; set it to 1 - u and solve for cos θ.
    """
    cosine = u ** (1.0 / (exponent + 1.0))
    directions = about_z(cosine, v) @ frame(axis)
    return directions, (exponent + 1.0) / (2.0 * np.pi) * np.maximum(directions @ axis, 0.0) ** exponent


def integrand(directions: Doubles, exponent: float, axis: Doubles) -> Doubles:
    """f: the lobe, cut off at the floor's horizon. (N,)."""
    f = (exponent + 1.0) / (2.0 * np.pi) * np.maximum(directions @ axis, 0.0) ** exponent
    return np.where(directions @ NORMAL > 0.0, f, 0.0)


def one_ray_estimates(case: Case, count: int, seed: int) -> Doubles:
    """(count,) independent estimates of the case's map, V f/p, each from one random direction of its own."""
    rng = np.random.default_rng(seed)
    u, v = 1.0 - rng.random(count), rng.random(count)  # u in (0, 1]: a cosine of 0 would have no density
    axis = reflected(case.tilt)
    if case.sampler is Sampler.UNIFORM_SPHERE:
        directions, density = uniform_sphere(u, v)
    elif case.sampler is Sampler.UNIFORM_HEMISPHERE:
        directions, density = uniform_hemisphere(u, v)
    else:
        directions, density = lobe(u, v, case.exponent, axis)
    weight = integrand(directions, case.exponent, axis) / density
    return np.asarray(visible(case.point, directions) * weight, dtype=np.float64)


def visible(point: str, directions: Doubles) -> Doubles:
    """V along rays from the origin, 1 or 0: (N,)."""
    scene = TraceScene(open_device())
    for blocker in blockers(point):
        scene.add(blocker.mesh.vertices, blocker.mesh.triangles)
    scene.commit()
    rays = directions.astype(np.float32)
    return scene.visible(np.zeros_like(rays), rays).astype(np.float64)


def about_z(cosine: Doubles, v: Doubles) -> Doubles:
    """(N, 3) unit vectors with the cosines given and azimuths 2πv."""
    sine, turn = np.sqrt(1.0 - cosine**2), 2.0 * np.pi * v
    return np.stack([sine * np.cos(turn), sine * np.sin(turn), cosine], axis=-1)


def frame(axis: Doubles) -> Doubles:
    """(3, 3): rows that are x, y and z seen from a frame whose z is the axis, which lies in the xz plane."""
    x, _, z = axis
    return np.array([(z, 0.0, -x), (0.0, 1.0, 0.0), (x, 0.0, z)])
