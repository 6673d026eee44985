"""Charts that exist, laid side by side: cut and shaped as they were, as dense for each mesh, stacks kept."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from occlusion_bake.core.base.errors import Cancelled, InputError
from occlusion_bake.core.charts.existing import ExistingCharts, islands, side_by_side
from occlusion_bake.core.charts.udim import Udim
from occlusion_bake.tests.oracles.charts.judge import TOLERANCE, surface_areas, uv_areas
from occlusion_bake.tests.oracles.charts.overlaps import overlaps
from occlusion_bake.tests.oracles.charts.polygon_mesh import PolygonMesh
from occlusion_bake.tests.oracles.charts.texel_gaps import kept_padding

SIZE, PADDING = 256, 4


def rectangles(*boxes: tuple[float, float, float, float], area: float | None = None) -> ExistingCharts:
    """Quads of four vertices each, their UVs as left, lower, right, upper; side by side on the surface, as large as in
    the UV map, or as large as `area` together."""
    uv, triangles = [], []
    for number, (left, low, right, high) in enumerate(boxes):
        corners = np.array([(left, low), (right, low), (right, high), (left, high)])
        for fan in ((0, 1, 2), (0, 2, 3)):
            uv.append(corners[list(fan)])
            triangles.append([4 * number + corner for corner in fan])
    uvs, order = np.array(uv, np.float32), np.array(triangles, np.int32)
    scale = 1.0 if area is None else np.sqrt(area / np.abs(uv_areas(uvs)).sum())
    vertices = np.zeros((4 * len(boxes), 3), np.float32)
    vertices[order, :2] = scale * uvs
    vertices[:, 2] = np.repeat(np.arange(len(boxes), dtype=np.int64), 4)  # none in the place of another
    return ExistingCharts(vertices, order, uvs)


def surface(charts: ExistingCharts) -> Any:
    """(T,) areas."""
    return surface_areas(PolygonMesh(charts.vertices, charts.triangles, charts.triangles[:, 0]))


def sides(uv: Any) -> Any:
    """(T, 3) lengths."""
    return np.linalg.norm((uv - uv[:, [1, 2, 0]]).astype(np.float64), axis=2)


def in_texels(*layouts: Any) -> Any:
    """(T, 3, 2) of all."""
    return np.concatenate(layouts).astype(np.float64) * SIZE


def laid(*maps: ExistingCharts, size: tuple[int, int] = (SIZE, SIZE)) -> Any:
    result = side_by_side("Set", maps, size, PADDING)
    assert [uv.shape for uv in result.uv] == [each.uv.shape for each in maps]
    assert all(uv.dtype == np.float32 and uv.min() >= 0.0 and uv.max() <= 1.0 for uv in result.uv)
    return result


def test_maps_that_filled_the_square_share_it() -> None:
    """Three objects with the same UVs: no texel is of two, and the padding is kept between them."""
    result = laid(*(rectangles((0, 0, 0.5, 1), (0.5, 0, 1, 0.6)) for _ in range(3)))
    assert result.count == 6 and result.padding == PADDING
    texels = in_texels(*result.uv)
    assert not len(overlaps(texels, TOLERANCE)[0])
    assert kept_padding(texels, np.repeat(np.arange(6, dtype=np.int64), 2), SIZE, SIZE, PADDING) == PADDING
    assert uv_areas(np.concatenate(result.uv)).sum() > 0.5


def test_each_mesh_gets_texels_by_its_size_in_the_world() -> None:
    """However large it was drawn; within a mesh charts keep their sizes."""
    small, large = rectangles((0, 0, 0.9, 0.9), area=1.0), rectangles((0, 0, 0.1, 0.2), (0.5, 0, 0.6, 0.1), area=5.0)
    one, two = laid(small, large).uv
    densities = [np.abs(uv_areas(uv)) / surface(each) for uv, each in ((one, small), (two, large))]
    np.testing.assert_allclose(np.concatenate(densities), densities[0][0], rtol=1e-4)


def test_a_chart_keeps_its_shape() -> None:
    """Turned by quarters at most, and mirrored where it was."""
    rng = np.random.default_rng(2)
    fan = rng.random((6, 2)).astype(np.float32) * 0.2
    triangles = np.array([[0, 1, 2], [2, 1, 3], [2, 3, 4], [4, 3, 5]], np.int32)
    uv = fan[triangles] + np.float32(0.4)
    mirrored = uv * np.array([-1, 1], np.float32)
    vertices = np.pad(fan, ((0, 0), (0, 1)))
    both = [ExistingCharts(vertices, triangles, each) for each in (uv, mirrored)]
    result = laid(*both)
    for before, after in zip((uv, mirrored), result.uv, strict=True):
        scale = np.sqrt(np.abs(uv_areas(after)).sum() / np.abs(uv_areas(before)).sum())
        np.testing.assert_allclose(sides(after), scale * sides(before), atol=1e-5)
        assert (np.sign(uv_areas(after)) == np.sign(uv_areas(before))).all()


def test_charts_of_one_mesh_upon_one_another_stay_so() -> None:
    """Two copies, one of them mirrored, and a part of them beside; those of another mesh are not of the stack."""
    stacked = rectangles((0, 0, 0.4, 0.4), (0.4, 0, 0, 0.4), (0.1, 0.1, 0.2, 0.2), (0.6, 0.6, 0.9, 0.9))
    result = laid(stacked, rectangles((0, 0, 0.4, 0.4)))
    assert result.count == 3
    first, other = result.uv
    box = [(part.min(axis=(0, 1)), part.max(axis=(0, 1))) for part in (first[:2], first[2:4], first[4:6])]
    np.testing.assert_allclose(box[0], box[1], atol=1e-6)
    assert (box[2][0] > box[0][0]).all() and (box[2][1] < box[0][1]).all()
    assert not len(overlaps(in_texels(first[:2], first[6:], other), TOLERANCE)[0])


def test_copies_moved_aside_by_whole_tiles_lie_upon_one_another() -> None:
    moved = rectangles((0, 0, 0.4, 0.4), (1, 0, 1.4, 0.4), (3, 2, 3.4, 2.4))
    apart = laid(moved)
    assert apart.count == 3
    result = laid(replace(moved, udim=Udim.STACKED))
    assert result.count == 1
    np.testing.assert_allclose(result.uv[0][:2], result.uv[0][2:4], atol=1e-6)
    assert np.abs(uv_areas(result.uv[0]))[:2].sum() > 2.0 * np.abs(uv_areas(apart.uv[0]))[:2].sum()


def test_charts_of_other_tiles_are_brought_in() -> None:
    result = laid(rectangles((0, 0, 0.9, 0.9), (1, 0, 1.9, 0.9), (-7, 4, -6.1, 4.9)))
    assert result.count == 3 and np.abs(uv_areas(result.uv[0])).sum() > 0.5


def test_charts_that_touch_are_not_upon_one_another() -> None:
    """Nor are those that overlap by what is rounded."""
    result = laid(rectangles((0, 0, 0.3, 0.3), (0.3, 0, 0.6, 0.3), (0, 0.299999, 0.3, 0.6)))
    assert result.count == 3


def test_islands_hang_together_by_vertex_and_place() -> None:
    """Two triangles at an edge; the same edge with other UVs; the same UVs at other vertices; one shared corner."""
    uv = np.array(
        [
            [(0, 0), (1, 0), (0, 1)],
            [(1, 0), (1, 1), (0, 1)],
            [(3, 0), (3, 1), (2, 1)],
            [(0, 0), (1, 0), (0, 1)],
            [(1, 1), (2, 1), (2, 2)],
        ],
        np.float64,
    )
    triangles = np.array([[0, 1, 2], [1, 3, 2], [1, 3, 2], [4, 5, 6], [3, 7, 8]])
    assert islands(triangles, uv).tolist() == [0, 0, 1, 2, 0]
    assert islands(triangles, np.where(uv == 0.0, -0.0, uv)).tolist() == [0, 0, 1, 2, 0]


def test_what_covers_nothing_covers_nothing() -> None:
    """UVs in one point, UVs that are no numbers, and faces without an area on the surface, beside a good one."""
    good = rectangles((0, 0, 0.5, 0.5), (0.5, 0.5, 0.5, 0.5), (0.6, 0, 0.9, 0.3), (0, 0.6, 0.3, 0.9))
    good.uv[4] = np.nan
    good.uv[5, 1, 0] = np.inf
    good.vertices[12:] = 0.0
    result = laid(good)
    assert result.count == 1 and np.isfinite(result.uv[0]).all()
    assert (uv_areas(result.uv[0][2:]) == 0.0).all()
    assert np.abs(uv_areas(result.uv[0][:2])).sum() > 0.8


@pytest.mark.parametrize("what", ["uv", "vertices"])
def test_where_nothing_has_an_area_a_line_says_so(what: str) -> None:
    flat = rectangles((0, 0, 0.5, 0.5))
    getattr(flat, what)[:] = 0.0
    with pytest.raises(InputError, match=r"^Set: no face has an area"):
        side_by_side("Set", [flat], (SIZE, SIZE), PADDING)


def test_texels_are_square_in_images_that_are_not() -> None:
    result = laid(rectangles((0, 0, 0.5, 0.5), (0.5, 0.5, 1, 1)), size=(256, 64))
    lengths = sides(result.uv[0] * np.array([256, 64], np.float32))
    np.testing.assert_allclose(
        lengths / lengths[0, 0], np.where(lengths > 1.2 * lengths[0, 0], np.sqrt(2.0), 1.0), rtol=1e-3
    )


def test_a_hundred_charts_on_one_point() -> None:
    """And one that lies upon all others: each is one piece with them."""
    points = rectangles(*[(0.5, 0.5, 0.5, 0.5)] * 100, (0, 0, 1, 1))
    assert laid(points).count == 1
    pile = rectangles(*[(0.5 - 1e-3 * i, 0.5 - 1e-3 * i, 0.5 + 1e-3 * i, 0.5 + 1e-3 * i) for i in range(1, 101)])
    assert laid(pile).count == 1


def test_a_heap_with_more_pairs_than_are_looked_for_stays_as_it_is() -> None:
    heap = rectangles(*[(0, 0, 1, 1)] * 1200, (2, 0, 3, 1))
    result = laid(heap)
    assert result.count == 1
    scale = np.sqrt(np.abs(uv_areas(result.uv[0][:1])).sum() / 0.5)
    np.testing.assert_allclose(result.uv[0][2400:], result.uv[0][:2] + np.array([2 * scale, 0]), atol=1e-5)


def test_it_is_told_and_can_be_stopped() -> None:
    told: list[str] = []
    maps = [rectangles((0, 0, 1, 1))]
    side_by_side("Set", maps, (SIZE, SIZE), PADDING, progress=lambda _, stage: told.append(stage))
    assert list(dict.fromkeys(told)) == ["looking for charts", "packing charts", "measuring charts"]

    def stop(*_: Any) -> None:
        raise Cancelled

    with pytest.raises(Cancelled):
        side_by_side("Set", maps, (SIZE, SIZE), PADDING, progress=stop)
