"""Charts packed into an image keep their shape, their distance and the image's bounds."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from occlusion_bake.core.charts.packing import packed
from occlusion_bake.core.charts.unwrap import unwrap
from occlusion_bake.tests.oracles.chart_layouts import (
    MESHES,
    chart_of,
    check,
    cover,
    cube,
    nearest_strangers,
    sphere,
    uv_area,
)


def shards(count: int) -> tuple[Any, Any, Any]:
    """Loose counter-clockwise triangles of many shapes: what `packed` is given."""
    rng = np.random.default_rng(7)
    uv = rng.random((count, 1, 2)) * 100 + rng.random((count, 3, 2)) * rng.uniform(0.5, 5.0, (count, 1, 2))
    uv[uv_area(uv) < 0.0] = uv[uv_area(uv) < 0.0][:, ::-1]
    return uv, np.arange(count), np.arange(3 * count).reshape(-1, 3)


def bar(length: float) -> tuple[Any, Any, Any]:
    """One chart, `length` long and 1 wide."""
    corners = np.array([[0, 0], [length, 0], [length, 1], [0, 1]], float)
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    return corners[triangles], np.zeros(2, int), triangles


def sides(uv: Any) -> Any:
    """(T, 3) the lengths of the sides."""
    return np.linalg.norm(uv - uv[:, [1, 2, 0]], axis=2)


@pytest.mark.parametrize("size", [(256, 256), (512, 128), (96, 700), (2500, 1100), (1, 1), (7, 300), (5000, 3)])
def test_charts_are_moved_turned_and_scaled_alike(size: tuple[int, int]) -> None:
    uv, piece, triangles = shards(60)
    layout, padding = packed(uv, piece, triangles, size, 2)
    assert layout.min() >= 0.0
    assert layout.max() <= 1.0
    assert 0 <= padding <= 2
    assert (uv_area(layout) > 0.0).all()
    scale = sides(layout * size) / sides(uv)
    assert np.allclose(scale, scale[0, 0], rtol=1e-9)


@pytest.mark.parametrize("size", [(1000, 100), (100, 1000)])
def test_a_long_chart_lies_along_the_longer_side(size: tuple[int, int]) -> None:
    layout, _ = packed(*bar(10.0), size, 4)
    assert uv_area(layout).sum() > 0.9  # upright it would fill a hundredth


@pytest.mark.parametrize("size", [(512, 256), (200, 600)])
@pytest.mark.parametrize("kind", MESHES)
def test_oblong_images(kind: str, size: tuple[int, int]) -> None:
    mesh = MESHES[kind]
    result = unwrap(kind, *mesh, size=size, padding=4)
    check(mesh, result)
    assert result.collapsed == 0
    assert result.padding == 4
    hits, owner = cover(result.uv, chart_of(result.uv), *size)
    assert hits.max() == 1, "triangles overlap"
    assert nearest_strangers(owner, 4) > 4
    assert result.utilisation > 0.3


@pytest.mark.parametrize("size", [(2048, 1024), (300, 1000)])
def test_texels_are_square(size: tuple[int, int]) -> None:
    """A cube's faces are squares in texels, and the stretch is told so."""
    result = unwrap("cube", *cube(), size=size)
    edges = sides(result.uv * size)[::2, :2]
    assert np.allclose(edges, edges.mean(), rtol=1e-3)
    assert result.stretch.l2 == pytest.approx(1.0, abs=1e-3)
    assert result.stretch.angle == pytest.approx(1.0, abs=1e-3)


def test_one_number_is_a_square() -> None:
    assert np.array_equal(unwrap("cube", *cube(), size=96).uv, unwrap("cube", *cube(), size=(96, 96)).uv)


@pytest.mark.parametrize("size", [64, 1000, 2048, 3000])
def test_sizes(size: int) -> None:
    mesh = sphere()
    result = unwrap("sphere", *mesh, size=size)
    check(mesh, result)
    assert result.collapsed == 0
    if size <= 1000:
        _, owner = cover(result.uv, chart_of(result.uv), size, size)
        assert nearest_strangers(owner, result.padding) > result.padding


def test_too_many_charts_cost_padding_not_faces() -> None:
    """400 loose triangles on 64 texels a side: the padding shrinks, nothing is lost."""
    rng = np.random.default_rng(3)
    corners = rng.random((400, 1, 3)) * 100 + rng.random((400, 3, 3))
    triangles = np.arange(1200).reshape(-1, 3).astype(np.int32)
    mesh = corners.reshape(-1, 3).astype(np.float32), triangles, np.arange(400, dtype=np.int32)
    result = unwrap("confetti", *mesh, size=64, padding=4)
    check(mesh, result)
    assert result.count == 400
    assert result.padding < 4
    assert result.collapsed == 0
