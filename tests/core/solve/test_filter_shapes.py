"""The filter on surfaces that turn: what has an edge stays sharp, what a normal explains is brought out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from occlusion_bake.core.base.arrays import Doubles
from occlusion_bake.core.base.vectors import unit
from occlusion_bake.core.scene.scene import Mesh
from occlusion_bake.core.solve.surface_filter import SurfaceFilter
from occlusion_bake.core.spherical.lobe import open_horizon
from occlusion_bake.tests.oracles import shapes
from occlusion_bake.tests.oracles.sheet import Sheet, rms

NOISE = 0.05
EXPONENTS = [1.0, 10.0, 100.0]


def faceted(values: Doubles, sheet: Sheet) -> Doubles:
    """One value a triangle."""
    return np.where(sheet.owned, values[np.maximum(sheet.owner, 0)], 0.0)


def away_from_poles(sheet: Sheet) -> np.ndarray:
    """Of a ball: where its texels are not much longer than wide."""
    rows = np.arange(len(sheet.owned), dtype=np.int64) / len(sheet.owned)
    return sheet.owned & (np.abs(rows - 0.5) < 0.3)[:, None]


@pytest.mark.parametrize("exponent", EXPONENTS)
@pytest.mark.parametrize("segments", [8, 12, 16])
def test_facets_stay_crisp_where_values_go_by_their_normals(segments: int, exponent: float) -> None:
    """A ball of flat sides, each with one value, by a function of its normal that is no linear one: what the filter
    makes of them without their noise, when it reckons with some, is their blur."""
    mesh = shapes.sphere(segments=segments, smooth=False)
    sheet = Sheet(mesh, 96)
    normals = shapes.face_normals(mesh)
    truth = faceted(0.5 + 0.3 * normals[:, 2] * normals[:, 0], sheet)
    blur = (sheet.filter(truth, NOISE**2, exponent=exponent, about_normal=True) - truth)[away_from_poles(sheet)]
    assert rms(blur) < 0.02 * NOISE
    assert np.abs(blur).max() < 0.1 * NOISE


def roof(degrees: float) -> Mesh:
    """Two flat sides that meet at an angle in the middle of the image."""
    turn = np.deg2rad(degrees)
    left = shapes.quad((-1, -1, 0), (1, 0, 0), (0, 2, 0), cell=(0, 0, 0.5, 1))
    right = shapes.quad((0, -1, 0), (np.cos(turn), 0, -np.sin(turn)), (0, 2, 0), cell=(0.5, 0, 1, 1))
    return shapes.joined([left, right])


@pytest.mark.parametrize("exponent", EXPONENTS)
@pytest.mark.parametrize("degrees", [15, 30, 60, 90])
def test_a_crease_stays_sharp(degrees: float, exponent: float) -> None:
    """Eight times the noise between one texel and the next, where normals turn at once, however little."""
    sheet = Sheet(roof(degrees))
    truth = np.where(sheet.owner >= 2, 0.7, 0.3)
    runs = [sheet.filter(sheet.noisy(truth, NOISE, seed), NOISE**2, exponent=exponent) - truth for seed in range(8)]
    across = np.mean(runs, axis=(0, 1))  # of 512 texels each, so that noise alone makes up 0.05 of it at most
    assert np.abs(across).max() < 0.3 * NOISE


@pytest.mark.parametrize("exponent", EXPONENTS)
@pytest.mark.parametrize("gap", [0.0005, 0.003, 0.03])
def test_light_stays_on_its_side_of_a_sheet(gap: float, exponent: float) -> None:
    """Thinner than a texel, bright above and dark below, to the rim, and no guide to tell them apart."""
    below = shapes.quad((-1, 1, 0), (2, 0, 0), (0, -2, 0), cell=(0, 0, 0.48, 0.48))
    above = shapes.quad((-1, -1, gap), (2, 0, 0), (0, 2, 0), cell=(0.52, 0.52, 1, 1))
    sheet = Sheet(shapes.joined([below, above]), 128)
    truth = np.where(sheet.owner >= 2, 0.9, 0.1) * sheet.owned
    assert np.abs(sheet.filter(truth, 100.0, exponent=exponent) - truth)[sheet.owned].max() < 1e-6


@pytest.mark.parametrize("exponent", EXPONENTS)
def test_values_linear_in_the_normal_come_out_of_the_noise(exponent: float) -> None:
    """On a ball, which is nowhere flat; a narrow lobe asks fewer."""
    sheet = Sheet(shapes.sphere(segments=48), 96)
    truth = np.where(sheet.owned, 0.5 + 0.2 * sheet.normals[..., 0] - 0.1 * sheet.normals[..., 2], 0.0)
    where = away_from_poles(sheet)
    noisy = sheet.filter(sheet.noisy(truth, NOISE, 1), NOISE**2, exponent=exponent) - truth
    assert rms(noisy[where]) < (0.2 if exponent < 50.0 else 0.33) * NOISE
    blur = sheet.filter(truth, NOISE**2, exponent=exponent) - truth
    assert rms(blur[where]) < 0.05 * NOISE


def test_values_linear_in_the_normals_of_a_map_come_out_of_the_noise() -> None:
    """Waves of 13 texels that turn them by up to 35 degrees, each against the next by up to 19: over a floor AO is half
    of 1 + n·up, which no two numbers about a texel's normal tell."""
    sheet = Sheet(shapes.plane(), 96)
    v, u = np.indices((96, 96)) * (2.0 * np.pi / 13.0)
    normals = unit(np.stack([0.7 * np.sin(u), 0.7 * np.sin(v), np.ones_like(u)], axis=2))
    sheet.surface = replace(sheet.surface, texel_normals=normals.astype(np.float32))
    sheet.surface_filter = SurfaceFilter(sheet.surface)
    truth = np.where(sheet.owned, 0.4 + 0.5 * normals[..., 2] + 0.1 * normals[..., 0], 0.0)
    assert rms((sheet.filter(sheet.noisy(truth, NOISE, 1), NOISE**2) - truth)[sheet.owned]) < 0.25 * NOISE
    assert rms((sheet.filter(truth, NOISE**2) - truth)[sheet.owned]) < 0.05 * NOISE


@pytest.mark.parametrize("exponent", EXPONENTS)
def test_open_shares_are_known_without_rays(exponent: float) -> None:
    """A body of few sides, shaded as if it were round, in the open: a texel is as open as its triangle lets it be."""
    sheet = Sheet(shapes.cylinder(height=6.28, segments=6), 96)
    cosines = np.einsum("ijk,ijk->ij", sheet.normals, sheet.face_normals)
    truth = np.where(sheet.owned, open_horizon(exponent, cosines), 0.0)
    made, without = (
        sheet.filter(truth, NOISE**2, exponent=exponent, about_normal=about) - truth for about in (True, False)
    )
    assert np.abs(made).max() < 2e-4
    assert exponent > 1.0 or rms(without) > 20 * rms(made)  # narrow lobes stay above the sides


def test_what_is_open_below_a_triangle_is_not_taken_for_closed() -> None:
    """Sheets let light through from below: a map that does not follow the open shares is filtered as without them."""
    sheet = Sheet(shapes.cylinder(height=6.28, segments=6), 96)
    truth = np.where(sheet.owned, 0.6, 0.0)
    errors = []
    for about in (True, False):
        runs = (
            sheet.filter(sheet.noisy(truth, NOISE, seed), NOISE**2, about_normal=about) - truth for seed in range(4)
        )
        errors.append(rms(np.stack(list(runs))))
    assert errors[0] < 1.1 * errors[1]
