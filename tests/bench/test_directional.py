"""What the bench of directional codes says of texels whose RO is known."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from occlusion_bake.bench.directional import EXPONENTS, RAYS_A_SIDE, Seen, cones, errors, frames_about, pooled, views
from occlusion_bake.core.horizon import open_horizon


def seen(visible: np.ndarray) -> Seen:
    return Seen(np.repeat(np.eye(3)[None], len(visible), axis=0), visible)


def test_of_open_and_shut_texels_every_code_is_right() -> None:
    rays = np.zeros((2, RAYS_A_SIDE**2), dtype=bool)
    rays[0] = True
    points = seen(rays)
    for exponent in EXPONENTS:
        expected = open_horizon(exponent, views()[:, 2])
        assert_allclose(points.truth(views(), exponent), [expected, 0 * expected], atol=1e-12)
    found = errors(points.cells, points.truth)
    for name, row in found.items():
        right = name.startswith(("sh", "mask", "cells", "AO times"))
        assert (max(row.values()) < 1e-4) == right, name


def test_a_half_open_texel_is_what_ao_cannot_tell() -> None:
    rays = np.zeros((1, RAYS_A_SIDE, RAYS_A_SIDE), dtype=bool)
    rays[:, :, RAYS_A_SIDE // 2 :] = True
    points = seen(rays.reshape(1, -1))
    found = errors(points.cells, points.truth)
    assert found["mask_16"][10.0] < 0.01 < 0.2 < found["AO times the open horizon"][10.0]
    assert found["sh_6"][10.0] < found["sh_3"][10.0] < found["sh_2"][10.0]


def test_cones_that_hold_one_another() -> None:
    up = np.array([[0.0, 0.0, 1.0]])
    assert cones(np.array([[1.0]]), up, up, 100.0)[0, 0] == pytest.approx(1.0)
    assert cones(np.array([[0.0]]), up, up, 100.0)[0, 0] == pytest.approx(0.0, abs=1e-6)
    aside = np.array([[0.99, 0.0, 0.141]])
    assert cones(np.array([[0.01]]), up, aside, 1000.0)[0, 0] == pytest.approx(0.0, abs=1e-6)


def test_frames_are_right_handed() -> None:
    normals = np.random.default_rng(0).normal(size=(50, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    frames = frames_about(normals)
    assert_allclose(frames @ frames.swapaxes(1, 2), np.broadcast_to(np.eye(3), (50, 3, 3)), atol=1e-12)
    assert_allclose(np.linalg.det(frames), 1.0)
    assert_allclose(frames[:, 2], normals)


def test_sets_are_pooled_by_squares() -> None:
    one, other = ({"sh_3": dict.fromkeys(EXPONENTS, error)} for error in (0.3, 0.4))
    assert pooled([one, other])["sh_3"][10.0] == pytest.approx(np.sqrt(0.125))
