"""The kernel's filter beside one that is written down plainly, where every point asks every other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from occlusion_bake.core.base.arrays import Doubles
from occlusion_bake.core.scene.scene import Mesh
from occlusion_bake.core.solve import surface_filter
from occlusion_bake.tests.oracles import naive_filter, shapes
from occlusion_bake.tests.oracles.sheet import Sheet, rms

NOISE = 0.05  # standard deviation of a value of precision 1
MESHES = {
    "floor": shapes.plane(),
    "round": shapes.cylinder(height=6.28, segments=24),
    "sides": shapes.cylinder(height=6.28, segments=24, smooth=False),
    "ball": shapes.sphere(segments=24),
    "room": shapes.room(),
}


def waves(sheet: Sheet) -> Doubles:
    """Soft shades and a step."""
    x, y = sheet.places[..., 0], sheet.places[..., 1]
    values: Doubles = 0.5 + 0.1 * np.sin(3.0 * x) + 0.1 * y * (x > 0.3)
    return np.where(sheet.owned, values, 0.0)


def map_of(sheet: Sheet, precision: Doubles, seed: int) -> naive_filter.Samples:
    """(H, W) images of a map as so many rays would give it: the noise of each known to a third."""
    rng = np.random.default_rng(seed)
    value = waves(sheet) + NOISE * rng.standard_normal(precision.shape) / np.sqrt(np.maximum(precision, 1e-9))
    noise = NOISE**2 * rng.chisquare(20, precision.shape) / 20
    rounded = (np.where(sheet.owned, image, 0.0).astype(np.float32) for image in (value, noise, precision))
    return naive_filter.Samples(*rounded)


def both(
    sheet: Sheet, images: naive_filter.Samples, exponent: float = 1.0
) -> tuple[tuple[Doubles, Doubles], tuple[Doubles, Doubles]]:
    """Values and expected squared errors of owned texels: the kernel's and the oracle's."""
    where = sheet.owned
    made = sheet.surface_filter.filter(images.value, images.noise, images.precision, exponent)
    mesh = replace(sheet.surface, texel_normals=None)
    shading = sheet.surface.texel_normals if sheet.surface.texel_normals is not None else mesh.normals
    surface = (sheet.places, mesh.normals, shading, sheet.spacing())
    points = naive_filter.Points(*(image[where].astype(np.float64) for image in surface))
    samples = naive_filter.Samples(
        *(image[where].astype(np.float64) for image in (images.value, images.noise, images.precision))
    )
    value, error = naive_filter.apply(points, samples, *weights(exponent))
    return (made[0][where], made[1][where]), (np.clip(value, 0.0, 1.0), error)


def weights(exponent: float) -> tuple[float, float]:
    """The sharpness and the slope that the filter is asked for."""
    sharpness = surface_filter._SHARPNESS * exponent**surface_filter._SHARPNESS_POWER
    return sharpness, surface_filter._SLOPE * exponent**surface_filter._SLOPE_POWER


def saddle() -> Mesh:
    """Smooth; it turns its normals by up to 16 degrees."""
    made = shapes.grid(1.0, 8)
    x, y, z = made.vertices.T.astype(np.float64)
    vertices = np.column_stack([x, y, 0.1 * (x**2 - y**2)]).astype(np.float32)
    normals = np.column_stack([-0.2 * x, 0.2 * y, np.ones_like(z)])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return replace(made, vertices=vertices, normals=normals[made.triangles].astype(np.float32))


def bumpy(sheet: Sheet) -> Sheet:
    """With normals of the texels' own."""
    tilt = 0.3 * np.random.default_rng(3).standard_normal((*sheet.owner.shape, 3)) * (1.0, 1.0, 0.0)
    normals = tilt + np.array([0.0, 0.0, 1.0])
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    sheet.surface = replace(sheet.surface, texel_normals=normals.astype(np.float32))
    sheet.surface_filter = surface_filter.SurfaceFilter(sheet.surface)
    return sheet


@pytest.mark.parametrize("exponent", [1.0, 30.0])
@pytest.mark.parametrize("name", ["floor", "bumpy", "saddle"])
def test_point_by_point_they_are_the_same(name: str, exponent: float) -> None:
    """Four clusters beside one another, in whose quads texels have unlike numbers of rays: none is asked as a whole."""
    sheet = Sheet(saddle() if name == "saddle" else shapes.plane(), 8)
    sheet = bumpy(sheet) if name == "bumpy" else sheet
    precision = np.where(np.add.outer(np.arange(8, dtype=np.int64), np.arange(8, dtype=np.int64)) % 2 == 0, 1.0, 8.0)
    precision[2, 3] = precision[6, 6] = 0.0
    for seed in range(4):
        (value, error), (expected, expected_error) = both(sheet, map_of(sheet, precision, seed), exponent)
        assert_allclose(value, expected, atol=2e-5)
        assert_allclose(error, expected_error, rtol=2e-3, atol=1e-8)


@pytest.mark.parametrize("even", [True, False])
@pytest.mark.parametrize("name", list(MESHES))
def test_quads_and_clusters_stand_for_their_points(name: str, even: bool) -> None:
    """What comes of it is another weighting of the same neighbours, no worse a filter."""
    sheet = Sheet(MESHES[name], 32)
    blocks = np.add.outer(np.arange(32, dtype=np.int64) // 8, np.arange(32, dtype=np.int64) // 8) % 2
    images = map_of(sheet, np.where(even, 1.0, 1.0 + 7.0 * blocks), 7)
    (value, error), (expected, expected_error) = both(sheet, images)
    truth = waves(sheet)[sheet.owned]
    assert rms(value - expected) < 0.1 * NOISE
    assert rms(value - truth) < 1.12 * rms(expected - truth)
    assert error.mean() == pytest.approx(expected_error.mean(), rel=0.15)
