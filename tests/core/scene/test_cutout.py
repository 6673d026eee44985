"""Opacity at a place of a triangle: exact at texels, as numpy pads beyond them, and opaque where it must be."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from occlusion_bake.core.base.errors import InputError
from occlusion_bake.core.scene.cutout import OPAQUE, Alpha, Cutout, opacity, simplified
from occlusion_bake.core.scene.image_texture import Wrap, sampled

PADDING = {Wrap.REPEAT: "wrap", Wrap.EXTEND: "edge", Wrap.CLIP: "constant", Wrap.MIRROR: "symmetric"}
HALVES = np.float32([[1.0, 1.0, 0.0, 0.0]] * 4)  # opaque for u < 1/2


def alpha(values: Any, linear: bool = False, wrap: Wrap = Wrap.REPEAT) -> Alpha:
    return Alpha(np.array(values, dtype=np.float32), linear, wrap)


def cutout(picture: Alpha, *corners: Any) -> Cutout:
    """A triangle for each three UVs."""
    uv = np.array(corners, dtype=np.float32)
    return Cutout([picture], np.zeros(len(uv), dtype=np.int32), uv)


def places(count: int, seed: int = 0) -> np.ndarray:
    """Points within three pictures of the middle one."""
    return np.random.default_rng(seed).uniform(-3.0, 4.0, (count, 2))


@pytest.mark.parametrize("wrap", Wrap)
@pytest.mark.parametrize("linear", [False, True])
def test_texels_have_their_values_in_their_middles(linear: bool, wrap: Wrap) -> None:
    values = np.random.default_rng(1).random((3, 5), dtype=np.float32)
    row, column = (each.ravel() for each in np.indices(values.shape, dtype=np.int64))
    uv = np.stack([(column + 0.5) / 5, 1.0 - (row + 0.5) / 3], axis=1)
    assert_allclose(sampled(alpha(values, linear, wrap), uv), values.ravel(), atol=1e-6)


@pytest.mark.parametrize("wrap", Wrap)
def test_beyond_its_edges_a_picture_goes_on_as_numpy_pads_it(wrap: Wrap) -> None:
    values = np.random.default_rng(2).random((3, 4), dtype=np.float32)
    padded = np.pad(values, ((12, 12), (16, 16)), mode=PADDING[wrap])  # four pictures more on each side
    uv = places(2000)
    for linear in (False, True):
        within = (uv + 4.0) / 9.0
        whole = sampled(alpha(padded, linear, Wrap.EXTEND), within)
        assert_allclose(sampled(alpha(values, linear, wrap), uv), whole, atol=1e-5)


def test_between_four_middles_values_are_bilinear() -> None:
    picture = alpha([[0.0, 0.4], [0.2, 1.0]], linear=True)
    x, y = np.random.default_rng(3).random((2, 100))
    expected = (1 - y) * (0.2 * (1 - x) + 1.0 * x) + y * (0.0 * (1 - x) + 0.4 * x)
    assert_allclose(sampled(picture, np.stack([0.25 + 0.5 * x, 0.25 + 0.5 * y], axis=1)), expected, atol=1e-6)


def test_a_clipped_picture_fades_over_the_texel_beyond_its_edge() -> None:
    picture = alpha(np.ones((4, 4)), linear=True, wrap=Wrap.CLIP)
    u = np.array([0.5, 0.125, 0.0, -0.0625, -0.125, -0.2, 7.0])
    expected = [1.0, 1.0, 0.5, 0.25, 0.0, 0.0, 0.0]
    assert_allclose(sampled(picture, np.stack([u, np.full(7, 0.5)], axis=1)), expected, atol=1e-6)


def test_a_texel_begins_at_its_lower_left_edge() -> None:
    picture = alpha([[0.1, 0.2], [0.3, 0.4]])
    uv = np.array([(0.0, 0.0), (0.5, 0.0), (0.0, 0.5), (0.5, 0.5)])
    assert_allclose(sampled(picture, uv), [0.3, 0.4, 0.1, 0.2])


def test_places_as_far_as_float32_reaches_are_within_the_picture() -> None:
    uv = np.array([(3e38, -3e38), (-1e20, 1e20)])
    for wrap in Wrap:
        values = sampled(alpha([[0.25, 0.75], [0.5, 1.0]], True, wrap), uv)
        assert np.isfinite(values).all() and (values >= 0.0).all() and (values <= 1.0).all()


def test_a_triangle_is_looked_up_by_its_own_corners() -> None:
    """Of two triangles with two pictures, each corner's weight leads to that corner's texel."""
    first, second = alpha([[0.1, 0.2], [0.3, 0.4]]), alpha([[0.5]])
    uv = np.float32([[(0.25, 0.25), (0.75, 0.25), (0.75, 0.75)]] * 3)
    mesh = Cutout([first, second], np.int32([0, 1, OPAQUE]), uv)
    corners = np.eye(3, dtype=np.float32)
    assert_allclose(opacity(mesh, np.int32([0, 0, 0]), corners), [0.3, 0.4, 0.2])
    assert_allclose(opacity(mesh, np.int32([1, 2, 0]), corners), [0.5, 1.0, 0.2])


def test_a_triangle_without_finite_uvs_is_opaque() -> None:
    mesh = cutout(
        alpha([[0.0]]), [(0, 0), (1, 0), (0, np.nan)], [(0, 0), (1, np.inf), (0, 1)], [(0, 0), (1, 0), (0, 1)]
    )
    weights = np.full((3, 3), 1 / 3, dtype=np.float32)
    assert_array_equal(opacity(mesh, np.int32([0, 1, 2]), weights), [1.0, 1.0, 0.0])
    found = simplified(mesh)
    assert found is not None and found.alpha.tolist() == [OPAQUE, OPAQUE, 0]


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (np.zeros((0, 3)), "shape (0, 3)"),
        (np.zeros((2, 2, 1)), "shape (2, 2, 1)"),
        ([[0.5, 1.5]], "from 0 to 1"),
        ([[-0.1, 1.0]], "from 0 to 1"),
        ([[np.nan, 1.0]], "from 0 to 1"),
    ],
)
def test_a_picture_that_is_none_is_refused(values: Any, words: str) -> None:
    with pytest.raises(InputError) as caught:
        alpha(values)
    assert words in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("numbers", "triangles", "words"),
    [([0, 0], 1, "(1, 3, 2)"), ([[0]], 1, "do not fit"), ([1], 1, "does not exist"), ([-2], 1, "does not exist")],
)
def test_arrays_that_do_not_fit_are_refused(numbers: Any, triangles: int, words: str) -> None:
    with pytest.raises(InputError) as caught:
        Cutout([alpha([[0.5]])], np.int32(numbers), np.zeros((triangles, 3, 2), dtype=np.float32))
    assert words in str(caught.value) and "\n" not in str(caught.value)


def test_a_picture_knows_whether_it_lets_light_through() -> None:
    assert alpha(np.ones((3, 3))).opaque
    assert not alpha([[1.0, 0.999]]).opaque
    assert not alpha(np.ones((3, 3)), wrap=Wrap.CLIP).opaque  # clear beyond


def test_only_what_lets_light_through_is_left() -> None:
    """Pictures that are opaque, or used no more, go; a clear one stays."""
    pictures = [alpha([[1.0]]), alpha([[0.0]]), alpha([[0.5]]), alpha([[0.2]])]
    uv = np.zeros((5, 3, 2), dtype=np.float32)
    found = simplified(Cutout(pictures, np.int32([3, 0, OPAQUE, 1, 3]), uv))
    assert found is not None
    assert found.alphas == [pictures[1], pictures[3]]
    assert found.alpha.dtype == np.int32 and found.alpha.tolist() == [1, OPAQUE, OPAQUE, 0, 1]


def test_nothing_is_left_of_what_is_opaque() -> None:
    uv = np.zeros((2, 3, 2), dtype=np.float32)
    assert simplified(Cutout([alpha([[1.0, 1.0]])], np.int32([0, OPAQUE]), uv)) is None
    assert simplified(Cutout([], np.int32([OPAQUE, OPAQUE]), uv)) is None
    assert simplified(Cutout([], np.empty(0, np.int32), np.empty((0, 3, 2), np.float32))) is None


def test_a_trunk_on_the_same_picture_as_its_leaves_is_opaque() -> None:
    """By where it lies in the picture: two texels from the nearest that is not, or in any of its repeats."""
    picture = alpha(np.repeat(HALVES, 8, axis=1), linear=True)  # 32 wide, opaque to 16
    trunk = np.array([(0.1, 0.1), (0.4, 0.1), (0.4, 0.9)])
    shifts = np.array([(0.0, 0.0), (0.2, 0.0), (0.5, 0.0), (-7.0, 5.0)])
    found = simplified(cutout(picture, *(trunk + shift for shift in shifts)))
    assert found is not None and found.alpha.tolist() == [OPAQUE, 0, 0, OPAQUE]


@pytest.mark.parametrize(
    ("wrap", "expected"),
    [
        (Wrap.REPEAT, [OPAQUE, 0, OPAQUE, 0]),
        (Wrap.EXTEND, [OPAQUE, OPAQUE, 0, 0]),
        (Wrap.CLIP, [OPAQUE, 0, 0, 0]),
        (Wrap.MIRROR, [OPAQUE, OPAQUE, 0, OPAQUE]),
    ],
)
def test_what_lies_beyond_an_edge_counts(wrap: Wrap, expected: list[int]) -> None:
    """Triangles in the opaque half, across u = 0, in the next picture's first half, and in its second half."""
    picture = alpha(np.repeat(HALVES, 16, axis=1), wrap=wrap)
    triangle = np.array([(0.1, 0.3), (0.2, 0.3), (0.2, 0.6)])
    shifts = np.array([(0.0, 0.0), (-0.15, 0.0), (1.0, 0.0), (1.6, 0.0)])
    found = simplified(cutout(picture, *(triangle + shift for shift in shifts)))
    assert found is not None and found.alpha.tolist() == expected


