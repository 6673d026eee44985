"""The measured error: unbiased whatever made the error, from few texels."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from occlusion_bake.core.rays.accumulators import Accumulator
from occlusion_bake.core.solve.probes import LANES, MOST, Probes, draw, how_many, place

SIDE = 128
RAYS = 4
TOTALS = Accumulator.VISIBILITY.totals


def binomial(truth: np.ndarray, seed: int):  # type: ignore[no-untyped-def]
    """A tracer whose rays are coin throws with the truth of their texel."""
    rng = np.random.default_rng(seed)

    def trace(texels: np.ndarray, rays: int) -> np.ndarray:
        return rng.binomial(rays, truth.reshape(-1)[texels]).astype(np.float32)[np.newaxis]

    return trace


@pytest.fixture(scope="module")
def truth() -> np.ndarray:
    x = np.linspace(0.0, 1.0, SIDE)
    made: np.ndarray = np.clip(np.add.outer(x, 0.3 * x), 0.0, 1.0)
    return made


def measured(values: np.ndarray, truth: np.ndarray, expected: np.ndarray, covered: np.ndarray) -> list[Probes]:
    expected = np.where(covered, expected, 0.0).astype(np.float32)
    placed = (place(expected, covered, seed) for seed in range(64))
    return [draw(*each, RAYS, binomial(truth, seed), TOTALS) for seed, each in enumerate(placed)]


@pytest.mark.parametrize("expectation", ["none", "right", "wrong"])
def test_the_mean_square_is_unbiased(expectation: str, truth: np.ndarray) -> None:
    """Of noise, of a bias and of a few large errors, wherever they are expected."""
    rng = np.random.default_rng(3)
    errors = 0.02 * rng.standard_normal(truth.shape) + 0.01
    errors[rng.random(truth.shape) < 0.01] += 0.2
    values = (truth + errors).astype(np.float32)
    expected = {"none": np.zeros_like(truth), "right": errors**2, "wrong": truth**8}[expectation]
    covered = rng.random(truth.shape) < 0.8
    squares = [
        float(np.average(each.squares(values), weights=each.weight))
        for each in measured(values, truth, expected, covered)
    ]
    true = float(np.mean(errors[covered] ** 2))
    spread = np.std(squares, ddof=1) / np.sqrt(len(squares))
    assert spread < 0.1 * true  # or the test would tell nothing
    assert abs(np.mean(squares) - true) < 4.5 * spread  # p < 1e-5


def test_the_doubt_is_the_spread_of_the_mean_square(truth: np.ndarray) -> None:
    values = (truth + 0.03).astype(np.float32)
    probes = measured(values, truth, np.zeros_like(truth), np.ones_like(truth, dtype=bool))
    squares = [float(np.average(each.squares(values), weights=each.weight)) for each in probes]
    doubts = [each.error(values).doubt for each in probes]
    assert 0.8 < np.std(squares, ddof=1) / np.mean(doubts) < 1.25


def test_joined_probes_tell_the_mean_of_both_and_doubt_it_less(truth: np.ndarray) -> None:
    values = (truth + 0.03).astype(np.float32)
    one, other, *_ = measured(values, truth, np.zeros_like(truth), np.ones_like(truth, dtype=bool))
    joined, parts = one.joined(other), (one.error(values), other.error(values))
    assert joined.error(values).square == pytest.approx(np.mean([each.square for each in parts]))
    assert joined.error(values).doubt == pytest.approx(np.mean([each.doubt for each in parts]) / np.sqrt(2.0), rel=0.05)
    assert joined.cost == one.cost + other.cost == 2 * 2 * LANES * RAYS * len(one.texels)


def test_the_noise_is_what_each_estimate_errs_by(truth: np.ndarray) -> None:
    probes = measured(truth, truth, np.zeros_like(truth), np.ones_like(truth, dtype=bool))
    expected = np.mean(truth * (1.0 - truth)) / (LANES * RAYS)
    told = [each.noise for each in probes]
    assert abs(np.mean(told) - expected) < 4.5 * np.std(told, ddof=1) / np.sqrt(len(told))  # p < 1e-5
    assert np.std(told, ddof=1) < 0.1 * expected


def test_where_all_agree_there_is_no_error() -> None:
    open_sky = np.ones((32, 32))
    (probes, *_) = measured(open_sky, open_sky, np.zeros_like(open_sky), np.ones_like(open_sky, dtype=bool))
    error = probes.error(open_sky.astype(np.float32))
    assert (error.rmse, error.p99, error.doubt) == (0.0, 0.0, 0.0)
    assert error.within(1e-9)


def test_probes_lie_on_covered_texels_and_more_of_them_where_the_error_is_expected() -> None:
    covered = np.zeros((SIDE, SIDE), dtype=bool)
    covered[:, 10:90] = True
    expected = np.zeros((SIDE, SIDE), dtype=np.float32)
    expected[:, 80:90] = 1.0
    texels, weight = place(expected, covered, 1)
    assert len(texels) == how_many(80 * SIDE) and covered.reshape(-1)[texels].all()
    assert len(place(expected, covered, 1, most=100)[0]) == 100
    share = np.mean(texels % SIDE >= 80)
    assert share == pytest.approx(0.5 + 0.5 / 8, abs=0.01)
    assert np.average(texels % SIDE >= 80, weights=weight) == pytest.approx(1 / 8, abs=0.01)


@pytest.mark.parametrize("texels", [0, 1, 255, 256, 1000, 5000, 10**6])
def test_there_are_as_many_probes_as_texels_allow(texels: int) -> None:
    assert how_many(texels) <= min(texels, MOST)
    assert how_many(texels) >= min(texels, 256)


def test_few_texels_are_all_probed_and_none_give_none() -> None:
    covered = np.zeros((8, 8), dtype=bool)
    covered[2, 3:6] = True
    texels, _ = place(np.zeros((8, 8), dtype=np.float32), covered, 0)
    assert sorted(texels) == [19, 20, 21]
    nothing = draw(
        *place(np.zeros((8, 8), dtype=np.float32), np.zeros_like(covered), 0), 4, binomial(np.ones(64), 0), TOTALS
    )
    assert nothing.error(np.zeros((8, 8), dtype=np.float32)).rmse == 0.0


def test_probes_that_face_away_are_dropped() -> None:
    def trace(texels: np.ndarray, rays: int) -> np.ndarray:
        return np.where(texels == 1, -1.0, rays).astype(np.float32)[np.newaxis]

    probes = draw(np.array([0, 1, 2]), np.ones(3), 4, trace, TOTALS)
    assert list(probes.texels) == [0, 2] and np.all(probes.first == 1.0)
    assert LANES == 16


@pytest.mark.parametrize("shape", [(64, 48), (63, 50)])
def test_each_texel_is_as_likely_as_its_weight_says(shape: tuple[int, int]) -> None:
    """Texels are drawn by half the even density and half the expected squares, and the weight is what undoes that."""
    rng = np.random.default_rng(5)
    covered = rng.random(shape) < 0.6
    covered[10:30] = False
    expected = np.where(covered, rng.random(shape).astype(np.float32) ** 4, np.float32(0.0))
    placed = [place(expected, covered, seed) for seed in range(400)]
    texels = np.concatenate([each for each, _ in placed])
    assert covered.reshape(-1)[texels].all()
    density = (0.5 + 0.5 * expected / expected[covered].mean(dtype=np.float64))[covered]
    assert_allclose(np.concatenate([each for _, each in placed]), 1.0 / dense(density, covered)[texels], rtol=1e-6)
    likely = density / density.sum() * len(texels)
    found = np.bincount(texels, minlength=covered.size)[covered.reshape(-1)]
    assert np.abs((found - likely) / np.sqrt(likely)).max() < 5.0  # of a thousand, stratified: less than Poisson's


def dense(values: np.ndarray, covered: np.ndarray) -> np.ndarray:
    """Values of covered texels, in the place of each texel."""
    image = np.full(covered.shape, np.nan)
    image[covered] = values
    return image.reshape(-1)
