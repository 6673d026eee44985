"""What a coarse image tells a finer one: values between its texels, and where it tells too little."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from occlusion_bake.core.base.arrays import Doubles, Floats
from occlusion_bake.core.rays.texel_surface import TexelSurface
from occlusion_bake.core.scene.scene import Mesh
from occlusion_bake.core.solve.upsample import Estimates, Upsampled, upsampled
from occlusion_bake.tests.oracles import shapes
from occlusion_bake.tests.oracles.sheet import Sheet, ramp

SIDE = 64
KNOWN = 1e-6  # the square of the error of coarse values


def told(fine: Sheet, *rows: Doubles, coarse: TexelSurface | None = None) -> Upsampled:
    coarse = coarse or fine.surface.coarser()
    images = [row.astype(np.float32) for row in rows]
    error = np.full(coarse.owner.shape, KNOWN, dtype=np.float32)
    return upsampled(coarse, Estimates(images, error, 7), fine.surface, 1.0)


def at(surface: TexelSurface, values: Doubles) -> Doubles:
    return np.where(surface.covered, values, 0.0)


@pytest.mark.parametrize("turned", [False, True])
def test_what_is_linear_on_a_plane_is_told_exactly(turned: bool) -> None:
    """But for the ridge on slopes, where texels lie on one side alone."""
    plane = shapes.quad((-1, -1, 0.3), (2, 0.4, 0.1), (-0.3, 2, 0.5)) if turned else shapes.plane(1.0)
    sheet = Sheet(plane, SIDE)
    coarse = sheet.surface.coarser()
    x, y, z = np.moveaxis(coarse.positions.astype(np.float64), -1, 0)
    result = told(sheet, 0.5 + 0.2 * x - 0.1 * y + 0.07 * z, coarse=coarse)
    inner = slice(2, -2)
    assert_allclose(result.rows[0][inner, inner], ramp(sheet)[inner, inner], atol=2e-4)
    assert np.abs(result.rows[0] - ramp(sheet)).max() < 5e-3
    assert result.detail[inner, inner].max() < 1e-5
    assert result.rays == 7


def test_what_follows_the_normals_is_told_on_a_curved_surface() -> None:
    """Half the height of the normal, over a smooth ball: its place alone would be off by the bend between texels."""
    sheet = Sheet(shapes.sphere((0.0, 0.0, 0.0), 1.0, 64), 128)
    coarse = sheet.surface.coarser()
    result = told(sheet, at(coarse, 0.5 + 0.5 * coarse.normals[..., 2].astype(np.float64)), coarse=coarse)
    right = 0.5 + 0.5 * sheet.normals[..., 2]
    off = np.abs(result.rows[0] - right)[sheet.owned & (result.detail < 1e-3)]
    assert np.quantile(off, 0.99) < 2e-3 and len(off) > 0.95 * sheet.owned.sum()


def test_each_row_is_told_by_the_same_weights() -> None:
    sheet = Sheet(shapes.plane(1.0), SIDE)
    random = np.random.default_rng(0).random((SIDE // 2, SIDE // 2))
    first, second = told(sheet, random, 1.0 - random).rows
    assert_allclose(first + second, 1.0, atol=1e-5)


def test_an_edge_between_coarse_texels_is_detail_and_nothing_else_is() -> None:
    sheet = Sheet(shapes.plane(1.0), SIDE)
    step = np.where(np.arange(SIDE // 2, dtype=np.int64) < SIDE // 4, 0.2, 0.8) * np.ones((SIDE // 2, 1))
    detail = told(sheet, step).detail
    beside = slice(SIDE // 2 - 1, SIDE // 2 + 1)
    assert detail[:, beside].min() > 0.01
    far = np.ones(SIDE, dtype=bool)
    far[SIDE // 2 - 4 : SIDE // 2 + 4] = False
    assert detail[:, far].max() < 1e-6


def test_charts_that_touch_in_the_image_do_not_mix() -> None:
    """Two squares side by side in the texture, each of a value of its own, that lie apart on one plane."""
    left = shapes.quad((-1, -1, 0), (2, 0, 0), (0, 2, 0), cell=(0.0, 0.0, 0.5, 1.0))
    right = shapes.quad((40, -1, 0), (2, 0, 0), (0, 2, 0), cell=(0.5, 0.0, 1.0, 1.0))
    sheet = Sheet(shapes.joined([left, right]), SIDE)
    coarse = sheet.surface.coarser()
    values = told(sheet, np.where(coarse.owner >= 2, 0.9, 0.1) * coarse.covered, coarse=coarse).rows[0]
    assert_allclose(values[sheet.owned], np.where(sheet.owner >= 2, 0.9, 0.1)[sheet.owned], atol=1e-5)


@pytest.mark.parametrize("turned", [False, True])
def test_texels_of_two_sizes_side_by_side_on_one_plane(turned: bool) -> None:
    """A slope goes on across the line where texels become four times as large, inside of a block, from either side."""
    fine, coarse_part = ((0.0, 34 / SIDE), (34 / SIDE, 1.0)) if not turned else ((30 / SIDE, 1.0), (0.0, 30 / SIDE))
    spans = (34 / SIDE, 4 * 30 / SIDE)
    cells = [(low, 0.0, high, 1.0) for low, high in (fine, coarse_part)]
    starts = (0.0, spans[0]) if not turned else (spans[1], 0.0)
    quads = [
        shapes.quad((start, 0, 0), (span, 0, 0), (0, 1, 0), cell=cell)
        for start, span, cell in zip(starts, spans, cells, strict=True)
    ]
    sheet = Sheet(shapes.joined(quads), SIDE)
    coarse = sheet.surface.coarser()
    result = told(sheet, at(coarse, 0.2 * coarse.positions[..., 0].astype(np.float64)), coarse=coarse)
    step = 0.2 / SIDE  # from one fine texel to the next
    middle = slice(2, -2)
    assert np.abs(result.rows[0] - 0.2 * sheet.places[..., 0])[middle, 4:-4].max() < 1.0 * step


def test_what_has_no_coarse_texel_of_its_own_is_not_told() -> None:
    """The halves of a coarse texel belong to two sides of an edge: one of them has it, and the other is all detail."""
    fine = Sheet(shapes.room(), 96)
    coarse = fine.surface.coarser()
    empty = TexelSurface(coarse.mesh, np.full_like(coarse.owner, -1))
    detail = told(fine, np.zeros(coarse.owner.shape), coarse=empty).detail
    assert np.all(detail[fine.owned] == 1.0) and np.all(detail[~fine.owned] == 0.0)


def threads_of(mesh: Mesh, threads: int) -> Floats:
    sheet = Sheet(mesh, SIDE)
    fine = TexelSurface(sheet.surface.mesh, sheet.owner, threads=threads)
    coarse = fine.coarser()
    values = np.random.default_rng(1).random(coarse.owner.shape).astype(np.float32)
    result = upsampled(coarse, Estimates([values], np.full_like(values, KNOWN), 0), fine, 1.0)
    return np.stack([*result.rows, result.expected, result.detail])


def test_the_bits_are_the_same_for_any_number_of_threads() -> None:
    ball = shapes.sphere((0.0, 0.0, 0.0), 1.0, 16)
    assert_array_equal(threads_of(ball, 1), threads_of(ball, 5))


def test_a_coarser_surface_has_all_that_is_owned() -> None:
    sheet = Sheet(shapes.sphere((0.0, 0.0, 0.0), 1.0, 16), SIDE)
    coarse = sheet.surface.coarser()
    four = sheet.owner.reshape(SIDE // 2, 2, SIDE // 2, 2).transpose(0, 2, 1, 3).reshape(SIDE // 2, SIDE // 2, 4)
    assert_array_equal(coarse.covered, (four >= 0).any(axis=2))
    assert np.all((four == coarse.owner[..., None]).any(axis=2))
