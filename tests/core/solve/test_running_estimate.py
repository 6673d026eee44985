"""What rounds of rays bring together."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from occlusion_bake.core.solve.running_estimate import RunningEstimate

SHAPE, TEXELS = (8, 8), 64


def rays_of(count: int) -> np.ndarray:
    """(texels, rays) of visibility, more open from texel to texel."""
    chance = np.linspace(0.0, 1.0, TEXELS)[:, np.newaxis]
    return np.random.default_rng(3).random((TEXELS, count)) < chance


def sums(rays: np.ndarray, before: int, after: int) -> tuple[np.ndarray, np.ndarray]:
    """Over the rays of a round, and over those of them that are of the first half of all."""
    return tuple(rays[:, before:to].sum(axis=1).astype(np.float32) for to in (after, max(after // 2, before)))


def begun(rays: np.ndarray, count: int, unit: int) -> RunningEstimate:
    estimate = RunningEstimate.empty(SHAPE, unit)
    total, first_half = (each.reshape(SHAPE) for each in sums(rays, 0, count))
    estimate.begin(total, first_half, np.ones(SHAPE, dtype=bool))
    return estimate


@pytest.mark.parametrize("rounds", [(4, 64), (4, 8, 64), (16, 32, 64), (4, 16, 64)])
def test_rounds_come_to_what_as_many_rays_at_once_do(rounds: tuple[int, ...]) -> None:
    rays = rays_of(rounds[-1])
    at_once = begun(rays, rounds[-1], rounds[-1])
    estimate = begun(rays, rounds[0], rounds[0])
    for before, after in pairwise(rounds):
        estimate.go_on(*sums(rays, before, after), before, after, np.arange(TEXELS, dtype=np.int64))
    assert_allclose(estimate.value, at_once.value, atol=1e-6)
    variance, expected = (each.noise / each.precision for each in (estimate, at_once))
    assert_allclose(variance, expected, rtol=1e-4, atol=1e-9)


def test_a_texel_without_rays_takes_those_of_its_first_round() -> None:
    rays, texels = rays_of(16), np.arange(5, 40, dtype=np.int64)
    estimate = RunningEstimate.empty(SHAPE, 16)
    estimate.value[:] = 0.3  # told otherwise
    total, first_half = (each[texels] for each in sums(rays, 0, 16))
    estimate.go_on(total, first_half, 0, 16, texels)
    assert_allclose(estimate.value.reshape(-1)[texels], rays[texels].mean(axis=1), atol=1e-6)
    assert_array_equal(np.flatnonzero(estimate.precision), texels)


def test_a_texel_that_faces_away_in_a_round_goes_on_with_the_mean_that_it_had() -> None:
    rays, everything = rays_of(64), np.arange(TEXELS, dtype=np.int64)
    estimate = begun(rays, 4, 4)
    known = estimate.value.reshape(-1).copy()
    seen = everything % 2 == 0
    estimate.go_on(*(each[seen] for each in sums(rays, 4, 16)), 4, 16, everything[seen])
    assert_array_equal(estimate.value.reshape(-1)[~seen], known[~seen])
    assert np.all(estimate.precision.reshape(-1)[~seen] == 1.0)
    total, first_half = sums(rays, 16, 64)
    estimate.go_on(total, first_half, 16, 64, everything)
    assert_allclose(estimate.value.reshape(-1)[seen], rays[seen].mean(axis=1), atol=1e-6)
    assert_allclose(estimate.value.reshape(-1)[~seen], ((16 * known + total) / 64)[~seen], atol=1e-6)
