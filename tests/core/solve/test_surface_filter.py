"""The filter: what it must leave alone, what it must bring out, and whom it may ask."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from occlusion_bake.core.bake import Baked
from occlusion_bake.core.scene.scene import Mesh, Scene
from occlusion_bake.core.solve.surface_filter import SurfaceFilter
from occlusion_bake.tests.oracles import shapes
from occlusion_bake.tests.oracles.bakes import bake_one
from occlusion_bake.tests.oracles.sheet import Sheet, ramp

SIDE = 64


@pytest.fixture(scope="module")
def flat() -> Sheet:
    return Sheet(shapes.plane(1.0))


@pytest.mark.parametrize("turned", [False, True])
def test_what_is_linear_on_a_plane_stays(turned: bool) -> None:
    """To the edges, where the neighbours lie on one side. Far ones are taken together, so those of a texel are not
    quite about it, and the ridge, a fiftieth of their spread, draws the slope to 0 by so much of what they are off."""
    plane = shapes.quad((-1, -1, 0.3), (2, 0.4, 0.1), (-0.3, 2, 0.5)) if turned else shapes.plane(1.0)
    sheet = Sheet(plane)
    filtered = sheet.filter(ramp(sheet), 0.04)
    inner = slice(8, -8)
    assert_allclose(filtered[inner, inner], ramp(sheet)[inner, inner], atol=1e-4)
    assert np.abs(filtered - ramp(sheet)).max() < 3e-3  # the ridge draws the slope towards 0 where one side is bare


def test_noise_falls_by_much_on_a_plane_and_the_mean_stays(flat: Sheet) -> None:
    rng = np.random.default_rng(1)
    noisy = ramp(flat) + 0.05 * rng.standard_normal((SIDE, SIDE))
    filtered = flat.filter(noisy, 0.05**2)
    assert np.sqrt(np.mean((filtered - ramp(flat)) ** 2)) < 0.05 / 5
    assert abs(np.mean(filtered - ramp(flat))) < 3 * 0.05 / SIDE


def test_where_there_is_no_noise_nothing_changes(flat: Sheet) -> None:
    detail = 0.5 + 0.3 * np.sign(
        np.sin(np.arange(SIDE, dtype=np.int64)[:, None] * 1.3) * np.cos(np.arange(SIDE, dtype=np.int64) * 2.1)
    )
    assert_allclose(flat.filter(detail, 0.0), detail, atol=1e-3)


def test_a_step_stays_sharp(flat: Sheet) -> None:
    """A contact shadow's edge: twelve times the noise high, one texel wide."""
    rng = np.random.default_rng(2)
    step = np.where(np.arange(SIDE, dtype=np.int64) < SIDE // 2, 0.2, 0.8) * np.ones((SIDE, 1))
    filtered = flat.filter(step + 0.05 * rng.standard_normal(step.shape), 0.05**2)
    beside = slice(SIDE // 2 - 1, SIDE // 2 + 1)
    assert np.sqrt(np.mean((filtered[:, beside] - step[:, beside]) ** 2)) < 0.05
    assert abs(np.mean((filtered - step)[:, beside], axis=0)).max() < 0.02


def test_detail_finer_than_the_filter_comes_through(flat: Sheet) -> None:
    """Values that go up and down from texel to texel by much more than their noise are no noise."""
    rng = np.random.default_rng(3)
    detail = rng.random((SIDE, SIDE))
    filtered = flat.filter(detail + 0.02 * rng.standard_normal(detail.shape), 0.02**2)
    assert np.sqrt(np.mean((filtered - np.clip(detail, 0, 1)) ** 2)) < 0.03


def values_by_side(sheet: Sheet, room: Mesh) -> np.ndarray:
    """One value for each of a room's sides, 0 to 1."""
    return np.where(sheet.owned, (sheet.owner // 2) / 5.0, 0.0)


def test_nothing_is_asked_round_an_edge() -> None:
    """Each side of a room has a value of its own, and so much noise that no guide tells them apart."""
    sheet = Sheet(shapes.room(), 96)
    value = values_by_side(sheet, shapes.room())
    filtered = sheet.filter(value, 100.0)
    assert_allclose(filtered[sheet.owned], value[sheet.owned], atol=1e-5)


def test_nothing_is_asked_through_a_wall() -> None:
    """Two sheets a tenth of a texel apart, back to back; two a few texels apart that face the same way."""
    for up, gap in ((-1.0, 0.003), (1.0, 0.15)):
        below = shapes.quad((-1, -1, 0), (2, 0, 0), (0, 2, 0), cell=(0.0, 0, 0.48, 0.48))
        above = shapes.quad((-1, -up, gap), (2, 0, 0), (0, 2 * up, 0), cell=(0.5, 0.5, 0.98, 0.98))
        sheet = Sheet(shapes.joined([below, above]), 128)
        value = np.where(sheet.owner >= 2, 0.9, 0.1) * sheet.owned
        assert_allclose(sheet.filter(value, 100.0)[sheet.owned], value[sheet.owned], atol=1e-4)


def test_neighbours_are_found_across_the_seam_of_charts() -> None:
    """A floor of two charts, far apart in the image and turned against each other, is filtered as one chart is."""
    left = shapes.quad((-1, -1, 0), (1, 0, 0), (0, 2, 0), cell=(0.0, 0.0, 0.25, 0.5))
    right = shapes.quad((0, -1, 0), (1, 0, 0), (0, 2, 0), cell=(0.75, 0.5, 1.0, 1.0))
    sheet = Sheet(shapes.joined([left, right]), 128)
    rng = np.random.default_rng(4)
    noisy = (ramp(sheet) + 0.05 * rng.standard_normal(sheet.owner.shape)) * sheet.owned
    error = sheet.filter(noisy, 0.05**2) - ramp(sheet)
    seam = sheet.owned & (np.abs(sheet.places[..., 0]) < 0.04)
    rim = sheet.owned & (np.abs(sheet.places[..., 0]) > 0.96)
    inner = sheet.owned & (np.abs(np.abs(sheet.places[..., 0]) - 0.5) < 0.2)

    def spread(where: np.ndarray) -> float:
        return float(np.sqrt(np.mean(error[where] ** 2)))

    assert spread(seam) < 1.2 * spread(inner)
    assert spread(rim) > 1.3 * spread(
        inner
    )  # the check of the check: at a real edge half of the neighbours are missing


def test_texels_without_rays_are_filled_from_their_neighbours(flat: Sheet) -> None:
    precision = np.zeros((SIDE, SIDE), dtype=np.float32)
    precision[::3, ::3] = 1.0
    value = np.where(precision > 0, ramp(flat), 0.77).astype(
        np.float32
    )  # what stands where there are no rays is no one's
    filtered, expected = flat.surface_filter.filter(value, np.full_like(value, 1e-4), precision)
    assert_allclose(filtered[4:-4, 4:-4], ramp(flat)[4:-4, 4:-4], atol=2e-3)
    assert expected.min() >= 0.0


def test_a_precise_value_counts_for_more(flat: Sheet) -> None:
    """Half of the texels have 64 times the rays; the others, beside them, gain."""
    rng = np.random.default_rng(5)
    precision = np.where(
        np.add.outer(np.arange(SIDE, dtype=np.int64), np.arange(SIDE, dtype=np.int64)) % 2 == 0, 1.0, 512.0
    ).astype(np.float32)
    noisy = (0.5 + 0.05 * rng.standard_normal((SIDE, SIDE)) / np.sqrt(precision)).astype(np.float32)
    noise = np.full((SIDE, SIDE), 0.05**2, dtype=np.float32)
    mixed, expected = flat.surface_filter.filter(noisy, noise, precision)
    even = flat.filter(0.5 + 0.05 * rng.standard_normal((SIDE, SIDE)), 0.05**2)
    crude = precision == 1.0
    assert np.sqrt(np.mean((mixed[crude] - 0.5) ** 2)) < 0.3 * np.sqrt(np.mean((even - 0.5) ** 2))
    assert expected[~crude].mean() < expected[crude].mean() + 1e-9


def test_plain_keeps_the_values_and_tells_their_noise(flat: Sheet) -> None:
    rng = np.random.default_rng(6)
    value = rng.random((SIDE, SIDE)).astype(np.float32)
    noise = (0.01 * rng.chisquare(1, (SIDE, SIDE))).astype(np.float32)
    kept, expected = flat.surface_filter.filter(value, noise, np.full_like(value, 2.0), plain=True)
    assert_array_equal(kept, value)
    assert expected.mean() == pytest.approx(0.005, rel=0.1)
    assert expected.std() < 0.5 * noise.std()  # crude estimates of neighbours are averaged


def test_the_number_of_threads_changes_no_bit() -> None:
    ball = shapes.sphere(segments=24)
    results = []
    for threads in (1, 3):
        sheet = Sheet(ball)
        sheet.surface_filter = SurfaceFilter(replace(sheet.surface, threads=threads))
        rng = np.random.default_rng(7)
        results.append(sheet.filter(rng.random((SIDE, SIDE)), 0.1))
    assert_array_equal(*results)


@pytest.mark.parametrize("factor", [1e-3, 1e3])
def test_size_does_not_matter(factor: float) -> None:
    rng = np.random.default_rng(8)
    value = rng.random((SIDE, SIDE))
    one, other = (Sheet(shapes.sphere(radius=radius, segments=24)).filter(value, 0.1) for radius in (1.0, factor))
    assert np.abs(one - other).mean() < 1e-3


@pytest.mark.parametrize("gap", [0.02, 0.1])
def test_a_thin_gap_keeps_its_shadow(gap: float) -> None:
    """Two walls with a slot between them, a texel or a few wide, on a floor: the light in it is left as it is."""
    walls = [shapes.quad((x, -2, 0), (0, 4, 0), (0, 0, 1.0), name=f"wall {x}") for x in (-gap / 2, gap / 2)]
    scene: Scene = shapes.scene(shapes.plane(1.0, name="floor"), *walls)
    truth: Baked = bake_one(scene, size=96, rays=4096, seed=9)
    sharp = bake_one(scene, size=96, rays=256, filtered=True).maps["ao"].values
    plain = bake_one(scene, size=96, rays=256).maps["ao"].values
    x = (np.arange(96, dtype=np.int64) + 0.5) / 48 - 1
    near = np.broadcast_to(np.abs(x) < gap / 2 + 0.06, (96, 96))

    def error(values: np.ndarray) -> float:
        return float(np.sqrt(np.mean((values - truth.maps["ao"].values)[near] ** 2)))

    assert error(sharp) < 1.2 * error(plain) + 0.002


def test_listed_texels_are_filtered_as_among_all(flat: Sheet) -> None:
    """Those without a filtered value of their own stay: here every one, for none has a place that is a number."""
    noisy = flat.noisy(ramp(flat), 0.05, 3)
    texels = np.flatnonzero(flat.owned)[::7]
    listed = flat.filter(noisy, 0.05**2, texels=texels).reshape(-1)[texels]
    assert_array_equal(listed, flat.filter(noisy, 0.05**2).reshape(-1)[texels])
    nowhere = Sheet(shapes.plane(1.0))
    nowhere.surface = replace(
        nowhere.surface,
        mesh=replace(nowhere.surface.mesh, vertices=np.full_like(nowhere.surface.mesh.vertices, np.nan)),
    )
    nowhere.surface_filter = SurfaceFilter(nowhere.surface)
    stays = nowhere.filter(noisy, 0.05**2, texels=texels)
    assert_array_equal(stays.reshape(-1)[texels], noisy.astype(np.float32).reshape(-1)[texels])
    assert np.count_nonzero(stays) <= len(texels)


@pytest.mark.parametrize("most", [200, 1000])
def test_a_filter_in_parts_is_the_same_filter(most: int) -> None:
    """An image too large to be held at once: every texel once, by the same neighbours."""
    sheet = Sheet(shapes.sphere())
    noisy = ramp(sheet) + 0.05 * np.random.default_rng(8).standard_normal(sheet.owner.shape)
    whole = sheet.filter(noisy, 0.05**2)
    sheet.surface_filter = SurfaceFilter(sheet.surface, most=most)
    assert_allclose(sheet.filter(noisy, 0.05**2), whole, atol=1e-6)


def test_parts_of_a_surface_without_extent() -> None:
    """All texels in one place: one part, however many they are."""
    sheet = Sheet(shapes.plane(1e-30))
    values = np.full(sheet.owner.shape, 0.25)
    sheet.surface_filter = SurfaceFilter(sheet.surface, most=100)
    assert_allclose(sheet.filter(values, 0.1)[sheet.owned], 0.25, atol=1e-6)
