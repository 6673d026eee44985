"""Visibility in spherical harmonics: the basis, the fit, and RO that is rebuilt, against what is known exactly."""

from __future__ import annotations

from collections.abc import Callable
from math import pi, sqrt
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from occlusion_bake.core.base.errors import InputError
from occlusion_bake.core.spherical.hemisphere_cells import directions, subcells
from occlusion_bake.core.spherical.lobe import open_horizon
from occlusion_bake.core.spherical.spherical_harmonics import basis, bounds, fit, lobe_terms, orders, rebuild

DEGREES = range(1, 7)
EXPONENTS = (0.0, 0.5, 1.0, 2.0, 10.0, 32.0, 100.0, 1000.0)
Doubles = np.ndarray[Any, Any]


def ways(count: int, seed: int = 0) -> Doubles:
    """Uniform over the hemisphere."""
    return directions(*np.random.default_rng(seed).random((2, count)))


def about(cosines: Doubles, seed: int = 0) -> Doubles:
    """Directions of those heights, each at an azimuth of its own."""
    turn = 2 * pi * np.random.default_rng(seed).random(len(cosines))
    sine = np.sqrt(1 - cosines**2)
    return np.stack([sine * np.cos(turn), sine * np.sin(turn), cosines], axis=1)


def test_the_basis_is_orthonormal_over_the_sphere() -> None:
    z, shares = np.polynomial.legendre.leggauss(16)
    height, turn = np.meshgrid(z, np.arange(32, dtype=np.int64) * pi / 16, indexing="ij")
    sine = np.sqrt(1 - height**2)
    sphere = np.stack([sine * np.cos(turn), sine * np.sin(turn), height], axis=-1).reshape(-1, 3)
    values = basis(sphere, 6)
    assert_allclose((values * np.repeat(shares, 32)[:, None] * pi / 16).T @ values, np.eye(49), atol=1e-12)


def test_order_signs_and_size() -> None:
    at = ways(50)
    x, y, z = at.T
    values = basis(at, 3).T
    assert_allclose(values[0], sqrt(1 / (4 * pi)))
    assert_allclose(values[1:4], sqrt(3 / (4 * pi)) * np.stack([y, z, x]), atol=1e-12)
    quadratic = np.stack([x * y, y * z, (3 * z * z - 1) / sqrt(12), x * z, (x * x - y * y) / 2])
    assert_allclose(values[4:9], sqrt(15 / (4 * pi)) * quadratic, atol=1e-12)
    assert_allclose(values[15], sqrt(35 / (32 * pi)) * (x**3 - 3 * x * y * y), atol=1e-12)
    assert_allclose(values[9], sqrt(35 / (32 * pi)) * (3 * x * x * y - y**3), atol=1e-12)
    assert list(orders(2)) == [(0, 0), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2)]


@pytest.mark.parametrize("degree", DEGREES)
@pytest.mark.parametrize("side", [8, 16])
def test_constants_come_out_exactly(degree: int, side: int) -> None:
    for constant in (0.0, 0.25, 1.0):
        code = fit(np.full((1, side, side), constant, np.float32), degree)
        assert code.shape == (1, (degree + 1) ** 2) and code.dtype == np.float32
        assert_allclose(code[0], [constant * sqrt(4 * pi), *[0] * (code.size - 1)], atol=3e-5)


@pytest.mark.parametrize("degree", [2, 3, 4])
def test_what_the_degree_can_tell_is_found_again(degree: int) -> None:
    """Up to the regularisation, which may shrink what the hemisphere hardly tells from something else."""
    rng = np.random.default_rng(degree)
    pieces = subcells(16, 8)
    shapes = basis(pieces.reshape(-1, 3), degree) @ rng.normal(size=((degree + 1) ** 2, 20))
    low, high = shapes.min(axis=0), shapes.max(axis=0)
    cells = ((shapes - low) / (high - low)).reshape(16, 16, 64, 20).mean(axis=2)
    code = fit(np.moveaxis(cells, 2, 0).astype(np.float32), degree)
    at = ways(300, seed=9)
    true = (basis(at, degree) @ np.linalg.lstsq(basis(pieces.reshape(-1, 3), degree), shapes, rcond=None)[0] - low) / (
        high - low
    )
    assert np.sqrt(np.mean((basis(at, degree) @ code.T.astype(np.float64) - true) ** 2)) < 0.012


