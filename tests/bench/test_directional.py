"""What the bench of directional codes says of texels whose RO is known."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose
from occlusion_bake.bench.directional import (
    BY_SCENE,
    BY_VIEW,
    CODES,
    EDGES,
    EXPONENTS,
    by_scene,
    by_view,
    errors,
    pooled,
    rmse,
    views,
)
from occlusion_bake.core.spherical.lobe import open_horizon
from occlusion_bake.tests.oracles.engine_formulas import cones
from occlusion_bake.tests.oracles.seen_rays import RAYS_A_SIDE, Seen, frames_about


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
    exact = {"AO times the open horizon", *(code.name for code in CODES)}
    for name, squares in found.items():
        assert squares.shape == (len(EXPONENTS), len(views()))
        assert (squares.max() < 1e-8) == (name in exact), name
    assert 0.0 < rmse(found["sh_3, RGBA images of 8 bits"], 10.0) < 0.02


def test_a_half_open_texel_is_what_ao_cannot_tell() -> None:
    rays = np.zeros((1, RAYS_A_SIDE, RAYS_A_SIDE), dtype=bool)
    rays[:, :, RAYS_A_SIDE // 2 :] = True
    points = seen(rays.reshape(1, -1))
    found = errors(points.cells, points.truth)
    error = {name: rmse(squares, 10.0) for name, squares in found.items()}
    assert error["mask_16"] < 0.01 < 0.2 < error["AO times the open horizon"]
    assert error["sh_6"] < error["sh_3"] < error["sh_2"]
    assert error["sh_3"] < error["sh_3, RGBA images of 8 bits"] < error["sh_3"] + 0.01


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


def of_views(error: np.ndarray) -> np.ndarray:
    """Squares of errors by view, the same at each exponent."""
    return np.repeat(error[None] ** 2, len(EXPONENTS), axis=0)


def test_sets_are_pooled_by_squares() -> None:
    one, other = ({"sh_3": of_views(np.full(len(views()), error))} for error in (0.3, 0.4))
    assert rmse(pooled([one, other])["sh_3"], 10.0) == pytest.approx(np.sqrt(0.125))


def test_every_view_is_in_the_band_that_its_cosine_is_in() -> None:
    cosines = views()[:, 2]
    for band, (low, high) in enumerate(pairwise(EDGES)):
        within = (cosines >= low) & (cosines <= high)
        squares = of_views(within.astype(float))
        assert [rmse(squares, 10.0, each) for each in range(len(EDGES) - 1)] == [each == band for each in range(4)]
        assert rmse(squares, 10.0) == pytest.approx(np.sqrt(within.mean()))


def test_tables_hold_both_exponents_of_each_cell() -> None:
    squares = np.outer(np.arange(len(EXPONENTS), dtype=np.int64) ** 2, np.ones(len(views())))
    lines = by_view(dict.fromkeys(BY_VIEW, squares))
    assert lines[0] == "| kept of a texel | n·v 0.15 to 0.35 | n·v 0.35 to 0.55 | n·v 0.55 to 0.75 | n·v 0.75 to 1 |"
    assert lines[-1] == "| mask_16 |" + " 1.0000, 2.0000 |" * 4
    one, other = (dict.fromkeys(BY_SCENE, factor * squares) for factor in (1.0, 4.0))
    assert by_scene({"one": one, "other": other})[2:] == [
        "| `one` | 1.0000, 2.0000 | 1.0000, 2.0000 |",
        "| `other` | 2.0000, 4.0000 | 2.0000, 4.0000 |",
    ]
