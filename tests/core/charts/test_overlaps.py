"""Overlapping triangles are found, all of them, and no others."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from occlusion_bake.core.base.errors import Cancelled, InputError
from occlusion_bake.core.base.kernel_api import Control
from occlusion_bake.core.charts.overlaps import lowest_overlaps, overlapping

HALF = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])  # of the unit square


def depth(one: Any, other: Any) -> Any:
    """(n,) how far triangles (n, 3, 2) meet: the shortest of the spans that they share across each of their edges."""
    shared = np.full(len(one), np.inf)
    for edges in (one, other):
        for corner in range(3):
            along = edges[:, (corner + 1) % 3] - edges[:, corner]
            across = np.stack([-along[:, 1], along[:, 0]], axis=1) / np.linalg.norm(along, axis=1)[:, None]
            (low, high), (others_low, others_high) = (
                (heights.min(axis=1), heights.max(axis=1))
                for heights in (np.einsum("ncx,nx->nc", triangle, across) for triangle in (one, other))
            )
            apart = np.minimum(high - others_low, others_high - low)
            shared = np.minimum(shared, np.minimum(apart, np.minimum(high - low, others_high - others_low)))
    return shared


def all_pairs(uv: Any, tolerance: float, group: Any = None) -> Any:
    """(n, 2) every overlapping pair, by trying each."""
    i, j = np.triu_indices(len(uv), 1)
    if group is not None:
        i, j = i[group[i] == group[j]], j[group[i] == group[j]]
    with np.errstate(invalid="ignore", divide="ignore"):
        meet = depth(uv[i], uv[j]) > tolerance  # edges of no length give NaN, and no overlap
    return np.stack([i, j], axis=1)[meet]


def soup(kind: str, count: int) -> Any:
    """(count, 3, 2) triangles at random, either way round."""
    rng = np.random.default_rng([ord(c) for c in kind])
    middle, shape = rng.random((count, 1, 2)) * 100.0, rng.normal(size=(count, 3, 2))
    if kind == "even":
        return middle + 3.0 * shape
    if kind == "sizes":  # over ten orders of magnitude, about a few places
        return middle[rng.integers(0, 5, count)] + shape * 10.0 ** rng.uniform(-8.0, 2.0, (count, 1, 1))
    if kind == "needles":
        turn = rng.uniform(0.0, 2.0 * np.pi, (count, 1))
        along = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
        return middle + along * rng.normal(size=(count, 3, 1)) * 40.0 + shape * 0.02
    if kind == "lattice":  # corners and edges in common, zero areas, the same triangle twice
        return rng.integers(0, 6, (count, 3, 2)).astype(np.float64)
    return np.repeat(middle[:1], count, axis=0) + 1e-3 * middle + shape  # "heap"


def grid(width: int, height: int) -> Any:
    """(2 * width * height, 3, 2) a layout without overlaps: squares cut in two, their corners moved about."""
    rng = np.random.default_rng(5)
    x, y = np.meshgrid(np.arange(width + 1.0), np.arange(height + 1.0), indexing="ij")
    p = np.stack([x, y], axis=-1) + rng.uniform(-0.2, 0.2, (width + 1, height + 1, 2))
    a, b, c, d = p[:-1, :-1], p[1:, :-1], p[1:, 1:], p[:-1, 1:]
    return np.concatenate([np.stack([a, b, c], axis=-2), np.stack([a, c, d], axis=-2)]).reshape(-1, 3, 2)


def circle(corners: int) -> Any:
    turn = np.linspace(0.0, 2.0 * np.pi, corners, endpoint=False)
    return 500.0 * np.stack([np.cos(turn), np.sin(turn)], axis=1)


def needles_about_a_point(corners: int) -> Any:
    rim = circle(corners)
    return np.stack([np.zeros_like(rim), rim, np.roll(rim, -1, axis=0)], axis=1)


def needles_from_a_corner(corners: int) -> Any:
    rim = circle(corners)
    return np.stack([np.broadcast_to(rim[0], (corners - 2, 2)), rim[1:-1], rim[2:]], axis=1)


def cut_at_random(corners: int) -> Any:
    """A polygon of many corners, cut into triangles anyhow: long ones of all directions lie side by side."""
    rng, rim, cuts, parts = np.random.default_rng(3), circle(corners), [], [(0, corners - 1)]
    while parts:
        first, last = parts.pop()
        if last - first > 1:
            between = int(rng.integers(first + 1, last))
            cuts.append((first, between, last))
            parts += [(first, between), (between, last)]
    return rim[np.array(cuts)]


@pytest.mark.parametrize("kind", ["even", "sizes", "needles", "lattice", "heap"])
@pytest.mark.parametrize("tolerance", [1e-9, 0.02, 0.7])
def test_the_pairs_are_those_that_trying_each_gives(kind: str, tolerance: float) -> None:
    uv = soup(kind, 300)
    expected = all_pairs(uv, tolerance)
    assert np.array_equal(overlapping(uv, tolerance), expected)
    assert tolerance > 0.1 or len(expected) > 40


@pytest.mark.parametrize("groups", [2, 40, 499])
def test_pairs_are_of_one_group(groups: int) -> None:
    uv = soup("even", 500)
    group = (np.arange(500, dtype=np.int64) * 7919 % groups - groups // 2).astype(np.int32)
    assert np.array_equal(overlapping(uv, 0.01, group=group), all_pairs(uv, 0.01, group))


@pytest.mark.parametrize(
    "uv",
    [grid(100, 80), needles_about_a_point(10_000), needles_from_a_corner(10_000), cut_at_random(10_000)],
    ids=["grid", "about a point", "from a corner", "at random"],
)
def test_neighbours_that_only_touch_do_not_overlap(uv: Any) -> None:
    assert len(overlapping(uv, 1e-9)) == 0
    assert len(overlapping(np.concatenate([uv, uv[:1]]), 1e-9)) == 1


def test_the_tolerance_is_how_far_one_must_be_moved() -> None:
    uv = np.stack([HALF, HALF + np.array([0.0, 0.75])])  # parted soonest across the slanting edge
    assert overlapping(uv, 0.249 * np.sqrt(0.5)).tolist() == [[0, 1]]
    assert len(overlapping(uv, 0.251 * np.sqrt(0.5))) == 0


def test_a_triangle_no_thicker_than_the_tolerance_overlaps_nothing() -> None:
    thin = np.array([[1.0, 1.0], [3.0, 1.0], [2.0, 1.001]])
    uv = np.stack([10.0 * HALF, thin, np.full((3, 2), 2.0), thin[[0, 0, 1]]])
    assert overlapping(uv, 0.0009).tolist() == [[0, 1]]
    assert len(overlapping(uv, 0.0011)) == 0


def test_the_same_pairs_come_with_any_number_of_threads() -> None:
    uv = soup("even", 3_000)
    some = [overlapping(uv, 0.01, threads=threads, most=100) for threads in (1, 3, 16)]
    assert all(len(pairs) == 100 and np.array_equal(pairs, some[0]) for pairs in some)
    every = {tuple(pair) for pair in overlapping(uv, 0.01).tolist()}
    assert len(every) > 1000
    assert every.issuperset(map(tuple, some[0].tolist()))


@pytest.mark.parametrize("groups", [1, 40, 100])
def test_the_lowest_pair_of_each_group(groups: int) -> None:
    uv = soup("sizes", 500)
    group = (np.arange(500, dtype=np.int64) * 7919 % groups).astype(np.int32)
    expected = np.full((groups, 2), -1, dtype=np.int64)
    for pair in all_pairs(uv, 0.01, group)[::-1]:
        expected[group[pair[0]]] = pair
    assert (expected >= 0).any()
    for threads in (1, 3):
        assert np.array_equal(lowest_overlaps(uv, 0.01, group, groups, threads=threads), expected)


def test_more_pairs_than_can_be_listed_have_a_lowest_one() -> None:
    """2 * 10^10 in one place, and a group of two whose pair comes last."""
    uv = np.repeat(HALF[None], 200_002, axis=0)
    group = (np.arange(len(uv), dtype=np.int64) >= 200_000).astype(np.int32)
    assert lowest_overlaps(uv, 0.1, group, 3).tolist() == [[0, 1], [200_000, 200_001], [-1, -1]]


def test_triangles_all_in_one_place_end_at_the_most() -> None:
    uv = np.repeat(HALF[None], 20_000, axis=0)
    assert len(overlapping(uv, 0.1, most=1)) == 1
    assert len(np.unique(overlapping(uv, 0.1, most=5_000), axis=0)) == 5_000


@pytest.mark.parametrize("count", [0, 1, 2])
def test_few_triangles(count: int) -> None:
    assert overlapping(np.repeat(HALF[None], count, axis=0), 0.1).tolist() == [[0, 1]] * (count // 2)


@pytest.mark.parametrize("wrong", [np.nan, np.inf, 1e100])
def test_uvs_out_of_range_are_refused(wrong: float) -> None:
    uv = soup("even", 10)
    uv[4, 1, 1] = wrong
    with pytest.raises(InputError):
        overlapping(uv, 0.1)
    with pytest.raises(InputError):
        lowest_overlaps(uv, 0.1, np.zeros(10, np.int32), 1)


def test_groups_out_of_range_are_refused() -> None:
    with pytest.raises(InputError):
        lowest_overlaps(soup("even", 10), 0.1, np.arange(10, dtype=np.int32), 9)


@pytest.mark.parametrize("tolerance", [-1.0, np.nan])
def test_a_tolerance_below_zero_is_refused(tolerance: float) -> None:
    with pytest.raises(InputError):
        overlapping(soup("even", 10), tolerance)


def test_it_can_be_cancelled() -> None:
    with pytest.raises(Cancelled):
        overlapping(soup("even", 1000), 0.01, control=Control(cancel=1))
    with pytest.raises(Cancelled):
        lowest_overlaps(soup("even", 1000), 0.01, np.zeros(1000, np.int32), 1, control=Control(cancel=1))
