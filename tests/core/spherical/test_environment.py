"""Light from far away: its map, its energy, the tables it is drawn from, and the light of open surfaces."""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from occlusion_bake.core.base.errors import InputError
from occlusion_bake.core.spherical.direction_table import SphereTable
from occlusion_bake.core.spherical.environment import (
    Environment,
    from_equirectangular,
    from_function,
    from_octahedral,
    open_light,
)
from occlusion_bake.core.spherical.equirectangular import pixel_angles
from occlusion_bake.core.spherical.octahedral_map import (
    cell_of,
    directions,
    middles,
    octahedral,
    sample_weights,
    solid_angles,
)
from occlusion_bake.tests.oracles.light import energy

UP = np.array([[0.0, 0.0, 1.0]])
Doubles = np.ndarray[Any, Any]


def ways(count: int, seed: int = 0) -> Doubles:
    """Uniform over the sphere."""
    vectors = np.random.default_rng(seed).normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def grey(values: Doubles) -> Doubles:
    return np.repeat(values[..., np.newaxis], 3, axis=-1)


def turned() -> Doubles:
    """A rotation that is none about an axis of the frame."""
    return np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0] * [[1.0], [1.0], [-1.0]]


def lit_cell(environment_size: int, way: Doubles, radiance: float, ground: float = 0.0) -> Environment:
    """A sun of one cell."""
    values = np.full((environment_size**2, 3), ground, np.float32)
    values[cell_of(octahedral(way), environment_size)] = radiance
    return Environment(values.reshape(environment_size, environment_size, 3))


# The map


def test_there_and_back() -> None:
    there = ways(10000)
    points = octahedral(there)
    assert np.abs(points).max() <= 1.0
    assert_allclose(directions(points), there, atol=1e-12)


def test_axes_and_the_fold() -> None:
    axes = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]], dtype=np.float64)
    assert_allclose(octahedral(axes), [[1, 0], [-1, 0], [0, 1], [0, -1], [0, 0]])
    assert_allclose(octahedral(np.array([0.0, 0.0, -1.0])), [1, 1])  # a sign of 0 is +1
    down = np.array([-0.1, 0.2, -0.7])
    assert_allclose(octahedral(down), [-(1 - 0.2), 1 - 0.1])
    assert_allclose(directions(np.array([-0.8, 0.9])), down / np.linalg.norm(down), atol=1e-12)


def test_rows_go_by_y_and_columns_by_x() -> None:
    assert cell_of(octahedral(np.array([0.9, 0.05, 0.05])), 8) == 4 * 8 + 7
    assert cell_of(np.array([[-1.0, -1.0], [1.0, 1.0], [1.0, -1.0]]), 8).tolist() == [0, 63, 7]


