"""Which blocks get more rays."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from occlusion_bake.core.solve.ray_budget import MOST_RAYS, Blocks, Budget, rays_after

PLENTY = 1e12


def some_blocks(count: int, seed: int) -> Blocks:
    rng = np.random.default_rng(seed)
    return Blocks(
        np.exp(rng.normal(0.0, 2.0, count)),
        rng.integers(1, 17, count).astype(np.float64),
        2 ** rng.integers(0, 6, count),
        rng.random(count) < 0.6,
    )


def outcome(blocks: Blocks, goal: np.ndarray, rate: float) -> tuple[float, float]:
    """The squared errors that are left, and the rays that it takes."""
    had = np.where(blocks.traced, blocks.rays, 0)
    left = np.where(goal > had, (np.maximum(goal, 1) / blocks.rays) ** -rate, 1.0)
    return float(blocks.squares @ left), float(blocks.texels @ (goal - had))


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("rate", [1.0, 1.5])
def test_no_other_choice_leaves_as_little_for_fewer_rays(rate: float, seed: int) -> None:
    blocks = some_blocks(6, seed)
    goal = rays_after(blocks, Budget(0.2 * blocks.squares.sum(), PLENTY, rate))
    left, rays = outcome(blocks, goal, rate)
    assert left <= 0.2 * blocks.squares.sum() * (1 + 1e-9)
    for times in product((1, 2, 4, 8, 16), repeat=6):
        grown = np.array(times)
        other = np.where(grown > 1, grown * blocks.rays, np.where(blocks.traced, blocks.rays, 0))
        other_left, other_rays = outcome(blocks, other, rate)
        assert other_left > left * (1 - 1e-9) or other_rays >= rays * (1 - 1e-9)


def test_rays_are_powers_of_two_and_never_fewer_than_there_were() -> None:
    blocks = some_blocks(1000, 1)
    goal = rays_after(blocks, Budget(0.3 * blocks.squares.sum(), PLENTY, 1.2))
    assert np.all(goal[blocks.traced] >= blocks.rays[blocks.traced])
    assert np.all((goal & (goal - 1)) == 0)
    assert 0 < np.count_nonzero(goal[~blocks.traced]) < np.count_nonzero(~blocks.traced)


def test_what_is_wanted_already_takes_no_rays() -> None:
    blocks = some_blocks(50, 2)
    had = np.where(blocks.traced, blocks.rays, 0)
    assert_array_equal(rays_after(blocks, Budget(1.001 * blocks.squares.sum(), PLENTY, 1.0)), had)
    perfect = Blocks(np.zeros(50), blocks.texels, blocks.rays, blocks.traced)
    assert_array_equal(rays_after(perfect, Budget(0.0, PLENTY, 1.0)), had)


def test_no_more_is_spent_than_there_is() -> None:
    blocks = some_blocks(500, 3)
    for affordable in (10.0, 1e3, 1e4):
        goal = rays_after(blocks, Budget(1e-9, affordable, 1.0))
        assert 0.5 * affordable < outcome(blocks, goal, 1.0)[1] <= affordable


@pytest.mark.parametrize("had", [MOST_RAYS // 2, MOST_RAYS, 2 * MOST_RAYS])
def test_no_texel_gets_more_than_the_most_and_then_others_do(had: int) -> None:
    blocks = Blocks(np.array([1e9, 1.0]), np.ones(2), np.array([had, 4]), np.ones(2, dtype=bool))
    goal = rays_after(blocks, Budget(1.0, PLENTY, 1.0))
    assert goal[0] == max(had, MOST_RAYS)
    assert goal[1] == 64