@pytest.mark.parametrize("degree", DEGREES)
@pytest.mark.parametrize("exponent", EXPONENTS)
def test_an_open_texel_is_the_open_horizon(degree: int, exponent: float) -> None:
    reflected = about(np.linspace(0, 1, 201))
    code = np.repeat(fit(np.ones((1, 8, 8), np.float32), degree), len(reflected), axis=0)
    tolerance = 2e-5 if exponent < 100 else 1e-6 * exponent  # linear between the table's angles
    assert_allclose(rebuild(code, reflected, exponent), open_horizon(exponent, reflected[:, 2]), atol=tolerance)
    assert_array_equal(rebuild(0 * code, reflected, exponent), 0.0)


@pytest.mark.parametrize("exponent", [0.0, 1.0, 10.0, 100.0])
def test_about_the_normal_the_terms_are_the_lobes_moments(exponent: float) -> None:
    """(e+1) ∫₀¹ uᵉ P_l(u) du √((2l+1)/(4π)), and 0 of all that turns about the normal."""
    terms = lobe_terms(exponent, np.array([1.0]), 3)[0]
    first, second, third = ((exponent + 1) / (exponent + 1 + power) for power in (1, 2, 3))
    moments = [1.0, first, (3 * second - 1) / 2, (5 * third - 3 * first) / 2]
    for (l, m), term in zip(orders(3), terms, strict=True):  # noqa: E741
        assert term == pytest.approx(0.0 if m else moments[l] * sqrt((2 * l + 1) / (4 * pi)), abs=1e-10)


@pytest.mark.parametrize("exponent", [1.0, 10.0, 60.0])
def test_any_code_is_integrated_over_the_clipped_lobe(exponent: float) -> None:
    """Against a plain sum over 2^18 directions, whose step tells on a narrow lobe at the horizon."""
    grid = subcells(1, 512)[0]
    values = basis(grid, 6)
    rng = np.random.default_rng(3)
    reflected = about(np.linspace(0.02, 1.0, 12))
    code = 0.1 * rng.normal(size=(12, 49))
    code[:, 0] += 1.8  # so that nothing is clipped to 0 or to H
    lobe = (exponent + 1) * np.maximum(reflected @ grid.T, 0) ** exponent
    expected = np.einsum("ng,ng->n", lobe, code @ values.T) / len(grid)
    assert_allclose(rebuild(code.astype(np.float32), reflected, exponent), expected, atol=5e-4)


def test_a_half_open_texel_from_in_between() -> None:
    """Open where x > 0, and R in the plane of the edge: half of the open horizon, of every degree and exponent."""
    cells = np.zeros((1, 16, 16), np.float32)
    cells[:, :, 8:] = 1.0
    heights = np.linspace(0.05, 1, 20)
    reflected = np.stack([0 * heights, np.sqrt(1 - heights**2), heights], axis=1)
    for degree in DEGREES:
        code = np.repeat(fit(cells, degree), 20, axis=0)
        for exponent in (1.0, 10.0, 100.0):
            half = 0.5 * open_horizon(exponent, heights)
            assert_allclose(rebuild(code, reflected, exponent), half, atol=1e-4)


def test_turned_by_a_right_angle_with_the_view_it_is_the_same() -> None:
    cells = np.random.default_rng(5).random((40, 16, 16)).astype(np.float32)
    reflected = ways(40, seed=6)
    turned = np.rot90(cells, -1, axes=(1, 2))  # rows run along v: x goes to y
    quarter = reflected @ np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    assert_allclose(rebuild(fit(cells, 4), reflected, 20), rebuild(fit(turned, 4), quarter, 20), atol=2e-5)


