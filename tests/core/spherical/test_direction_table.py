"""A table over the sphere: what it holds comes out again, on its seams as elsewhere."""

from __future__ import annotations

import numpy as np
from numpy.testing import assert_allclose
from occlusion_bake.core.spherical.direction_table import SphereTable

SEAMS = [
    (1.0, -1e-18, 0.0),
    (1.0, -0.0, 0.0),
    (-1.0, 1e-18, 0.0),
    (-1.0, -1e-18, 0.0),
    (0.0, 0.0, 1.0),
    (0.0, 0.0, -1.0),
]


def test_a_smooth_function_comes_out_again() -> None:
    ways = np.random.default_rng(1).normal(size=(1000, 3))
    ways = np.concatenate([ways / np.linalg.norm(ways, axis=1, keepdims=True), SEAMS])
    assert_allclose(
        SphereTable(lambda w: w + w[:, :1] * w[:, 1:2], 64)(ways), ways + ways[:, :1] * ways[:, 1:2], atol=2e-6
    )
