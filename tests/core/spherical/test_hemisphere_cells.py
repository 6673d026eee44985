"""Cells of the hemisphere: where directions fall, equal solid angles, and exact integrals over them."""

from __future__ import annotations

from math import cos, pi, sin, sqrt

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from occlusion_bake.core.base.errors import InputError
from occlusion_bake.core.spherical.hemisphere_cells import (
    cell_of,
    check_cells,
    coarser,
    directions,
    integrals,
    square_of,
    subcells,
)

SIDES = (8, 16)


def concentric(u: float, v: float) -> tuple[float, float]:
    """A place of the square in the disk, as the kernel has it, a number at a time."""
    a, b = 2 * u - 1, 2 * v - 1
    if a == 0 and b == 0:
        return 0.0, 0.0
    radius, angle = (a, pi / 4 * (b / a)) if abs(a) > abs(b) else (b, pi / 2 - pi / 4 * (a / b))
    return radius * cos(angle), radius * sin(angle)


def random_ways(count: int, seed: int = 0) -> np.ndarray:
    """Uniform over the hemisphere, and not by way of the square."""
    rng = np.random.default_rng(seed)
    z, turn = rng.random(count), 2 * pi * rng.random(count)
    return np.stack([np.sqrt(1 - z**2) * np.cos(turn), np.sqrt(1 - z**2) * np.sin(turn), z], axis=1)


def test_the_map_is_the_kernels() -> None:
    places = np.concatenate(
        [np.random.default_rng(1).random((500, 2)), np.indices((5, 5), dtype=np.int64).reshape(2, -1).T / 4]
    )
    for (u, v), (x, y, z) in zip(places, directions(*places.T), strict=True):
        disk = concentric(u, v)
        assert z == pytest.approx(1 - disk[0] ** 2 - disk[1] ** 2, abs=1e-12)
        stretch = sqrt(1 + z)  # sin θ / r
        assert (x, y) == pytest.approx((disk[0] * stretch, disk[1] * stretch), abs=1e-12)


@pytest.mark.parametrize(
    ("place", "way"),
    [
        ((0.5, 0.5), (0, 0, 1)),
        ((1, 0.5), (1, 0, 0)),
        ((0, 0.5), (-1, 0, 0)),
        ((0.5, 1), (0, 1, 0)),
        ((0.5, 0), (0, -1, 0)),
        ((1, 1), (sqrt(0.5), sqrt(0.5), 0)),
        ((0, 1), (-sqrt(0.5), sqrt(0.5), 0)),
        ((0.75, 0.5), (sqrt(7) / 4, 0, 0.75)),
    ],
)
def test_places_that_are_known(place: tuple[float, float], way: tuple[float, float, float]) -> None:
    assert_allclose(directions(*place), way, atol=1e-12)


def test_there_and_back() -> None:
    ways = random_ways(2000)
    assert_allclose(directions(*square_of(ways)), ways, atol=1e-7)
    places = np.random.default_rng(2).random((2, 2000))
    assert_allclose(square_of(directions(*places)), places, atol=1e-12)
    assert_allclose(square_of(np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [0.6, 0.0, -0.8]]))[0], [0.5, 0.5, 1.0])


@pytest.mark.parametrize("side", SIDES)
def test_all_cells_have_one_solid_angle(side: int) -> None:
    count = 400 * side**2
    drawn = np.bincount(cell_of(random_ways(count, seed=3), side), minlength=side**2)
    statistic = ((drawn - 400.0) ** 2 / 400.0).sum()
    freedom = side**2 - 1
    assert abs(statistic - freedom) < 4.5 * sqrt(2 * freedom)  # chi-squared: by chance with p = 1e-5 or so
    assert_allclose(integrals(lambda ways: np.ones((len(ways), 1)), side), 2 * pi / side**2, rtol=1e-12)


@pytest.mark.parametrize("side", SIDES)
def test_pieces_lie_in_their_cells_row_by_row(side: int) -> None:
    pieces = subcells(side, 3)
    assert pieces.shape == (side**2, 9, 3)
    assert_array_equal(cell_of(pieces, side), np.repeat(np.arange(side**2, dtype=np.int64), 9).reshape(-1, 9))
    row, column = 1, side - 2
    at = directions((column + 0.5) / side, (row + 0.5) / side)
    assert cell_of(at, side) == row * side + column and at[0] > 0 > at[1]


@pytest.mark.parametrize("side", SIDES)
def test_integrals_of_polynomials_are_exact(side: int) -> None:
    def powers(ways: np.ndarray) -> np.ndarray:
        x, y, z = ways.T
        return np.stack([x, z, z**2, x * x, x * y, x * x * y * y, z**6, x**4 * z], axis=1)

    known = [0, pi, 2 * pi / 3, 2 * pi / 3, 0, 2 * pi / 15, 2 * pi / 7, pi / 8]
    assert_allclose(integrals(powers, side).sum(axis=0), known, atol=1e-12)


def test_integrals_are_each_cells_own() -> None:
    fine = subcells(8, 64)
    rough = fine[..., 0] ** 3 * fine[..., 2] + fine[..., 1]
    exact = integrals(lambda ways: ways[:, :1] ** 3 * ways[:, 2:] + ways[:, 1:2], 8)
    assert_allclose(exact[:, 0], rough.mean(axis=1) * 2 * pi / 64, atol=1e-5)


def test_four_cells_are_one_of_the_coarser_grid() -> None:
    cells = np.random.default_rng(4).random((3, 16, 16)).astype(np.float32)
    means = coarser(cells)
    assert means.shape == (3, 8, 8) and means.dtype == np.float32
    assert means[1, 2, 5] == pytest.approx(cells[1, 4:6, 10:12].mean(), abs=1e-6)
    ways = random_ways(500, seed=5)
    fine = cell_of(ways, 16)
    assert_array_equal(cell_of(ways, 8), fine // 16 // 2 * 8 + fine % 16 // 2)


@pytest.mark.parametrize("shape", [(2, 8), (2, 8, 16), (2, 4, 4), (2, 32, 32), (8, 8)])
def test_other_grids_are_refused_in_a_line(shape: tuple[int, ...]) -> None:
    with pytest.raises(InputError, match="cells") as refusal:
        check_cells(np.zeros(shape, np.float32))
    assert "\n" not in str(refusal.value)
