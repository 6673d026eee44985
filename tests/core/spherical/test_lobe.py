"""Quadrature over lobes that the horizon clips: the open horizon, and integrals that are known."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from numpy.testing import assert_allclose
from occlusion_bake.core.spherical.lobe import lobe_nodes, open_horizon

COSINES = np.concatenate([[0.0, 1e-6, 1e-3], np.linspace(0.02, 1.0, 50)])


@pytest.mark.parametrize("exponent", [0.0, 1.0, 2.0, 10.0, 100.0, 1000.0, 1e5])
def test_the_weights_sum_to_the_open_horizon(exponent: float) -> None:
    ways, weights = lobe_nodes(exponent, COSINES)
    assert_allclose(weights.sum(axis=1), open_horizon(exponent, COSINES), atol=1e-6)
    assert_allclose(np.linalg.norm(ways, axis=2), 1.0, atol=1e-12)
    assert ways[..., 2].min() > -1e-12 and ways[..., 1].min() >= 0.0


@pytest.mark.parametrize("exponent", [1.0, 3.0, 32.0])
def test_against_a_fine_grid(exponent: float) -> None:
    height, turn = ((np.arange(n, dtype=np.int64) + 0.5) / n for n in (800, 800))
    z, phi = np.meshgrid(height, 2 * pi * turn, indexing="ij")
    x = np.sqrt(1 - z**2) * np.cos(phi)
    for cosine in (0.0, 0.2, 0.7, 1.0):
        lobe = (exponent + 1) * np.maximum(x * np.sqrt(1 - cosine**2) + z * cosine, 0) ** exponent
        ways, weights = lobe_nodes(exponent, np.array([cosine]))
        for power in (1, 4):
            expected = [(lobe * x**power).mean(), (lobe * z**power).mean()]
            found = [(weights * ways[..., axis] ** power).sum() for axis in (0, 2)]
            assert_allclose(found, expected, atol=1e-4)  # what the grid is off by