@pytest.mark.parametrize("wrap", Wrap)
@pytest.mark.parametrize("linear", [False, True])
def test_what_is_marked_opaque_is_so_everywhere_and_hardly_more_is_left(linear: bool, wrap: Wrap) -> None:
    """Triangles of all sizes and places over spots: none that was marked has a point that is not opaque, and of those
    left each has a spot in its box or near it."""
    rng = np.random.default_rng(4)
    values = np.ones((24, 40), dtype=np.float32)
    values[rng.integers(0, 24, 5), rng.integers(0, 40, 5)] = 0.5
    middle, radius = rng.uniform(-1.5, 2.5, (1500, 1, 2)), 10.0 ** rng.uniform(-3.0, 0.3, (1500, 1, 1))
    mesh = cutout(alpha(values, linear, wrap), *(middle + radius * rng.uniform(-0.5, 0.5, (1500, 3, 2))))
    found = simplified(mesh)
    assert found is not None
    marked = found.alpha == OPAQUE
    weights = rng.dirichlet((0.7, 0.7, 0.7), 64).astype(np.float32)
    points = [opacity(mesh, np.full(64, i, np.int32), weights).min() for i in range(1500)]
    assert (np.array(points)[marked] == 1.0).all()
    low, high = mesh.uv.min(axis=1), mesh.uv.max(axis=1)
    reach = 2.6 / np.array((40.0, 24.0))
    grid = np.stack(np.meshgrid(*[np.linspace(0.0, 1.0, 60)] * 2), axis=-1).reshape(-1, 2)
    for i in np.flatnonzero(~marked)[:200]:
        box = low[i] - reach + grid * (high[i] - low[i] + 2 * reach)
        assert sampled(mesh.alphas[0], box).min() < 1.0
    assert 0.02 < marked.mean() < 0.98
