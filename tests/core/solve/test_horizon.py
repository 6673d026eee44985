"""The open horizon divided out of reflection occlusion: 1 in the open, and the ratio of known answers elsewhere."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from occlusion_bake.core.finish.report import image_metadata, whole_report
from occlusion_bake.core.options.values import told_by_images, told_by_reports
from occlusion_bake.core.rays.map_spec import AO, reflection
from occlusion_bake.core.rays.texel_surface import TexelSurface
from occlusion_bake.core.scene.scene import Camera, Mesh, Scene
from occlusion_bake.core.scene.world_mesh import WorldMesh, world_mesh
from occlusion_bake.core.solve.horizon import cosines_to_reflected, divide
from occlusion_bake.core.spherical.lobe import open_horizon
from occlusion_bake.core.texels.rasterize import rasterize
from occlusion_bake.tests.oracles import formulas, shapes
from occlusion_bake.tests.oracles.bakes import assert_mean, bake_one, means_of
from occlusion_bake.tests.oracles.settings import flat_settings

EXPONENTS = (1.0, 10.0, 64.0)
MAPS = tuple(reflection(exponent, from_camera=True) for exponent in EXPONENTS)


def grazing(degrees: float, turned: float = 0.0) -> Camera:
    """A camera from whose view a floor reflects at that angle from its normal, towards +x or turned away from it."""
    angle, turn = np.radians((degrees, turned))
    forward = (np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn), -np.cos(angle))
    return Camera((0.0, 0.0, 0.0), forward, orthographic=True)


@pytest.mark.parametrize("exponent", [0.0, 0.5, 1.0, 2.0, 10.0, 64.0, 1000.0])
def test_the_table_is_the_formula(exponent: float) -> None:
    degrees = np.array([0, 0.1, 17, 30, 60, 80, 85, 89, 89.99, 90])
    exact = [formulas.open_horizon(exponent, angle) for angle in np.radians(degrees)]
    assert_allclose(open_horizon(exponent, np.cos(np.radians(degrees))), exact, atol=1e-6)


def test_the_table_where_it_is_known() -> None:
    cosines = np.linspace(0, 1, 5001)
    angles = np.arccos(cosines)
    assert_allclose(open_horizon(0.0, cosines), 1 - angles / np.pi, atol=1e-6)
    assert_allclose(open_horizon(1.0, cosines), (1 + cosines) / 2, atol=1e-6)
    assert_allclose(open_horizon(2.0, cosines), 1 - (angles - np.sin(2 * angles) / 2) / np.pi, atol=1e-6)
    assert open_horizon(64.0, np.cos(np.radians([85.0])))[0] == pytest.approx(0.758, abs=5e-4)


@pytest.mark.parametrize("exponent", [1e4, 1e8, 1e300])
def test_a_sharp_lobe_has_a_sharp_horizon(exponent: float) -> None:
    """Its part above tends to that of a normal distribution of variance 1/e."""
    from math import erf

    times = np.array([0, 0.3, 1, 2, 9, 1000])
    expected = [0.5 + 0.5 * erf(each / np.sqrt(2)) for each in times]
    heights = np.sin(np.minimum(times / np.sqrt(exponent), 1.5))
    assert_allclose(open_horizon(exponent, heights), expected, atol=2e-5 if exponent < 1e5 else 1e-6)


def test_behind_the_horizon_is_taken_for_the_horizon() -> None:
    for exponent in (0.0, 1.0, 1e6):
        assert_allclose(open_horizon(exponent, np.array([-1.0, -1e-3, 0.0])), 0.5, atol=1e-12)
        assert np.all(np.diff(open_horizon(exponent, np.linspace(0, 1, 99))) >= 0)


@pytest.mark.parametrize("degrees", [0, 30, 60, 85])
@pytest.mark.usefixtures("unmeasured")
def test_an_open_floor_is_1_from_every_view(degrees: float) -> None:
    scene = shapes.scene(shapes.plane(1.0), camera=grazing(degrees))
    divided = means_of(scene, maps=MAPS, size=8, rays=64, threads=1, divide_horizon=True)
    for estimator in MAPS:
        # where next to no ray goes below the horizon, none may in all the seeds: then the mean is that of no noise
        slack = 1e-5 if formulas.open_horizon(estimator.exponent, np.radians(degrees)) > 0.9999 else 0.0
        assert_mean(divided[estimator.name], 1.0, slack=slack)


@pytest.mark.parametrize("degrees", [30, 85])
@pytest.mark.parametrize("away", [1, -1])
@pytest.mark.usefixtures("unmeasured")
def test_before_a_wall(away: float, degrees: float) -> None:
    """A wall along y, towards +x, R leaning to it or away: both RO and what is open of it are integrals of cosᵉ over
    what is left of the lobe's half-circle, so that the whole is of no account."""
    height, exponent = 0.8, 10.0
    wall = shapes.quad((1, -1e3, 0), (0, 2e3, 0), (0, 0, height), name="wall")
    scene = shapes.scene(shapes.patch(), wall, camera=grazing(degrees, 0.0 if away > 0 else 180.0))
    angle = away * np.radians(degrees)
    seen = _lobe(exponent, -np.pi / 2 - angle, np.pi / 2 - np.arctan(height) - angle)
    free = _lobe(exponent, -np.pi / 2 - angle, np.pi / 2 - angle)
    maps = (reflection(exponent, from_camera=True),)
    means = means_of(scene, maps=maps, size=16, rays=64, threads=1, divide_horizon=True)["ro_10"]
    assert_mean(means, seen / free, slack=1e-4)  # the wall is not endless, nor the patch a point


