"""Seconds at equal error: read off measured points, and never carried on in our favour."""

from __future__ import annotations

import pytest
from occlusion_bake.bench.versus.curves import envelope, geometric_mean, ratio_at, time_at

# Seconds fall as RMSE^-2: a hundred times as long for a tenth of the error.
PEER = [(1.0, 0.1), (4.0, 0.05), (100.0, 0.01)]
OURS = [(0.5, 0.02), (2.0, 0.005)]


def test_between_two_points_time_goes_by_a_power_of_the_error() -> None:
    middle = time_at(0.02, PEER, ours=False)
    assert middle is not None and middle.seconds == pytest.approx(25.0)


def test_points_that_a_faster_one_betters_do_not_count() -> None:
    assert envelope([*PEER, (50.0, 0.06), (1.0, 0.2)]) == PEER


def test_equal_error_is_compared_and_marked_for_what_it_is() -> None:
    measured = ratio_at(0.01, OURS, PEER)
    assert measured is not None and (measured.value, measured.mark) == (pytest.approx(100.0), "")
    coarser = ratio_at(0.05, OURS, PEER)  # ours is finer at its coarsest, and is charged for all of it
    assert coarser is not None and (coarser.value, coarser.mark) == (pytest.approx(8.0), "≥")


def test_a_peer_is_carried_on_no_steeper_than_independent_rays() -> None:
    steep = [(1.0, 0.1), (1000.0, 0.05)]
    beyond = time_at(0.025, steep, ours=False)
    assert beyond is not None and beyond.seconds == pytest.approx(4000.0)
    flat = time_at(0.0025, [(1.0, 0.1), (2.0, 0.01)], ours=False)
    assert flat is not None and flat.seconds < 2.0 * 4.0**2  # as flat as it was measured


def test_ours_is_carried_on_no_flatter_and_not_far() -> None:
    beyond = time_at(0.003, [(1.0, 0.1), (1.1, 0.005)], ours=True)
    assert beyond is not None and beyond.seconds == pytest.approx(1.1 * (5 / 3) ** 2)
    assert time_at(0.002, [(1.0, 0.1), (1.1, 0.005)], ours=True) is None
    assert ratio_at(0.002, [(1.0, 0.1), (1.1, 0.005)], PEER) is None


def test_the_mean_of_a_ratio_and_its_inverse_is_1() -> None:
    assert geometric_mean([4.0, 0.25]) == pytest.approx(1.0)