@pytest.mark.parametrize("n", [2, 4, 32, 256])
def test_solid_angles_are_those_of_the_sphere(n: int) -> None:
    angles = solid_angles(n)
    assert angles.sum() == pytest.approx(4 * pi, rel=1e-12)
    assert_allclose(angles, angles.T, rtol=1e-9)
    assert_allclose(angles, angles[::-1], rtol=1e-9)
    if n > 2:  # 1/s³ over the cell, by many samples
        steps = np.abs(directions(middles(1024))).sum(axis=-1) ** 3 * 4.0 / 1024**2
        assert_allclose(steps.reshape(n, 1024 // n, n, 1024 // n).sum(axis=(1, 3)), angles, rtol=2e-3)


def test_counted_directions_fill_cells_by_solid_angle() -> None:
    count = 1 << 18
    found = np.bincount(cell_of(octahedral(ways(count)), 16), minlength=256)
    expected = solid_angles(16).ravel() * count / (4 * pi)
    statistic = ((found - expected) ** 2 / expected).sum()
    assert abs(statistic - 255) < 4.5 * np.sqrt(2 * 255)  # chi-square with 255 degrees of freedom: p = 1e-5


# What it is made from


def test_a_function_comes_to_its_means() -> None:
    environment = from_function(lambda way: 2.0 + way, 64)
    assert_allclose(energy(environment), 8 * pi, rtol=1e-5)
    across = np.sqrt(solid_angles(64)).max()
    assert_allclose(environment.radiance, 2.0 + directions(middles(64)), atol=0.2 * across)


def test_a_finer_map_comes_to_its_means() -> None:
    fine = np.random.default_rng(1).random((64, 64, 3))
    environment = from_octahedral(fine, 16)
    weights = sample_weights(16, 4)
    assert_allclose(energy(environment), (fine * weights[..., np.newaxis]).sum(axis=(0, 1)), rtol=1e-6)
    assert_array_equal(from_octahedral(fine, 64).radiance, fine.astype(np.float32))


def test_an_image_lies_as_in_blender() -> None:
    """The middle along +x, the left quarter along +y, the top up."""
    pixels = np.zeros((64, 128, 3), np.float32)
    pixels[31:33, 63:65, 0] = 1.0
    pixels[31:33, 31:33, 1] = 1.0
    pixels[:2, :, 2] = 1.0
    environment = from_equirectangular(pixels, 32)
    for channel, way in enumerate(np.eye(3)):
        seen = environment.radiance[..., channel].reshape(-1)
        centre = (seen * solid_angles(32).ravel()) @ directions(middles(32)).reshape(-1, 3)
        assert_allclose(centre / np.linalg.norm(centre), way, atol=1e-3)


def test_a_rotation_goes_from_the_world_to_the_image() -> None:
    pixels = np.zeros((64, 128, 3), np.float32)
    pixels[31:33, 63:65] = 1.0  # along the image's +x
    environment = from_equirectangular(pixels, 64, turned())
    centre = (environment.luminance * solid_angles(64)).ravel() @ directions(middles(64)).reshape(-1, 3)
    assert_allclose(centre / np.linalg.norm(centre), turned()[0], atol=2e-3)


@pytest.mark.parametrize("size", [(16, 32), (512, 1024)])
def test_an_even_image_stays_even(size: tuple[int, int]) -> None:
    environment = from_equirectangular(np.full((*size, 3), 0.25, np.float32), 32, turned())
    assert_allclose(environment.radiance, 0.25, rtol=1e-6)


@pytest.mark.parametrize(("row", "rotation"), [(0, None), (250, None), (137, turned()), (511, turned())])
def test_the_energy_of_one_bright_pixel_is_kept(row: int, rotation: Doubles | None) -> None:
    pixels = np.full((512, 1024, 3), 1e-3, np.float32)
    pixels[row, 700] = (1e6, 5e5, 2e5)
    wanted = (pixels.astype(np.float64) * pixel_angles((512, 1024))[..., np.newaxis]).sum(axis=(0, 1))
    assert_allclose(energy(from_equirectangular(pixels, 64, rotation)), wanted, rtol=1e-3)


def test_the_energy_of_a_rough_image_is_kept() -> None:
    pixels = np.random.default_rng(3).lognormal(0.0, 1.0, (128, 256, 3)).astype(np.float32)
    wanted = (pixels * pixel_angles((128, 256))[..., np.newaxis]).sum(axis=(0, 1), dtype=np.float64)
    assert_allclose(energy(from_equirectangular(pixels, 64)), wanted, rtol=1e-3)


# Drawing directions


def shades(n: int = 32, seed: int = 4) -> Environment:
    """Over seven decades, a third of it black, and two rows as a whole."""
    generator = np.random.default_rng(seed)
    values = generator.lognormal(0.0, 4.0, (n, n, 3)) * (generator.random((n, n, 1)) > 0.33)
    values[3] = values[-1] = 0.0
    return Environment(values.astype(np.float32))


@pytest.mark.parametrize("environment", [shades(), Environment(np.zeros((16, 16, 3), np.float32)), shades(256)])
def test_tables_end_in_one_and_tell_their_density(environment: Environment) -> None:
    n, sampling = len(environment.radiance), environment.sampling
    for table, shape in ((sampling.rows, (n,)), (sampling.columns, (n, n)), (sampling.density, (n, n))):
        assert table.dtype == np.float32 and table.shape == shape and table.flags["C_CONTIGUOUS"]
    assert sampling.rows[-1] == 1.0 and (sampling.columns[:, -1] == 1.0).all()
    assert (np.diff(sampling.rows) >= 0.0).all() and (np.diff(sampling.columns, axis=1) >= 0.0).all()
    rows = np.diff(sampling.rows.astype(np.float64), prepend=0.0)
    cells = rows[:, np.newaxis] * np.diff(sampling.columns.astype(np.float64), axis=1, prepend=0.0)
    assert_allclose(sampling.density, cells * n * n / 4, rtol=1e-7)
    if environment.luminance.any():
        assert ((cells > 0.0) == (environment.luminance > 0.0)).all()
    weights = environment.luminance * solid_angles(n) if environment.luminance.any() else solid_angles(n)
    assert_allclose(cells, weights / weights.sum(), atol=2.0**-23 * n)


def drawn(environment: Environment, count: int) -> tuple[np.ndarray[Any, Any], Doubles]:
    """Cells and directions, as a tracer draws them."""
    n, sampling = len(environment.radiance), environment.sampling
    u = np.random.default_rng(6).random((count, 4))
    row = np.searchsorted(sampling.rows, u[:, 0], side="right")
    column = (sampling.columns[row] <= u[:, 1:2]).sum(axis=1)
    points = 2.0 * (np.stack([column, row], axis=1) + u[:, 2:]) / n - 1.0
    return row * n + column, directions(points)


def test_drawn_cells_are_in_proportion_to_luminance() -> None:
    environment, count = shades(16), 1 << 17
    cells, drawn_ways = drawn(environment, count)
    assert_array_equal(cells, cell_of(octahedral(drawn_ways), 16))
    weights = (environment.luminance * solid_angles(16)).ravel()
    expected = count * weights / weights.sum()
    found = np.bincount(cells, minlength=256)
    often = expected > 8.0
    rest = np.array([found[~often].sum(), expected[~often].sum()])
    statistic = ((found - expected)[often] ** 2 / expected[often]).sum() + (rest[0] - rest[1]) ** 2 / max(rest[1], 1.0)
    freedom = np.count_nonzero(often)
    assert freedom > 10 and abs(statistic - freedom) < 4.5 * np.sqrt(2 * freedom)


def test_light_over_density_is_the_energy() -> None:
    environment = shades(16)
    cells, drawn_ways = drawn(environment, 1 << 16)
    s = np.abs(drawn_ways).sum(axis=1)
    density = environment.sampling.density.ravel()[cells] / s**3
    found = environment.luminance.ravel()[cells] / density
    wanted = (environment.luminance * solid_angles(16)).sum()
    assert abs(found.mean() - wanted) < 4.5 * found.std() / np.sqrt(len(found))
    assert found.std() / found.mean() < 1.0  # of cells alike in light they differ by s³ within a cell


# The light of open surfaces


@pytest.mark.parametrize(("exponent", "within"), [(0, 1e-5), (0.5, 1e-3), (1, 1e-4), (10, 1e-4), (300, 1e-3)])
def test_an_even_sky_gives_its_own_light(exponent: float, within: float) -> None:
    environment = Environment(np.full((64, 64, 3), (0.5, 1.0, 2.0), np.float32))
    normals = ways(100)
    assert_allclose(
        open_light(environment, normals, normals, exponent), np.tile((0.5, 1.0, 2.0), (100, 1)), rtol=within
    )


def test_a_sky_that_is_linear_in_height() -> None:
    """∫ (a + b z) cos/π = a + 2b/3 for a surface that faces up."""
    environment = from_function(lambda way: 1.0 + grey(way[:, 2]) * (0.0, 0.5, 0.9), 128)
    assert_allclose(open_light(environment, UP, UP, 1.0), [1.0 + np.array((0.0, 0.5, 0.9)) * 2 / 3], rtol=2e-4)
    normals = ways(50)
    wanted = 1.0 + normals[:, 2:] * (0.0, 0.5, 0.9) * 2 / 3
    assert_allclose(open_light(environment, normals, normals, 1.0), wanted, atol=3e-4)


def test_a_cap_of_light() -> None:
    """Of a lobe about its axis the cone of half-angle β holds 1 − cosᵉ⁺¹ β."""
    environment = from_function(lambda way: grey((way[:, 2] > np.cos(0.5)) * 1.0), 256)
    for exponent in (1.0, 20.0):
        wanted = 1.0 - np.cos(0.5) ** (exponent + 1.0)
        assert_allclose(open_light(environment, UP, UP, exponent), wanted, rtol=1e-3)
        assert_allclose(open_light(environment, -UP, -UP, exponent), 0.0, atol=1e-12)


def test_a_sun_of_one_cell_is_where_it_is() -> None:
    way = np.array([0.48, 0.6, 0.64])
    environment = lit_cell(256, way, 1e5)
    shine = 1e5 * solid_angles(256).ravel()[cell_of(octahedral(way), 256)]
    normals = ways(400)
    cosine = np.maximum(normals @ way, 0.0)
    assert_allclose(open_light(environment, normals, normals, 1.0)[:, 0], shine / pi * cosine, atol=0.01 * shine / pi)
    lobe = 11.0 / (2.0 * pi) * cosine**10
    assert_allclose(open_light(environment, normals, normals, 10.0)[:, 0], shine * lobe, atol=0.02 * shine * lobe.max())


def test_what_is_below_the_horizon_gives_nothing() -> None:
    environment = lit_cell(64, np.array([0.0, 0.6, -0.8]), 100.0)
    axes = np.array([[0.0, 0.995, 0.0998]])
    axes /= np.linalg.norm(axes)
    assert_array_equal(open_light(environment, axes, UP, 4.0), 0.0)
    assert (open_light(environment, axes, axes, 4.0) > 1e-3).all()


def sky(way: Doubles) -> Doubles:
    """A gradient, a hard horizon, and clouds."""
    x, y, z = way.T
    light = 0.3 + 0.2 * z + 0.5 * (z > 0.0) * (1.0 + np.sin(5 * x + 3 * y) * np.cos(7 * y))
    return light[:, np.newaxis] * (1.0, 0.8, 1.2)


@pytest.mark.parametrize("exponent", [0.0, 1.0, 10.0, 100.0])
def test_open_light_is_what_random_directions_find(exponent: float) -> None:
    """Lobes that lean, so that the horizon cuts them, in a sky with a sun; by the lobe's own directions."""
    radiance = from_function(sky, 64).radiance.copy()
    radiance.reshape(-1, 3)[cell_of(octahedral(np.array([0.48, 0.6, 0.64])), 64)] += 50.0
    environment, generator = Environment(radiance), np.random.default_rng(8)
    for axis, normal in zip(ways(8, 1), ways(8, 2), strict=True):
        normal = normal * (1.0 if axis @ normal > 0.0 else -1.0)
        cosine = generator.random(1 << 16) ** (1.0 / (exponent + 1.0))
        turn, sine = 2 * pi * generator.random(1 << 16), np.sqrt(1.0 - cosine**2)
        side = np.cross(axis, UP[0]) / np.linalg.norm(np.cross(axis, UP[0]))
        lobe = np.outer(sine * np.cos(turn), side) + np.outer(sine * np.sin(turn), np.cross(axis, side))
        lobe += np.outer(cosine, axis)
        found = radiance.reshape(-1, 3)[cell_of(octahedral(lobe), 64)] * (lobe @ normal > 0.0)[:, np.newaxis]
        light = open_light(environment, axis[np.newaxis], normal[np.newaxis], exponent)[0]
        slack = 4e-3 * environment.radiance.mean()
        assert (np.abs(found.mean(axis=0) - light) < 4.5 * found.std(axis=0) / 256 + slack).all()


@pytest.mark.parametrize("exponent", [1.0, 8.0])
def test_many_normals_get_what_few_get(exponent: float) -> None:
    radiance = from_function(sky, 64).radiance.copy()
    radiance.reshape(-1, 3)[cell_of(octahedral(np.array([0.48, 0.6, 0.64])), 64)] += 2000.0
    environment = Environment(radiance)
    normals = ways(1 << 13)
    many, few = open_light(environment, normals, normals, exponent), normals[:200].copy()
    assert_allclose(many[:200], open_light(environment, few, few, exponent), rtol=2e-3)


def test_threads_change_no_bit() -> None:
    environment, axes, normals = from_function(sky, 64), ways(3000), ways(3000, 1)
    alone = open_light(environment, axes, normals, 10.0, threads=1)
    assert_array_equal(alone, open_light(environment, axes, normals, 10.0, threads=3))


def test_no_light_is_none() -> None:
    environment, normals = Environment(np.zeros((16, 16, 3), np.float32)), ways(1 << 13)
    assert_array_equal(open_light(environment, normals[:9], normals[9:18], 2.0), 0.0)
    assert_array_equal(open_light(environment, normals, normals, 1.0), 0.0)


def test_a_table_over_the_sphere_is_a_cubic_everywhere() -> None:
    def smooth(way: Doubles) -> Doubles:
        return np.stack([np.exp(way @ (0.3, -0.5, 0.8)), way[:, 0] * way[:, 1]], axis=1)

    at = np.concatenate([ways(2000), np.eye(3), -np.eye(3), ways(200) * (1e-4, 1e-4, 0.0) + UP])
    at /= np.linalg.norm(at, axis=1, keepdims=True)
    errors = [np.abs(SphereTable(smooth, rows)(at) - smooth(at)).max() for rows in (32, 64)]
    assert errors[0] < 1e-4
    assert errors[1] < errors[0] / 12  # by 16, as the fourth power


# What is refused


@pytest.mark.parametrize("n", [0, 1, 3, 48, 2048])
def test_sizes_that_no_map_has(n: int) -> None:
    with pytest.raises(InputError, match=r"size .*power of two"):
        from_equirectangular(np.ones((2, 4, 3), np.float32), n)


def test_shapes_that_are_no_map() -> None:
    for shape in ((4, 8, 3), (4, 4), (4, 4, 4)):
        with pytest.raises(InputError, match="shape"):
            Environment(np.ones(shape, np.float32))


@pytest.mark.parametrize("value", [np.nan, np.inf, -1e-3])
def test_values_that_are_no_light(value: float) -> None:
    pixels = np.ones((4, 4, 3), np.float32)
    pixels[1, 2, 0] = value
    cause = "below 0" if value == -1e-3 else "1 pixel is not finite"
    with pytest.raises(InputError, match=f"^Environment: .*{cause}"):
        Environment(pixels)
    with pytest.raises(InputError, match=cause):
        from_equirectangular(pixels, 4)
