"""Elementary functions from arrays: numpy's values, but for the last bits."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from occlusion_bake.core.base import elementary

UNITS = 4.0 * np.finfo(np.float64).eps


@pytest.mark.parametrize(
    ("name", "low", "high"),
    [
        ("sin", -9.0, 9.0),
        ("cos", -9.0, 9.0),
        ("exp", -700.0, 700.0),
        ("log", 1e-9, 1e9),
        ("log1p", -1.0, 9.0),
        ("arccos", -1.0, 1.0),
        ("arcsin", -1.0, 1.0),
    ],
)
def test_they_are_numpys(name: str, low: float, high: float) -> None:
    x = np.random.default_rng(1).uniform(low, high, (3, 1000))
    assert_allclose(getattr(elementary, name)(x), getattr(np, name)(x), rtol=UNITS, atol=UNITS)


def test_angles_of_vectors_are_numpys() -> None:
    y, x = np.random.default_rng(1).normal(size=(2, 1000))
    assert_allclose(elementary.arctan2(y, x), np.arctan2(y, x), rtol=UNITS)
    assert_allclose(elementary.arctan2(1.0, x[:, np.newaxis]), np.arctan2(1.0, x[:, np.newaxis]), rtol=UNITS)


def test_shapes_stay() -> None:
    assert elementary.cos(0.0).shape == () and float(elementary.cos(0.0)) == 1.0
    assert elementary.exp(np.zeros((0, 3))).shape == (0, 3)
    strided = np.arange(12.0).reshape(3, 4)[:, ::2]
    assert_array_equal(elementary.sin(strided), elementary.sin(strided.copy()))


def test_powers_in_single_precision() -> None:
    x = np.random.default_rng(2).uniform(0.3, 1.0, (7, 11)).astype(np.float32)
    assert_allclose(elementary.powers(x, 10.0), x.astype(np.float64) ** 10, rtol=4e-6)
    assert_allclose(elementary.power(x, 10.0), x.astype(np.float64) ** 10, rtol=1e-14)


def test_products() -> None:
    a, b = (np.random.default_rng(3).normal(size=shape).astype(np.float32) for shape in ((70, 33), (33, 9)))
    assert_allclose(elementary.product(a, b), a.astype(np.float64) @ b.astype(np.float64), atol=1e-5)
    assert_array_equal(elementary.product(a, b, threads=1), elementary.product(a[:, :], b, threads=3))
    assert elementary.product(a[:0], b).shape == (0, 9)
