"""The lobes and the BRDFs they come from, by quadrature: normalised, positive, no energy made, reciprocal."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from occlusion_bake.core.spherical import lobe as lobe_module
from occlusion_bake.tests.oracles.formulas import open_horizon
from occlusion_bake.tests.oracles.reference_lobes import (
    above_horizon,
    cosine_above_horizon,
    lambert_brdf,
    lobe,
    lobe_above_horizon,
    lobe_beyond,
    mirrored,
    over_lobe,
    phong_brdf,
)

EXPONENTS = (0.0, 0.5, 1.0, 2.0, 10.0, 64.0, 100.0, 1e3, 1e4, 1e6)
DEGREES = (0.0, 1.0, 20.0, 45.0, 60.0, 80.0, 85.0, 89.9, 90.0)
NORMAL = np.array([0.0, 0.0, 1.0])


def polar_nodes(exponent: float, low: float, high: float) -> tuple[np.ndarray, np.ndarray]:
    """Plain Gauss-Legendre in the angle itself, in pieces as narrow as the lobe."""
    node, weight = np.polynomial.legendre.leggauss(64)
    ends = np.minimum(high, low + np.concatenate([np.linspace(0.0, 8.0, 9) / np.sqrt(exponent + 1.0), [np.inf]]))
    half, middle = 0.5 * np.diff(ends)[:, None], 0.5 * (ends[1:] + ends[:-1])[:, None]
    return (middle + half * node).ravel(), (half * weight).ravel()


def random_directions(count: int, seed: int) -> np.ndarray:
    """(count, 3) uniform over the upper hemisphere."""
    vectors = np.random.default_rng(seed).normal(size=(count, 3))
    vectors[:, 2] = np.abs(vectors[:, 2])
    directions: np.ndarray = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    return directions


@pytest.mark.parametrize("exponent", EXPONENTS)
def test_a_lobe_is_positive_and_its_integral_is_1(exponent: float) -> None:
    polar, weight = polar_nodes(exponent, 0.0, np.pi / 2)
    values = lobe(np.cos(polar), exponent)
    assert np.all(values >= 0.0) and values.max() > 0.0
    assert np.all(lobe(np.cos(np.linspace(np.pi / 2 + 1e-6, np.pi, 99)), exponent) == 0.0)
    assert_allclose(2.0 * np.pi * np.sum(weight * np.sin(polar) * values), 1.0, rtol=1e-6 if exponent < 1 else 1e-9)


def test_the_lobe_of_exponent_1_is_lamberts() -> None:
    directions = random_directions(100, 1)
    cosine = directions @ NORMAL
    assert_allclose(lobe(cosine, 1.0), lambert_brdf(directions, directions) * cosine, rtol=1e-14)


@pytest.mark.parametrize("exponent", EXPONENTS)
def test_the_open_horizon_is_the_lobe_above_it(exponent: float) -> None:
    for degrees in (*DEGREES, 95.0, 120.0, 180.0):
        lean = np.radians(degrees)
        assert_allclose(open_horizon(exponent, lean), lobe_above_horizon(exponent, lean), atol=1e-6, err_msg=f"{lean}")


@pytest.mark.parametrize("exponent", EXPONENTS)
def test_the_table_of_open_horizons_agrees(exponent: float) -> None:
    """The one that an image is divided by; below the horizon it stays at a half."""
    exact = [lobe_above_horizon(exponent, np.radians(degrees)) for degrees in DEGREES]
    assert_allclose(lobe_module.open_horizon(exponent, np.cos(np.radians(DEGREES))), exact, atol=1e-6)


@pytest.mark.parametrize("degrees", DEGREES)
def test_lambert_keeps_its_energy_and_phong_makes_none(degrees: float) -> None:
    """Directional albedo: ∫ f dω of RO's own form, and ∫ f cos dω were f a BRDF under the rendering equation's cosine.

    RO's is the open horizon, 1 at most; with the cosine it is (e+1)/(e+2) at most, less than 1 for every e.
    """
    lean = np.radians(degrees)
    for exponent in EXPONENTS:
        polar, weight = over_lobe(exponent, [np.pi / 2 - lean])
        plain = np.sum(weight * above_horizon(polar, lean))
        weighted = np.sum(weight * cosine_above_horizon(polar, lean))
        assert 0.5 - 1e-9 <= plain <= 1.0 + 1e-12
        assert 0.0 < weighted <= (exponent + 1.0) / (exponent + 2.0) + 1e-9
    polar, weight = over_lobe(1.0)
    assert_allclose(np.sum(weight), 1.0, atol=1e-12)  # ∫ cos/π dω: what comes in goes out


@pytest.mark.parametrize("exponent", (0.0, 0.5, 1.0, 10.0, 100.0, 1e4))
def test_brdfs_are_reciprocal(exponent: float) -> None:
    """f(a, b) = f(b, a): R(a)·b = 2 (n·a)(n·b) − a·b is symmetric, so Phong as written is, too."""
    a, b = random_directions(2000, 2), random_directions(2000, 3)
    b[:1000] = mirrored(a[:1000], NORMAL) + 0.3 * (b[:1000] - 0.5) / np.sqrt(exponent + 1.0)  # within the lobe
    b /= np.linalg.norm(b, axis=1, keepdims=True)
    there, back = phong_brdf(a, b, NORMAL, exponent), phong_brdf(b, a, NORMAL, exponent)
    assert np.count_nonzero(there) >= 900
    assert_allclose(there, back, rtol=1e-13 * (exponent + 10.0), atol=1e-300)
    assert_allclose(lambert_brdf(a, b), 1.0 / np.pi, rtol=1e-15)


def test_the_lobe_read_as_brdf_times_cosine_is_not_reciprocal() -> None:
    """RO's integrand has no cosine: under the rendering equation it stands for f = lobe / (n·ω), which is one-sided."""
    a, b = np.array([0.6, 0.0, 0.8]), np.array([0.0, 0.0, 1.0])
    value = phong_brdf(a, b, NORMAL, 10.0)
    assert abs(value / b[2] - value / a[2]) > 0.2 * value


@pytest.mark.parametrize("exponent", (0.0, 1.0, 10.0, 1e4))
def test_the_two_quadratures_agree(exponent: float) -> None:
    """The check of the checks: shares beyond an angle, and the mean cosine (e+1)/(e+2)."""
    polar, weight = over_lobe(exponent)
    assert_allclose(np.sum(weight), 1.0, atol=1e-12)
    assert_allclose(np.sum(weight * np.cos(polar)), (exponent + 1.0) / (exponent + 2.0), atol=1e-9)
    edge = 0.7 / np.sqrt(exponent + 1.0)
    polar, weight = polar_nodes(exponent, edge, np.pi / 2)
    beyond = 2.0 * np.pi * np.sum(weight * np.sin(polar) * lobe(np.cos(polar), exponent))
    assert_allclose(beyond, lobe_beyond(edge, exponent), atol=1e-9)
    assert_allclose(above_horizon(np.array([0.0, 0.3, 3.0]), 0.5), [1.0, 1.0, 0.0])
