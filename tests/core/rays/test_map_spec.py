"""Every estimator against answers known exactly, through the whole pipeline, with every sampler.

Statistical tests: 16 seeds, p = 1e-5 (oracles/bakes.py); many texels of few rays, of which the kernel's tables of
directions are made faster than of few texels of many.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import asin, atan, cos, sin, sqrt
from typing import Any

import numpy as np
import pytest
from occlusion_bake.core.base.errors import InputError
from occlusion_bake.core.rays.map_spec import AO, Axis, MapSpec, Sampler, reflection, sampled
from occlusion_bake.core.scene.scene import Camera, Mesh, Scene
from occlusion_bake.tests.oracles import formulas, shapes
from occlusion_bake.tests.oracles.bakes import assert_mean, bake_one, means_of

pytestmark = pytest.mark.usefixtures("unmeasured")
PATCH = {"size": 48, "rays": 64}  # standard errors of about 5e-5
FAR = 2048.0  # stands for infinity beside lengths of about 1
SAMPLERS = ("importance", "uniform_hemisphere", "uniform_sphere")
BY_NORMAL = (AO, reflection(0), reflection(10), reflection(64))


def seen_from(x: float, y: float, z: float) -> Camera:
    """A parallel view that a floor reflects towards (x, y, z)."""
    length = sqrt(x * x + y * y + z * z)
    return Camera((0.0, 0.0, 0.0), (x / length, y / length, -z / length), orthographic=True)


def wall(x: float, height: float) -> Mesh:
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


def by_ceiling(exponent: float) -> float:
    return formulas.ceiling_within(1.5, 2.0, exponent)


AO_ONLY = (1.0,)
TESSELLATION = 1e-4  # spheres of 128 segments
CASES = [
    Case("ceiling beyond the limit", lambda: [shapes.plane(64, 2.0, up=-1.0)], lambda n: 1.0, distance=1.99),
    Case(
        "ceiling within the limit",
        lambda: [shapes.plane(64, 1.5, up=-1.0)],
        by_ceiling,
        distance=2,
    ),
    Case(
        "ceiling, seen from behind",
        lambda: [shapes.plane(64, 1.5)],
        by_ceiling,
        distance=2,
    ),
    Case("infinite wall", lambda: [wall(1, FAR)], lambda n: 0.5, slack=2e-4, at=(1 - 0.001, 0)),
    Case("long wall", lambda: [wall(1, 1.5)], lambda n: formulas.leaning_wall(n, 1, 1.5, 0)),
    Case(
        "trench",
        lambda: [wall(1, 1.5), wall(-0.5, 1.5)],
        lambda n: formulas.leaning_trench(n, 0.5, 1, 1.5, 0),
        (1, 0, 10, 64),
    ),
    Case(
        "octant corner",
        lambda: [
            shapes.quad((0, 0, 0), (0, FAR, 0), (0, 0, FAR), name="x"),
            shapes.quad((0, 0, 0), (FAR, 0, 0), (0, 0, FAR), name="y"),
        ],
        lambda n: 0.25,
        at=(0.01, 0.01),
        slack=2e-5,
    ),
    Case(
        "perpendicular rectangle",
        lambda: [shapes.quad((0.7, 0, 0), (0, 1.2, 0), (0, 0, 0.9))],
        lambda n: formulas.perpendicular_rectangle(0.7, 1.2, 0.9),
        AO_ONLY,
    ),
    Case(
        "parallel rectangle",
        lambda: [shapes.quad((0, 0, 0.6), (0.8, 0, 0), (0, 1.1, 0))],
        lambda n: formulas.parallel_rectangle(0.8, 1.1, 0.6),
        AO_ONLY,
    ),
    Case(
        "sphere overhead",
        lambda: [shapes.sphere((0, 0, 2), 1.2, 128)],
        lambda n: formulas.cap(n, asin(0.6)),
        slack=20 * TESSELLATION,  # a narrow lobe sees its rim alone
    ),
    Case(
        "sphere aside",
        lambda: [shapes.sphere((1.2, 0, 1.6), 0.8, 128)],
        lambda n: formulas.cap_off_axis(n, asin(0.4), atan(1.2 / 1.6)),
        slack=4 * TESSELLATION,
    ),
    Case(
        "sphere on the floor",
        lambda: [shapes.sphere((0.6, 0, 0.5), 0.5, 128), shapes.plane(64)],
        lambda n: formulas.sphere_resting(0.5, 0.6),
        AO_ONLY,
        slack=TESSELLATION,
    ),
    Case(
        "sphere through the floor",
        lambda: [shapes.sphere((1.0, 0, 0.2), 0.5, 128), shapes.plane(64)],
        lambda n: formulas.sphere_cut(0.5, sqrt(1.04), atan(1.0 / 0.2)),
        AO_ONLY,
        slack=TESSELLATION,
    ),
]


def scene_of(case: Case, camera: Camera | None = None) -> Scene:
    scene: Scene = shapes.scene(shapes.patch(x=case.at[0], y=case.at[1]), *case.build(), camera=camera)
    return scene


def distinct(estimator: MapSpec, sampler: str) -> MapSpec:
    return replace(sampled(estimator, sampler), name=f"{estimator.name} {sampler}")


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_importance_sampling_finds_the_exact_answer(case: Case) -> None:
    maps = tuple(AO if exponent == 1 else reflection(exponent) for exponent in case.exponents)
    means = means_of(scene_of(case), maps=maps, **PATCH, distance=case.distance)
    for estimator in maps:
        assert_mean(means[estimator.name], case.exact(estimator.exponent), slack=case.slack)


@pytest.mark.parametrize("name", ["ceiling beyond the limit", "trench", "sphere aside"])
def test_naive_samplers_expect_the_same(name: str) -> None:
    case = next(case for case in CASES if case.name == name)
    maps = [distinct(lobe, sampler) for lobe in (AO, reflection(10)) for sampler in SAMPLERS[1:]]
    means = means_of(scene_of(case), maps=tuple(maps), **PATCH, distance=case.distance)
    for estimator in maps:
        assert_mean(means[estimator.name], case.exact(estimator.exponent), slack=case.slack)


def test_an_open_plane_is_1_exactly() -> None:
    maps = (*BY_NORMAL, reflection(1e6))
    for turned in (False, True):
        scene = shapes.scene(shapes.plane(3.0), under=shapes.matrix((7, 8, 9), 1.7, turned))
        baked = bake_one(scene, maps=maps, size=32, rays=256)
        for estimator in maps:
            assert np.all(baked.maps[estimator.name].values == 1.0)


@pytest.mark.parametrize("degrees", [20.0, 60.0, 85.0])
def test_a_leaning_lobe_loses_what_is_below_the_horizon(degrees: float) -> None:
    angle = np.radians(degrees)
    scene = shapes.scene(shapes.patch(), camera=seen_from(sin(angle), 0, cos(angle)))
    lobes = [reflection(n, from_camera=True) for n in (1, 10, 64)]
    maps = [*lobes, *(distinct(lobe, "uniform_sphere") for lobe in lobes[:2])]
    means = means_of(scene, maps=tuple(maps), **PATCH)
    for estimator in maps:
        assert_mean(means[estimator.name], formulas.horizon(estimator.exponent, angle))


@pytest.mark.parametrize("lean", [-35.0, 50.0])
def test_a_leaning_lobe_in_a_trench(lean: float) -> None:
    angle = np.radians(lean)
    scene = shapes.scene(shapes.patch(), wall(1, 1.5), wall(-0.5, 1.5), camera=seen_from(sin(angle), 0, cos(angle)))
    maps = tuple(reflection(n, from_camera=True) for n in (0, 1, 10, 64))
    means = means_of(scene, maps=maps, **PATCH)
    for estimator in maps:
        exact = formulas.leaning_trench(estimator.exponent, 0.5, 1, 1.5, angle)
        assert_mean(means[estimator.name], exact)


def test_a_lobe_along_the_diagonal_of_the_octant_corner() -> None:
    corner = next(case for case in CASES if case.name == "octant corner")
    maps = [distinct(reflection(1, from_camera=True), sampler) for sampler in ("importance", "uniform_sphere")]
    means = means_of(scene_of(corner, seen_from(1, 1, 1)), maps=tuple(maps), **PATCH)
    for estimator in maps:
        assert_mean(means[estimator.name], formulas.octant_lobe(*[1 / sqrt(3)] * 3), slack=corner.slack)


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