def _lobe(exponent: float, start: float, end: float) -> float:
    angles = np.linspace(max(start, -np.pi / 2), min(end, np.pi / 2), 20001)
    middles = 0.5 * (angles[1:] + angles[:-1])
    return float(np.sum(np.cos(middles) ** exponent) * (angles[1] - angles[0]))


def sphere_scene() -> Scene:
    ball = shapes.sphere((0.2, 0.1, 0.7), 0.6, 32, name="ball")
    scene: Scene = shapes.scene(
        ball, shapes.plane(2.0, name="floor"), camera=Camera((1.0, -4.0, 1.0), (0.0, 0.0, -1.0))
    )
    return scene


def test_only_maps_about_the_reflected_direction_change() -> None:
    maps = (AO, replace(reflection(10), name="by normal"), reflection(10, from_camera=True))
    kept, divided = (bake_one(sphere_scene(), maps=maps, size=48, divide_horizon=on).maps for on in (False, True))
    for name in ("ao", "by normal"):
        assert_array_equal(kept[name].values, divided[name].values)
        assert (kept[name].error, kept[name].mean) == (divided[name].error, divided[name].mean)
    before, after = kept["ro_10"], divided["ro_10"]
    assert_array_equal(before.covered, after.covered)
    ratio = after.values[after.covered & (before.values > 0)] / before.values[after.covered & (before.values > 0)]
    assert ratio.min() >= 1.0 and 1.5 < ratio.max() <= 2.0 + 1e-6  # the silhouette loses half of its lobe
    assert after.mean > before.mean and after.error > before.error
    assert np.isfinite(after.values).all()


def test_without_a_camera_nothing_happens() -> None:
    scene = shapes.scene(shapes.plane(1.0), shapes.sphere((0, 0, 1.0), 0.6, 16))
    kept, divided = (bake_one(scene, divide_horizon=on).maps["ao"].values for on in (False, True))
    assert_array_equal(kept, divided)


def test_by_default_the_formula_stands() -> None:
    assert not any(spec.divided for spec in MAPS)


def test_the_angle_is_that_of_the_view() -> None:
    """R = d − 2(d·n)n, by the shading normal, from a camera at a point; flat and smooth, facing and not."""
    for smooth in (False, True):
        ball = world_mesh(shapes.instance(shapes.sphere(segments=32, smooth=smooth)), np.zeros(3))
        assert ball.uv is not None
        owner = rasterize("ball", ball.uv, 64, 32).owner
        camera = Camera((3.0, -1.0, 2.0), (0.0, 0.0, 1.0))
        cosines = cosines_to_reflected(TexelSurface(ball, owner), camera)
        assert cosines.shape == owner.shape and np.abs(cosines).max() <= 1 + 1e-6
        facing = cosines[owner >= 0] > 0
        assert 0.25 < facing.mean() < 0.5  # a camera at a finite distance sees less than half
    middle = np.unravel_index(np.argmax(cosines), cosines.shape)
    assert cosines[middle] == pytest.approx(1.0, abs=2e-2)


def test_a_camera_on_the_surface_divides_by_no_nothing() -> None:
    floor = world_mesh(shapes.instance(shapes.plane(1.0)), np.zeros(3))
    assert floor.uv is not None
    owner = np.zeros((1, 1), np.int32)
    (at,) = np.float32([[1 / 3, -1 / 3, 0.0]])
    surface = TexelSurface(floor, owner)
    cosines = cosines_to_reflected(surface, Camera((float(at[0]), float(at[1]), 0.0), (0.0, 0.0, -1.0)))
    assert np.isfinite(cosines).all()
    nothing = surface.part(np.full((2, 2), -1, np.int32))
    assert_array_equal(cosines_to_reflected(nothing, Camera((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))), 0.0)


def test_texels_without_a_value_stay_so() -> None:
    sums = np.float32([[-1, 0, 3, 1]])
    divide(sums, np.array([[0.5, 0.5, 0.75, 0.75]]))
    assert_allclose(sums, np.float32([[-1, 0, 4, 4 / 3]]))


def test_the_report_and_the_images_tell() -> None:
    from occlusion_bake.core.rays.embree import open_device

    maps = (AO, reflection(10, from_camera=True))
    for on, word, told in ((False, "keep", "kept"), (True, "divide", "divided")):
        settings = flat_settings(maps, width=16, height=16, rays=4, divide_horizon=on)
        baked = bake_one(sphere_scene(), maps=maps, rays=4, divide_horizon=on)
        assert whole_report(told_by_reports(settings), open_device().description, {}, [])["ro_horizon"] == word
        assert image_metadata(baked, "ro_10", told_by_images(settings))["horizon"] == told
        assert image_metadata(baked, "ao", told_by_images(settings))["horizon"] == "kept"


def test_smooth_normals_are_the_shading_ones() -> None:
    tilted = np.tile(np.float32([0.6, 0.0, 0.8]), (1, 3, 1))
    mesh = Mesh("t", np.float32([[0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.int32([[0, 1, 2]]))
    uv = np.float32([[[0, 0], [1, 0], [0, 1]]])
    surface = TexelSurface(WorldMesh(mesh.vertices, mesh.triangles, uv, tilted), np.zeros((1, 1), np.int32))
    cosines = cosines_to_reflected(surface, Camera((0.0, 0.0, 0.0), (0.0, 0.0, -1.0), True))
    assert cosines[0, 0] == pytest.approx(0.8, abs=1e-6)
