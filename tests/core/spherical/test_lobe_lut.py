"""The lobe's image for a filter of cubic B-splines."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from occlusion_bake.core.spherical import spherical_harmonics
from occlusion_bake.core.spherical.lobe_lut import PADDED, SIDE, TILES, lobe_lut, lobe_splines

Array = np.ndarray[Any, Any]
COSINES = np.linspace(0.0, 0.999, 301)


def bicubic(image: Array, x: Array, y: float) -> Array:
    """A cubic B-spline's weights at texels (x, y), 0 the middle of the first: (N,), a number → (N, channels)."""

    def weights(away: Array) -> Array:
        away = np.abs(away)
        return np.where(away < 1, 2 / 3 - away**2 + away**3 / 2, np.maximum(2 - away, 0) ** 3 / 6)

    across, down = (weights(np.arange(PADDED, dtype=np.int64) - at) for at in (x[:, None], y))
    return np.einsum("nx,y,yxc->nc", across, down, image)


def tiles(image: Array) -> Array:
    """The terms as channels, side by side no longer."""
    return np.concatenate(np.split(image, TILES, axis=1), axis=2)[..., :10]


@pytest.fixture(scope="module")
def splines() -> Array:
    return lobe_splines()


def test_they_go_through_the_image(splines: Array) -> None:
    wanted = tiles(lobe_lut())
    assert splines.shape == (PADDED, TILES * PADDED, 3) and splines.dtype == np.float32
    for row in (0, 1, 30, SIDE - 1):
        found = bicubic(tiles(splines), np.arange(SIDE, dtype=np.int64) + 1.0, row + 1.0)
        assert_allclose(found, wanted[row], atol=2e-5)


@pytest.mark.parametrize("exponent", [1.0, 10.0, 37.0, 100.0, 300.0, 1000.0])
def test_between_texels_they_give_the_terms(splines: Array, exponent: float) -> None:
    row = np.sqrt(2 / (exponent + 2)) * (SIDE - 1)
    smooth = bicubic(tiles(splines), COSINES * (SIDE - 1) + 1, row + 1)
    terms, orders = spherical_harmonics.lobe_terms(exponent, COSINES, 3), list(spherical_harmonics.orders(3))
    placed = [(l, m) for m in range(4) for l in range(m, 4)]  # noqa: E741
    for (l, m), term in zip(placed, smooth.T, strict=True):  # noqa: E741
        expected = terms[:, orders.index((l, m))]
        assert_allclose(term * np.sqrt(1 - COSINES**2) ** m, expected, atol=2e-3)
