"""Expected errors, put right by measured ones."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from occlusion_bake.core.solve.calibration import calibrated

BLOCKS = (64, 64)


def probed(true: np.ndarray, expected: np.ndarray, count: int, seed: int) -> np.ndarray:
    """Calibrated by probes whose squared errors vary as those of noise do, half of them steered by what is expected."""
    rng = np.random.default_rng(seed)
    chance = 0.5 / true.size + 0.5 * expected.reshape(-1) / expected.sum()
    of = rng.choice(true.size, count, p=chance)
    squares = true.reshape(-1)[of] * rng.chisquare(1, count)
    return calibrated(expected, of, squares, 1.0 / (true.size * chance[of]))


def off(told: np.ndarray, true: np.ndarray) -> float:
    """How many times too much or too little, in the mean over what is expected of."""
    return float(np.exp(np.abs(np.log(told / true)).mean()))


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("times", [0.1, 1.0, 30.0])
def test_what_is_expected_rightly_but_for_its_scale_gets_its_scale(times: float, seed: int) -> None:
    true = np.exp(np.random.default_rng(seed).normal(0.0, 1.5, BLOCKS))
    assert off(probed(true, times * true, 4096, seed), true) < 1.2


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("power", [0.0, 0.5])
def test_what_varies_too_much_varies_less(power: float, seed: int) -> None:
    """Where what is expected tells nothing, errors are alike."""
    expected = np.exp(np.random.default_rng(seed).normal(0.0, 2.0, BLOCKS))
    true = expected**power
    scaled = expected * (true.mean() / expected.mean())
    assert off(probed(true, expected, 4096, seed), true) < 1.35 < 2.0 < off(scaled, true)


def test_few_probes_tell_a_scale_alone() -> None:
    expected = np.exp(np.random.default_rng(0).normal(0.0, 2.0, BLOCKS))
    told = probed(np.ones(BLOCKS), expected, 256, 0)
    above = told > told.min()
    ratio = told[above] / expected[above]
    assert ratio.min() == pytest.approx(ratio.max())


def test_below_what_the_probes_saw_there_may_be_as_much_as_in_the_least_of_it() -> None:
    expected = np.array([0.0, 1.0, 2.0])
    of = np.repeat([1, 2], 512)
    told = calibrated(expected, of, np.full(1024, 3.0), np.ones(1024))
    assert told == pytest.approx([3.0, 3.0, 3.0])


def test_where_nothing_is_expected_the_probes_there_tell() -> None:
    expected = np.array([0.0, 0.0, 1.0])
    of = np.repeat([0, 2], 512)
    for there in (0.0, 0.5):
        told = calibrated(expected, of, np.repeat([there, 4.0], 512), np.ones(1024))
        assert told == pytest.approx([there, there, 4.0])


@pytest.mark.parametrize("count", [300, 4096])
@pytest.mark.parametrize("power", [0.3, 1.0, 2.0])
def test_all_together_comes_to_what_is_measured(power: float, count: int) -> None:
    rng = np.random.default_rng(4)
    expected = np.exp(rng.normal(0.0, 2.0, BLOCKS))
    of, weight = rng.integers(0, expected.size, count), rng.uniform(0.5, 2.0, count)
    squares = expected.reshape(-1)[of] ** power * rng.chisquare(1, count)
    told = calibrated(expected, of, squares, weight)
    assert weight @ told.reshape(-1)[of] == pytest.approx(weight @ squares)


def test_without_probes_what_is_expected_is_told() -> None:
    none = np.zeros(0, dtype=np.int64)
    assert_array_equal(calibrated(np.ones(3), none, np.zeros(0), np.zeros(0)), np.ones(3))