def test_values_stay_between_none_and_the_open_horizon() -> None:
    cells = (np.random.default_rng(7).random((500, 16, 16)) < 0.5).astype(np.float32)
    cells[:250, :, :8], cells[:250, :, 8:] = 0.0, 1.0
    reflected = ways(500, seed=8)
    for exponent in (1.0, 100.0):
        values = rebuild(fit(cells, 6), reflected, exponent)
        open_ones = open_horizon(exponent, reflected[:, 2])
        assert values.min() >= 0.0 and np.all(values <= open_ones + 1e-4)
    assert (values == 0.0).any()


@pytest.mark.parametrize("degree", DEGREES)
def test_no_cells_leave_the_bounds_and_some_reach_them(degree: int) -> None:
    """The fit is linear, so that each coefficient is least and greatest at cells that are 0 or 1: it is enough to open
    those that add to it, which fitting them one by one tells."""
    low, high = bounds(degree)
    rows = fit(np.eye(256, dtype=np.float32).reshape(256, 16, 16), degree).astype(np.float64)
    assert_allclose(np.maximum(rows, 0).sum(axis=0), high, atol=1e-4)
    assert_allclose(np.minimum(rows, 0).sum(axis=0), low, atol=1e-4)
    extreme = fit((rows.T > 0).reshape(-1, 16, 16).astype(np.float32), degree)
    assert_allclose(np.diag(extreme), high, atol=1e-4)
    drawn = fit((np.random.default_rng(degree).random((2000, 16, 16)) < 0.5).astype(np.float32), degree)
    assert np.all(drawn > low) and np.all(drawn < high)
    assert_allclose((low + high) / 2, [sqrt(pi), *[0] * (low.size - 1)], atol=1e-5)
    assert high.max() < 8.5


@pytest.mark.parametrize("degree", DEGREES)
def test_codes_of_coarse_cells_keep_the_bounds(degree: int) -> None:
    low, high = bounds(degree)
    rows = fit(np.eye(64, dtype=np.float32).reshape(64, 8, 8), degree)
    assert np.all(np.maximum(rows, 0).sum(axis=0) <= high + 1e-4)
    assert np.all(np.minimum(rows, 0).sum(axis=0) >= low - 1e-4)


def test_below_the_horizon_it_is_as_on_it() -> None:
    code = fit(np.random.default_rng(2).random((3, 16, 16)).astype(np.float32), 3)
    level = about(np.zeros(3))
    below = level * 0.8 - np.array([0, 0, 0.6])
    assert_allclose(rebuild(code, below, 10), rebuild(code, level, 10), atol=1e-6)
    assert np.isfinite(rebuild(code, np.float64([[0, 0, -1]] * 3), 10)).all()


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: fit(np.ones((1, 8, 8), np.float32), 0), "degree 0"),
        (lambda: fit(np.ones((1, 8, 8), np.float32), 7), "degree 7"),
        (lambda: fit(np.ones((1, 4, 4), np.float32), 3), "4 x 4"),
        (lambda: bounds(7), "degree 7"),
        (lambda: rebuild(np.ones((1, 10), np.float32), np.float64([[0, 0, 1]]), 10), "10 coefficients"),
        (lambda: rebuild(np.ones((1, 9), np.float32), np.float64([[0, 0, 1]]), -1), "exponent -1"),
        (lambda: rebuild(np.ones((1, 9), np.float32), np.float64([[0, 0, 1]]), float("nan")), "exponent nan"),
    ],
)
def test_what_cannot_be_is_refused_in_a_line(call: Callable[[], object], said: str) -> None:
    with pytest.raises(InputError, match=said) as refusal:
        call()
    assert "\n" not in str(refusal.value)
