"""Visibility masks and mean cells: the bits' order, and RO of openings whose answer is known."""

from __future__ import annotations

from collections.abc import Callable
from math import pi
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from occlusion_bake.core.base.errors import InputError
from occlusion_bake.core.spherical.hemisphere_cells import directions, subcells
from occlusion_bake.core.spherical.lobe import open_horizon
from occlusion_bake.core.spherical.visibility_mask import pack, rebuild, unpack

SIDES = (8, 16)
Doubles = np.ndarray[Any, Any]


def heights(count: int) -> tuple[Doubles, Doubles]:
    """R over the x axis, towards +x, and its angles from the normal."""
    angles = np.linspace(0.0, pi / 2 - 0.05, count)
    return np.stack([np.sin(angles), 0 * angles, np.cos(angles)], axis=1), angles


def lobe(exponent: float, start: float, end: float) -> float:
    """∫ cosᵉ over those angles as a share of that over the half circle: RO of a wedge along y is that alone."""
    steps = np.linspace(-pi / 2, pi / 2, 200001)
    power = np.cos(steps) ** exponent
    return float(power[(steps > start) & (steps < end)].sum() / power.sum())


@pytest.mark.parametrize("side", SIDES)
def test_bits_lie_row_by_row_from_the_least(side: int) -> None:
    row, column = 3, side - 3
    cells = np.zeros((2, side, side), np.float32)
    cells[1, row, column] = 1.0
    masks = pack(cells)
    assert masks.shape == (2, side**2 // 8) and masks.dtype == np.uint8 and not masks[0].any()
    place = row * side + column
    assert masks[1, place // 8] == 1 << place % 8 and np.count_nonzero(masks[1]) == 1
    if side == 8:  # a byte a row; as one number of 64 bits, the least byte first, bit 8 · row + column
        assert int.from_bytes(masks[1].tobytes(), "little") == 1 << (8 * row + column)


@pytest.mark.parametrize("side", SIDES)
def test_there_and_back(side: int) -> None:
    cells = np.random.default_rng(1).random((50, side, side)).astype(np.float32)
    assert_array_equal(unpack(pack(cells)), cells >= 0.5)
    assert unpack(pack(cells)).dtype == np.float32


def test_half_open_is_open() -> None:
    halves = np.float32([0.5, np.nextafter(np.float32(0.5), np.float32(0))])[:, None, None]
    assert_array_equal(pack(np.broadcast_to(halves, (2, 8, 8)))[:, 0], [255, 0])


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("exponent", [0.0, 1.0, 10.0, 100.0, 1000.0, 1e5])
def test_open_is_the_open_horizon_and_shut_is_0(side: int, exponent: float) -> None:
    reflected, angles = heights(40)
    whole = rebuild(np.ones((40, side, side), np.float32), reflected, exponent)
    assert whole.dtype == np.float32
    assert_allclose(whole, open_horizon(exponent, np.cos(angles)), rtol=1e-5)
    assert_array_equal(rebuild(np.zeros((40, side, side), np.float32), reflected, exponent), 0.0)


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("exponent", [1.0, 10.0, 32.0, 100.0])
def test_before_a_wall_that_hides_one_side(side: int, exponent: float) -> None:
    """Cells are open or shut as wholes where the edge is x = 0: so this is exact, but for the pieces of cells."""
    cells = np.zeros((30, side, side), np.float32)
    cells[:, :, side // 2 :] = 1.0
    reflected, angles = heights(30)
    expected = [lobe(exponent, -angle, pi / 2 - angle) for angle in angles]
    assert_allclose(rebuild(cells, reflected, exponent), expected, atol=4e-3)
    away = rebuild(cells, reflected * (-1, 1, 1), exponent)
    assert_allclose(away, open_horizon(exponent, np.cos(angles)) - expected, atol=4e-3)


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("exponent", [1.0, 10.0, 100.0])
def test_the_lobe_is_integrated_over_each_cell(side: int, exponent: float) -> None:
    """Cells drawn at random, the worst there is, against 512 x 512 directions."""
    rng = np.random.default_rng(side)
    cells = (rng.random((24, side, side)) < 0.5).astype(np.float32)
    reflected = directions(*rng.random((2, 24)))
    fine = subcells(side, 512 // side)
    weights = np.maximum(np.einsum("cqk,nk->ncq", fine, reflected), 0) ** exponent
    shares = np.einsum("ncq,nc->n", weights, cells.reshape(24, -1)) / weights.sum(axis=(1, 2))
    expected = shares * open_horizon(exponent, reflected[:, 2])
    assert_allclose(rebuild(cells, reflected, exponent), expected, atol=8e-3)


def test_many_texels_are_as_one_by_one() -> None:
    rng = np.random.default_rng(6)
    cells = rng.random((40000, 8, 8)).astype(np.float32)
    reflected = directions(*rng.random((2, 40000)))
    whole = rebuild(cells, reflected, 10)
    some = np.r_[0:5, 20000:20005, 39995:40000]
    assert_allclose(rebuild(cells[some], reflected[some], 10), whole[some], atol=1e-6)


def test_below_the_horizon_it_is_as_on_it() -> None:
    cells = np.random.default_rng(2).random((3, 8, 8)).astype(np.float32)
    level = np.float64([[1, 0, 0], [0.6, -0.8, 0], [0, 1, 0]])
    assert_allclose(rebuild(cells, 0.8 * level - (0, 0, 0.6), 10), rebuild(cells, level, 10), atol=1e-6)
    assert np.isfinite(rebuild(cells, np.float64([[0, 0, -1]] * 3), 10)).all()


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: pack(np.ones((1, 4, 4), np.float32)), "4 x 4"),
        (lambda: unpack(np.zeros((1, 2), np.uint8)), "4 x 4"),
        (lambda: unpack(np.zeros((1, 9), np.uint8)), "9 bytes"),
        (lambda: rebuild(np.ones((1, 8), np.float32), np.float64([[0, 0, 1]]), 1), "shape"),
        (lambda: rebuild(np.ones((1, 8, 8), np.float32), np.float64([[0, 0, 1]]), -2), "exponent -2"),
    ],
)
def test_what_cannot_be_is_refused_in_a_line(call: Callable[[], object], said: str) -> None:
    with pytest.raises(InputError, match=said) as refusal:
        call()
    assert "\n" not in str(refusal.value)
