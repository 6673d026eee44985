"""Vectors in rows against numpy's linear algebra."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from occlusion_bake.core.base import vectors

RNG = np.random.default_rng(1)
POINTS = RNG.normal(size=(50, 4, 3))


@pytest.mark.parametrize("seed", range(5))
def test_maps_are_matrix_products(seed: int) -> None:
    linear = np.random.default_rng(seed).normal(size=(3, 3))
    assert_allclose(vectors.mapped(POINTS, linear), POINTS @ linear.T, atol=1e-14)
    assert_allclose(vectors.determinant(linear), np.linalg.det(linear))
    assert vectors.mapped(POINTS.astype(np.float32), linear).dtype == np.float32


@pytest.mark.parametrize("scale", [1e-150, 1e-9, 1.0, 1e9, 1e150])
@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_normals_go_by_the_inverse_transpose(scale: float, mirror: float) -> None:
    linear = RNG.normal(size=(3, 3))
    linear *= scale * mirror * np.sign(np.linalg.det(linear))
    expected = POINTS @ np.linalg.inv(linear / scale)
    expected /= np.linalg.norm(expected, axis=-1, keepdims=True)
    assert_allclose(vectors.transformed_normals(POINTS, linear), expected, atol=1e-12)


@pytest.mark.parametrize("seed", range(200))
def test_normals_of_what_is_nearly_flat_go_with_the_winding(seed: int) -> None:
    """The determinant's sign, which turns triangles round, may be rounding alone; normals must be of the same mind."""
    rng = np.random.default_rng(seed)
    turned, other = (np.linalg.qr(rng.normal(size=(3, 3)))[0] for _ in range(2))
    linear = turned @ np.diag([1.0, 1.0, 0.0]) @ other
    if vectors.determinant(linear) == 0.0:
        return
    a, b, c = corners = rng.normal(size=(3, 3))
    face = vectors.transformed_normals(np.cross(b - a, c - a), linear)
    a, b, c = vectors.mapped(corners, linear)
    assert np.linalg.norm(face) > 0.99
    assert np.sign(vectors.determinant(linear)) * vectors.dot(face, np.cross(b - a, c - a)) > 0.0


def test_what_has_no_length_is_zero() -> None:
    assert_array_equal(vectors.unit(np.zeros((2, 3))), np.zeros((2, 3)))
    assert_array_equal(vectors.transformed_normals(np.zeros((2, 3)), np.eye(3)), np.zeros((2, 3)))


def test_weights_at_corners() -> None:
    corners, weights = RNG.normal(size=(20, 3, 2)), RNG.uniform(size=(20, 3))
    assert_allclose(vectors.weighted(weights, corners), np.einsum("nc,nca->na", weights, corners), atol=1e-14)
