"""Every estimator against answers known exactly, through the whole pipeline, with every sampler.

The formulas: visibility of a differential area (Howell, A Catalog of Radiation Heat Transfer Configuration Factors),
and for lobes their integrals over the visible part. Statistical tests: 16 seeds, p = 1e-5 (conftest.py); many texels of
few rays, of which the kernel's tables of directions are made faster than of few texels of many.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import acos, asin, atan, cos, pi, sin, sqrt
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from occlusion_bake.bench.truth.formulas import open_horizon
from occlusion_bake.core.base.errors import InputError
from occlusion_bake.core.rays.map_spec import AO, Axis, MapSpec, Sampler, reflection, sampled
from occlusion_bake.core.scene.scene import Camera, Mesh, Scene

pytestmark = pytest.mark.usefixtures("unmeasured")
PATCH = {"size": 48, "rays": 64}  # standard errors of about 5e-5
FAR = 2048.0  # stands for infinity beside lengths of about 1
SAMPLERS = ("importance", "uniform_hemisphere", "uniform_sphere")
BY_NORMAL = (AO, reflection(0), reflection(10), reflection(64))


def along_axis(exponent: float, start: float, end: float) -> float:
    """Share of a lobe visible between two angles from R, where all is infinite along an axis perpendicular to R."""

    def integral(low: float, high: float) -> float:
        node, weight = np.polynomial.legendre.leggauss(200)
        angle = 0.5 * (high - low) * node + 0.5 * (high + low)
        return float(0.5 * (high - low) * np.sum(weight * np.cos(angle) ** exponent))

    low, high = max(start, -pi / 2), min(end, pi / 2)
    return integral(low, high) / integral(-pi / 2, pi / 2)


def cap_blocked(exponent: float, half_angle: float, off: float) -> float:
    """Share of a lobe that a cap of some half-angle blocks, its middle `off` from R and all of it within the lobe."""
    steps = 100_000  # midpoint rule; the integrand has kinks
    theta = pi / 2 * (np.arange(steps) + 0.5) / steps
    inner = (np.cos(half_angle) - np.cos(theta) * np.cos(off)) / np.maximum(np.sin(theta) * np.sin(off), 1e-300)
    width = np.arccos(np.clip(inner, -1, 1)) / pi
    return float(pi / 2 * np.mean((exponent + 1) * np.cos(theta) ** exponent * np.sin(theta) * width))


def perpendicular_rectangle(d: float, w: float, h: float) -> float:
    s = sqrt(d * d + h * h)
    return (atan(w / d) - d / s * atan(w / s)) / (2 * pi)


def parallel_rectangle(a: float, b: float, h: float) -> float:
    x, y = a / h, b / h
    p, q = sqrt(1 + x * x), sqrt(1 + y * y)
    return (x / p * atan(y / p) + y / q * atan(x / q)) / (2 * pi)


def cut_sphere(r: float, distance: float, theta: float) -> float:
    """A sphere that the horizon cuts, its centre at `distance` and theta from the normal."""
    high = distance / r
    q = sqrt(high * high - 1)
    lit = cos(theta) * acos(-q * cos(theta) / sin(theta)) - q * sqrt(1 - (high * cos(theta)) ** 2)
    return 0.5 - asin(q / (high * sin(theta))) / pi + lit / (pi * high * high)


def seen_from(x: float, y: float, z: float) -> Camera:
    """A parallel view that a floor reflects towards (x, y, z)."""
    length = sqrt(x * x + y * y + z * z)
    return Camera((0.0, 0.0, 0.0), (x / length, y / length, -z / length), orthographic=True)


def wall(shapes: Any, x: float, height: float) -> Mesh:
    mesh: Mesh = shapes.quad((x, -FAR, 0), (0, 2 * FAR, 0), (0, 0, height), name=f"wall {x}")
    return mesh


@dataclass(frozen=True)
class Case:
    """What stands about a patch of floor at the origin, and the visibility that a lobe about the normal has there."""

    name: str
    build: Callable[[Any], list[Mesh]]
    exact: Callable[[float], float]  # by exponent
    exponents: tuple[float, ...] = (1, 10, 64)
    distance: float | None = None
    slack: float = 0.0
    at: tuple[float, float] = (0.0, 0.0)


AO_ONLY = (1.0,)
TESSELLATION = 1e-4  # spheres of 128 segments
CASES = [
    Case("ceiling beyond the limit", lambda s: [s.plane(64, 2.0, up=-1.0)], lambda n: 1.0, distance=1.99),
    Case("ceiling within the limit", lambda s: [s.plane(64, 1.5, up=-1.0)], lambda n: 0.75 ** (n + 1), distance=2),
    Case("ceiling, seen from behind", lambda s: [s.plane(64, 1.5)], lambda n: 0.75 ** (n + 1), distance=2),
    Case("infinite wall", lambda s: [wall(s, 1, FAR)], lambda n: 0.5, slack=2e-4, at=(1 - 0.001, 0)),
    Case("long wall", lambda s: [wall(s, 1, 1.5)], lambda n: along_axis(n, -pi, atan(1 / 1.5))),
    Case(
        "trench",
        lambda s: [wall(s, 1, 1.5), wall(s, -0.5, 1.5)],
        lambda n: along_axis(n, -atan(0.5 / 1.5), atan(1 / 1.5)),
        (1, 0, 10, 64),
    ),
    Case(
        "octant corner",
        lambda s: [
            s.quad((0, 0, 0), (0, FAR, 0), (0, 0, FAR), name="x"),
            s.quad((0, 0, 0), (FAR, 0, 0), (0, 0, FAR), name="y"),
        ],
        lambda n: 0.25,
        at=(0.01, 0.01),
        slack=2e-5,
    ),
    Case(
        "perpendicular rectangle",
        lambda s: [s.quad((0.7, 0, 0), (0, 1.2, 0), (0, 0, 0.9))],
        lambda n: 1 - perpendicular_rectangle(0.7, 1.2, 0.9),
        AO_ONLY,
    ),
    Case(
        "parallel rectangle",
        lambda s: [s.quad((0, 0, 0.6), (0.8, 0, 0), (0, 1.1, 0))],
        lambda n: 1 - parallel_rectangle(0.8, 1.1, 0.6),
        AO_ONLY,
    ),
    Case(
        "sphere overhead",
        lambda s: [s.sphere((0, 0, 2), 1.2, 128)],
        lambda n: (1 - 0.6**2) ** ((n + 1) / 2),
        slack=20 * TESSELLATION,  # a narrow lobe sees its rim alone
    ),
    Case(
        "sphere aside",
        lambda s: [s.sphere((1.2, 0, 1.6), 0.8, 128)],
        lambda n: 1 - cap_blocked(n, asin(0.4), atan(1.2 / 1.6)),
        slack=4 * TESSELLATION,
    ),
    Case(
        "sphere on the floor",
        lambda s: [s.sphere((0.6, 0, 0.5), 0.5, 128), s.plane(64)],
        lambda n: 1 - 0.5**3 / (0.5**2 + 0.6**2) ** 1.5,
        AO_ONLY,
        slack=TESSELLATION,
    ),
    Case(
        "sphere through the floor",
        lambda s: [s.sphere((1.0, 0, 0.2), 0.5, 128), s.plane(64)],
        lambda n: 1 - cut_sphere(0.5, sqrt(1.04), atan(1.0 / 0.2)),
        AO_ONLY,
        slack=TESSELLATION,
    ),
]


def scene_of(case: Case, shapes: Any, camera: Camera | None = None) -> Scene:
    scene: Scene = shapes.scene(shapes.patch(*case.at), *case.build(shapes), camera=camera)
    return scene


def distinct(estimator: MapSpec, sampler: str) -> MapSpec:
    return replace(sampled(estimator, sampler), name=f"{estimator.name} {sampler}")


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_importance_sampling_finds_the_exact_answer(case: Case, shapes: Any, means_of: Any, assert_mean: Any) -> None:
    maps = tuple(AO if exponent == 1 else reflection(exponent) for exponent in case.exponents)
    means = means_of(scene_of(case, shapes), maps=maps, **PATCH, distance=case.distance)
    for estimator in maps:
        assert_mean(means[estimator.name], case.exact(estimator.exponent), slack=case.slack)


@pytest.mark.parametrize("name", ["ceiling beyond the limit", "trench", "sphere aside"])
def test_naive_samplers_expect_the_same(name: str, shapes: Any, means_of: Any, assert_mean: Any) -> None:
    case = next(case for case in CASES if case.name == name)
    maps = [distinct(lobe, sampler) for lobe in (AO, reflection(10)) for sampler in SAMPLERS[1:]]
    means = means_of(scene_of(case, shapes), maps=tuple(maps), **PATCH, distance=case.distance)
    for estimator in maps:
        assert_mean(means[estimator.name], case.exact(estimator.exponent), slack=case.slack)


def test_an_open_plane_is_1_exactly(shapes: Any, bake_one: Any) -> None:
    maps = (*BY_NORMAL, reflection(1e6))
    for turned in (False, True):
        scene = shapes.scene(shapes.plane(3.0), matrix=shapes.matrix((7, 8, 9), 1.7, turned))
        baked = bake_one(scene, maps=maps, size=32, rays=256)
        for estimator in maps:
            assert np.all(baked.maps[estimator.name].values == 1.0)


@pytest.mark.parametrize("degrees", [20.0, 60.0, 85.0])
def test_a_leaning_lobe_loses_what_is_below_the_horizon(
    degrees: float, shapes: Any, means_of: Any, assert_mean: Any
) -> None:
    angle = np.radians(degrees)
    scene = shapes.scene(shapes.patch(), camera=seen_from(sin(angle), 0, cos(angle)))
    lobes = [reflection(n, from_camera=True) for n in (1, 10, 64)]
    maps = [*lobes, *(distinct(lobe, "uniform_sphere") for lobe in lobes[:2])]
    means = means_of(scene, maps=tuple(maps), **PATCH)
    for estimator in maps:
        assert_mean(means[estimator.name], open_horizon(estimator.exponent, angle))


@pytest.mark.parametrize("lean", [-35.0, 50.0])
def test_a_leaning_lobe_in_a_trench(lean: float, shapes: Any, means_of: Any, assert_mean: Any) -> None:
    angle = np.radians(lean)
    scene = shapes.scene(
        shapes.patch(), wall(shapes, 1, 1.5), wall(shapes, -0.5, 1.5), camera=seen_from(sin(angle), 0, cos(angle))
    )
    maps = tuple(reflection(n, from_camera=True) for n in (0, 1, 10, 64))
    means = means_of(scene, maps=maps, **PATCH)
    for estimator in maps:
        exact = along_axis(estimator.exponent, -atan(0.5 / 1.5) - angle, atan(1 / 1.5) - angle)
        assert_mean(means[estimator.name], exact)


def test_a_lobe_along_the_diagonal_of_the_octant_corner(shapes: Any, means_of: Any, assert_mean: Any) -> None:
    corner = next(case for case in CASES if case.name == "octant corner")
    maps = [distinct(reflection(1, from_camera=True), sampler) for sampler in ("importance", "uniform_sphere")]
    means = means_of(scene_of(corner, shapes, seen_from(1, 1, 1)), maps=tuple(maps), **PATCH)
    for estimator in maps:
        assert_mean(means[estimator.name], sqrt(3) / 4, slack=corner.slack)


def test_the_formulas_agree_where_they_meet() -> None:
    assert_allclose(cap_blocked(1, asin(0.4), 0.6), 0.4**2 * cos(0.6), atol=1e-6)  # a sphere above the horizon
    assert_allclose(cap_blocked(10, asin(0.4), 1e-4), 1 - (1 - 0.4**2) ** 5.5, atol=1e-6)  # overhead
    assert_allclose(2 * perpendicular_rectangle(1, FAR, 1.5), 1 - along_axis(1, -pi, atan(1 / 1.5)), atol=1e-6)
    assert_allclose(cut_sphere(0.5, 2.0, acos(0.25)), 0.25**2 * 0.25, atol=1e-6)  # the horizon touches the sphere


@pytest.mark.parametrize("degrees", [0.0, 10.0, 45.0, 80.0, 90.0, 170.0])
def test_the_open_horizon_has_its_closed_forms(degrees: float) -> None:
    angle = np.radians(degrees)
    assert_allclose(open_horizon(0, angle), 1 - angle / pi, atol=1e-9)
    assert_allclose(open_horizon(1, angle), (1 + cos(angle)) / 2, atol=1e-9)
    assert_allclose(open_horizon(2, angle), 1 - (angle - sin(angle) * cos(angle)) / pi, atol=1e-9)
    assert_allclose(open_horizon(64, angle) + open_horizon(64, pi - angle), 1.0, atol=1e-9)


def test_a_narrow_leaning_lobe_is_not_1_in_the_open() -> None:
    assert_allclose(open_horizon(64, np.radians(85.0)), 0.758, atol=5e-4)


def test_names_are_those_of_files_and_reports() -> None:
    assert [AO.name, reflection(10).name, reflection(2.5).name] == ["ao", "ro_10", "ro_2.5"]
    assert reflection(10, from_camera=True).axis is Axis.REFLECTED
    assert sampled(AO, "importance") == AO


@pytest.mark.parametrize("exponent", [-1.0, np.nan, np.inf])
def test_exponents_without_a_lobe_are_refused(exponent: float) -> None:
    with pytest.raises(InputError, match="exponent"):
        reflection(exponent)


def test_samplers_without_a_meaning_are_refused() -> None:
    with pytest.raises(InputError, match=r"'cosine'.*importance, uniform_hemisphere, uniform_sphere"):
        sampled(AO, "cosine")
    with pytest.raises(InputError, match="uniform_hemisphere"):
        sampled(reflection(10, from_camera=True), "uniform_hemisphere")
    assert sampled(reflection(10, from_camera=True), "uniform_sphere").sampler is Sampler.UNIFORM_SPHERE
