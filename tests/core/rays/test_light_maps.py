"""Light from the environment where it is known, by rays from the lobe, from the light, and from both."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from occlusion_bake.core.base.errors import InputError
from occlusion_bake.core.maps.light import LightMap, LightShareMap
from occlusion_bake.core.maps.map import Map
from occlusion_bake.core.rays.map_spec import MapSpec, light
from occlusion_bake.core.scene.scene import Scene
from occlusion_bake.core.spherical.environment import Environment, from_function
from occlusion_bake.tests.oracles import shapes
from occlusion_bake.tests.oracles.bakes import bake_one

SHARES = (0.0, 0.5, 1.0)  # of the rays from the lobe
TILT, HALF = np.radians(40.0), np.radians(15.0)


def lit(scene: Scene, environment: Environment) -> Scene:
    return replace(scene, environment=environment)


def sampled(share: float, exponent: float | None = None) -> MapSpec:
    return replace(light(exponent), lobe_share=share)


def both(share: float) -> tuple[Map, Map]:
    return LightShareMap(sampled(share)), LightMap(sampled(share))


@cache
def sky() -> Environment:
    """1 + 0.8 x, twice so in blue; nothing from below."""

    def radiance(ways: np.ndarray) -> np.ndarray:
        level = (1.0 + 0.8 * ways[:, 0]) * (ways[:, 2] > 0)
        return np.stack([level, level, 2.0 * level], axis=1)

    return from_function(radiance, 64)


@cache
def cap(side: float) -> Environment:
    """3 from all within HALF of a direction that leans by TILT to +x or -x."""
    middle = np.array([side * np.sin(TILT), 0.0, np.cos(TILT)])
    return from_function(lambda ways: np.repeat((ways @ middle > np.cos(HALF))[:, None] * 3.0, 3, axis=1), 64)


@pytest.mark.parametrize("share", SHARES)
def test_a_sky_that_is_linear_in_the_direction(share: float) -> None:
    """Of 1 + c x the half away from the wall gives 1/2 + 2c/(3π), the whole 1."""
    baked = bake_one(lit(shapes.beside_a_wall(), sky()), maps=both(share), rays=256, size=32)
    exact = 0.5 + 2 * 0.8 / (3 * np.pi)
    ratio, seen = baked.maps["light_ratio"], baked.maps["light"]
    np.testing.assert_allclose(ratio.values[ratio.covered].mean(axis=0), exact, atol=3e-3)
    np.testing.assert_allclose(seen.values[seen.covered].mean(axis=0), exact * np.array([1, 1, 2]), rtol=8e-3)


@pytest.mark.parametrize("share", SHARES)
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_cap_of_light_behind_a_wall_or_before_it(share: float, side: float) -> None:
    baked = bake_one(lit(shapes.beside_a_wall(), cap(side)), maps=both(share), rays=64, size=32)
    seen = baked.maps["light"]
    expected = 3.0 * np.cos(TILT) * np.sin(HALF) ** 2 if side > 0 else 0.0
    assert seen.values[seen.covered].mean() == pytest.approx(expected, rel=2e-2, abs=1e-6)


@pytest.mark.parametrize("share", SHARES)
@pytest.mark.parametrize("exponent", [None, 20.0])
def test_in_the_open_all_of_the_light_gets_through_exactly(share: float, exponent: float | None) -> None:
    estimator = sampled(share, exponent)
    baked = bake_one(lit(shapes.scene(shapes.plane(1.0)), sky()), maps=(estimator,), rays=16, size=8)
    ratio = baked.maps[f"{estimator.name}_ratio"]
    assert np.all(ratio.values[ratio.covered] == 1.0) and ratio.error == 0.0


def test_a_white_sky_gives_ao_and_ro() -> None:
    from occlusion_bake.core.rays.map_spec import AO, reflection

    white = from_function(lambda ways: np.ones((len(ways), 3)), 64)
    ball = shapes.sphere((0.0, 0.3, 0.9), 0.5, 64)
    scene = lit(shapes.scene(shapes.patch(), ball), white)
    asked = (AO, reflection(10), sampled(0.5), sampled(0.5, 10.0))
    maps = bake_one(scene, maps=asked, rays=256, size=32).maps
    assert maps["light_ratio"].mean == pytest.approx(maps["ao"].mean, abs=3e-3)
    assert maps["light_10_ratio"].mean == pytest.approx(maps["ro_10"].mean, abs=3e-3)


def test_light_without_a_world_is_refused() -> None:
    with pytest.raises(InputError, match="no World to take light from"):
        bake_one(shapes.scene(shapes.patch()), maps=(light(),))
