"""Margins: covered texels untouched, exact rings, symmetric, nothing around the corner."""

from __future__ import annotations

import numpy as np
import pytest
from occlusion_bake.core.base.errors import InputError
from occlusion_bake.core.finish.margin import fill_margin


def scattered(seed: int, height: int = 41, width: int = 58, share: float = 0.02) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(seed)
    return random.random((height, width), dtype=np.float32), random.random((height, width)) < share


def chessboard_distance(covered: np.ndarray) -> np.ndarray:
    """(h, w) int: steps of a king to the nearest covered texel, by comparing with every one."""
    rows, columns = np.nonzero(covered)
    down = np.abs(np.arange(covered.shape[0], dtype=np.int64)[:, None, None] - rows)
    right = np.abs(np.arange(covered.shape[1], dtype=np.int64)[None, :, None] - columns)
    return np.maximum(down, right).min(axis=-1)


def by_definition(values: np.ndarray, covered: np.ndarray, pixels: int) -> np.ndarray:
    """The margin a texel at a time."""
    filled, known = np.where(covered, values, 0.0).astype(np.float64), covered.copy()
    height, width = covered.shape
    for _ in range(pixels):
        before, was_known = filled.copy(), known.copy()
        for y, x in np.argwhere(~was_known):
            around = np.s_[max(0, y - 1) : min(height, y + 2), max(0, x - 1) : min(width, x + 2)]
            if was_known[around].any():
                filled[y, x] = np.float32(before[around][was_known[around]].mean())
                known[y, x] = True
    filled[~known] = values[covered].mean(dtype=np.float64)
    return filled.astype(np.float32)


@pytest.mark.parametrize("pixels", [0, 1, 2, 5, 100])
def test_the_margin_is_the_one_defined(pixels: int) -> None:
    values, covered = scattered(pixels)
    assert np.allclose(fill_margin(values, covered, pixels), by_definition(values, covered, pixels), atol=2e-7, rtol=0)


def test_covered_texels_keep_their_bits_even_when_black() -> None:
    values, covered = scattered(1, share=0.3)
    values[:20] = 0.0
    filled = fill_margin(values, covered, 3)
    assert filled.dtype == np.float32
    assert np.array_equal(filled[covered], values[covered])
    assert np.array_equal(fill_margin(filled, covered, 3), filled)


def test_black_charts_get_black_margins() -> None:
    covered = np.zeros((9, 20), dtype=bool)
    covered[4, 2], covered[4, 17] = True, True
    values = np.where(np.arange(20, dtype=np.int64) < 10, 0.0, 1.0).astype(np.float32) * np.ones(
        (9, 1), dtype=np.float32
    )
    filled = fill_margin(values, covered, 2)
    assert np.all(filled[2:7, 0:5] == 0.0)
    assert np.all(filled[2:7, 15:20] == 1.0)


def test_uncovered_input_is_ignored() -> None:
    values, covered = scattered(2)
    spoiled = np.where(covered, values, np.float32(np.nan))
    assert np.array_equal(fill_margin(values, covered, 4), fill_margin(spoiled, covered, 4))


@pytest.mark.parametrize("level", [0.0, 1.0 / 3.0, 0.1, 1.0])
def test_a_constant_stays_that_constant(level: float) -> None:
    _, covered = scattered(3)
    values = np.full(covered.shape, level, dtype=np.float32)
    assert np.all(fill_margin(values, covered, 6) == np.float32(level))


@pytest.mark.parametrize("pixels", [1, 2, 7])
def test_the_reach_is_exact_and_beyond_it_lies_the_mean(pixels: int) -> None:
    covered = np.zeros((60, 70), dtype=bool)
    covered[20:24, 30:33] = True
    covered[50, 5] = True
    values = np.full(covered.shape, 0.25, dtype=np.float32)
    values[50, 5] = 0.9
    filled = fill_margin(values, covered, pixels)
    distance = chessboard_distance(covered)
    mean = np.float32(values[covered].mean(dtype=np.float64))
    assert np.all(filled[distance > pixels] == mean)
    assert np.all(np.isin(filled[distance <= pixels], np.array([0.25, 0.9], dtype=np.float32)))


def test_the_margin_does_not_wrap_around_the_image() -> None:
    covered = np.zeros((12, 14), dtype=bool)
    covered[0, 0] = covered[6, 7] = True
    values = np.zeros(covered.shape, dtype=np.float32)
    values[0, 0] = 1.0
    filled = fill_margin(values, covered, 2)
    assert np.all(filled[:3, :3] == 1.0)
    assert filled[0, -1] == filled[-1, 0] == filled[-1, -1] == filled[1, -1] == np.float32(0.5)


@pytest.mark.parametrize(
    "turn", [np.flipud, np.fliplr, np.transpose, np.rot90, lambda image: np.rot90(image, 2)], ids=lambda turn: "turn"
)
def test_a_turned_image_has_a_turned_margin(turn) -> None:
    values, covered = scattered(5)
    values *= np.float32(10.0) ** np.random.default_rng(5).integers(-30, 0, values.shape).astype(np.float32)
    straight = fill_margin(values, covered, 9)
    turned = fill_margin(np.ascontiguousarray(turn(values)), np.ascontiguousarray(turn(covered)), 9)
    assert np.array_equal(turned, turn(straight))


def test_margins_lie_between_what_surrounds_them() -> None:
    values, covered = scattered(6)
    filled = fill_margin(values, covered, 100)
    assert values[covered].min() <= filled.min()
    assert filled.max() <= values[covered].max()


def test_nothing_covered_is_open_and_everything_covered_is_untouched() -> None:
    values, _ = scattered(7)
    assert np.all(fill_margin(values, np.zeros(values.shape, dtype=bool), 4) == 1.0)
    assert np.array_equal(fill_margin(values, np.ones(values.shape, dtype=bool), 4), values)


def test_the_input_is_not_changed() -> None:
    values, covered = scattered(8)
    kept = values.copy(), covered.copy()
    fill_margin(values, covered, 4)
    assert np.array_equal(values, kept[0])
    assert np.array_equal(covered, kept[1])


def test_one_texel_images() -> None:
    one = np.full((1, 1), 0.5, dtype=np.float32)
    assert fill_margin(one, np.ones((1, 1), dtype=bool), 3)[0, 0] == np.float32(0.5)
    assert fill_margin(one, np.zeros((1, 1), dtype=bool), 3)[0, 0] == 1.0


def test_a_negative_margin_and_unlike_shapes_are_refused() -> None:
    values, covered = scattered(9)
    with pytest.raises(InputError, match="0 texels or more"):
        fill_margin(values, covered, -1)
    with pytest.raises(InputError, match="differ"):
        fill_margin(values, covered[:-1], 1)
    with pytest.raises(InputError, match="differ"):
        fill_margin(values[..., None], covered[..., None], 1)
