"""Blocks of texels: sums, lists, and which to choose."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from occlusion_bake.core.solve.blocks import (
    BLOCK,
    block_of,
    block_sums,
    grown,
    largest,
    lists_of,
    texels_in,
    texels_of,
)


@pytest.mark.parametrize("shape", [(8, 12), (7, 9), (1, 3)])
def test_lists_have_each_covered_texel_of_the_marked_blocks_once(shape: tuple[int, int]) -> None:
    random = np.random.default_rng(0)
    covered = random.random(shape) < 0.7
    blocks = random.random(block_sums(covered.astype(np.float32)).shape) < 0.5
    marked = blocks.repeat(BLOCK, axis=0).repeat(BLOCK, axis=1)[: shape[0], : shape[1]]
    texels = texels_of(blocks, covered)
    assert_array_equal(np.sort(texels), np.flatnonzero(marked & covered))
    listed = np.concatenate([np.zeros(0, np.int64), *lists_of(blocks)])
    among, there = texels_in(listed, covered)
    assert_array_equal(among[there], texels)
    assert_array_equal(block_of(among[there], shape), np.repeat(listed, there.sum(axis=1)))


def test_a_blocks_texels_stand_together_two_by_two() -> None:
    covered = np.ones((8, 8), dtype=bool)
    texels = texels_of(np.ones((2, 2), dtype=bool), covered).reshape(-1, 4)
    y, x = np.divmod(texels, 8)
    assert np.all(np.ptp(x, axis=1) == 1) and np.all(np.ptp(y, axis=1) == 1)
    assert np.all(np.ptp(np.divmod(texels.reshape(-1, 16), 8), axis=2) == BLOCK - 1)


@pytest.mark.parametrize("shape", [(8, 12), (7, 9)])
def test_sums_are_those_of_the_texels(shape: tuple[int, int]) -> None:
    image = np.random.default_rng(1).random(shape).astype(np.float32)
    sums = block_sums(image)
    assert sums.dtype == np.float64
    assert sums.sum() == pytest.approx(image.sum(dtype=np.float64), rel=1e-7)
    assert sums[1, 1] == pytest.approx(image[4:8, 4:8].sum(dtype=np.float64), rel=1e-7)
    assert_array_equal(block_sums(image > 0.5), block_sums((image > 0.5).astype(np.float32)))


def test_the_largest_are_the_fewest_that_leave_no_more_than_the_rest() -> None:
    sums = np.array([[0.1, 3.0], [0.2, 1.0]])
    assert_array_equal(largest(sums, 10.0), np.zeros((2, 2), dtype=bool))
    assert_array_equal(largest(sums, 1.5), sums > 1.0)
    assert_array_equal(largest(sums, 0.3001), sums > 0.5)
    assert_array_equal(largest(sums, 0.0), np.ones((2, 2), dtype=bool))
    alike = np.array([[1.0, 2.0], [2.0, 3.0]])
    assert_array_equal(largest(alike, 3.5), alike > 1.5)  # of equal ones all


def test_grown_blocks_are_those_beside_marked_ones() -> None:
    blocks = np.zeros((5, 5), dtype=bool)
    blocks[2, 2] = True
    assert grown(blocks).sum() == 9 and grown(blocks)[1:4, 1:4].all()
