"""Singular values of small matrices, against LAPACK's."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from occlusion_bake.core.base.singular_values import pseudo_inverse_transposed, singular_values

HARD = {
    "zero": np.zeros((3, 3)),
    "one": np.eye(3),
    "a mirror": np.diag([1.0, -1.0, 1.0]),
    "flat": np.diag([2.0, 3.0, 0.0]),
    "a line": np.outer([1.0, 2.0, 3.0], [3.0, -1.0, 2.0]),
    "all alike": np.ones((3, 3)),
    "tiny": 1e-200 * np.arange(9.0).reshape(3, 3),
    "huge": 1e200 * np.arange(9.0).reshape(3, 3),
    "nearly parallel": np.array([[1.0, 1.0, 0.0], [0.0, 1e-9, 0.0], [0.0, 0.0, 1.0]]),
}


@pytest.mark.parametrize("name", HARD)
def test_of_hard_matrices_they_are_lapacks(name: str) -> None:
    matrix = HARD[name]
    scale = np.abs(matrix).max() or 1.0  # LAPACK loses what is tiny
    expected = np.linalg.svd(matrix / scale, compute_uv=False) * scale
    assert_allclose(singular_values(matrix[None])[0], expected, rtol=1e-7, atol=1e-15 * expected[0])


def test_values_far_apart_are_each_exact() -> None:
    matrix = np.diag([1e-12, 1.0, 1e12])[:, [1, 2, 0]]
    assert_allclose(singular_values(matrix[None])[0], [1e12, 1.0, 1e-12], rtol=1e-15)


def test_of_many_at_once() -> None:
    matrices = np.random.default_rng(5).normal(size=(1000, 3, 3))
    assert_allclose(singular_values(matrices), np.linalg.svd(matrices, compute_uv=False), rtol=1e-10)


@pytest.mark.parametrize("name", ["flat", "a line", "all alike", "one", "tiny", "huge"])
def test_the_pseudo_inverse_but_for_a_factor(name: str) -> None:
    matrix = HARD[name] / np.abs(HARD[name]).max()
    found, expected = pseudo_inverse_transposed(HARD[name]), np.linalg.pinv(matrix).T
    assert_allclose(found / np.abs(found).max(), expected / np.abs(expected).max(), atol=1e-13)
