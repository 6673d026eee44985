"""Charts packed into an image keep their shape, their distance and the image's bounds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from occlusion_bake.core.base.errors import Cancelled, InputError
from occlusion_bake.core.base.kernel_api import Control
from occlusion_bake.core.charts.packing import expected_scale, packed
from occlusion_bake.core.charts.unwrap import unwrap
from occlusion_bake.tests.oracles.charts.hard_surface import cube
from occlusion_bake.tests.oracles.charts.judge import assert_sound, uv_areas
from occlusion_bake.tests.oracles.charts.kinds import PLAIN
from occlusion_bake.tests.oracles.charts.loose_pieces import loose_triangles
from occlusion_bake.tests.oracles.charts.round_shapes import sphere
from occlusion_bake.tests.oracles.charts.texel_gaps import kept_padding

Pieces = tuple[Any, Any]  # (T, 3, 2) UVs and (T,) the charts


def shards(count: int) -> Pieces:
    """Loose counter-clockwise triangles of many shapes."""
    rng = np.random.default_rng(7)
    uv = rng.random((count, 1, 2)) * 100 + rng.random((count, 3, 2)) * rng.uniform(0.5, 5.0, (count, 1, 2))
    uv[uv_areas(uv) < 0.0] = uv[uv_areas(uv) < 0.0][:, ::-1]
    return uv, np.arange(count, dtype=np.int64)


def boxes(*sizes: tuple[float, float]) -> Pieces:
    """Rectangles of so much width and height, their lower left corners at the origin."""
    size = np.array(sizes, float)[:, None]
    corners = size * np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
    return corners[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3, 2), np.repeat(np.arange(len(sizes), dtype=np.int64), 2)


def arc(inner: float, outer: float, share: float = 1.0, sides: int = 48) -> Any:
    """(T, 3, 2): a ring about the origin, or a part of one."""
    angle = 2 * np.pi * share * np.arange(sides + 1, dtype=np.int64) / sides
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    if share == 1.0:
        ring[-1] = ring[0]
    quads = np.stack([inner * ring[:-1], outer * ring[:-1], outer * ring[1:], inner * ring[1:]], axis=1)
    return quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3, 2)


def together(shapes: Sequence[Any]) -> Pieces:
    return np.concatenate(shapes), np.repeat(np.arange(len(shapes), dtype=np.int64), [len(shape) for shape in shapes])


def turned(uv: Any, angle: float) -> Any:
    return uv @ np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])


def curls(count: int) -> Pieces:
    """Parts of rings, turned any way."""
    rng = np.random.default_rng(3)
    return together(
        [
            turned(arc(inner, 1.0, share), angle) * size
            for inner, share, angle, size in zip(
                rng.uniform(0.0, 0.9, count),
                rng.uniform(0.2, 1.0, count),
                rng.uniform(0.0, 6.0, count),
                rng.uniform(0.3, 2.0, count),
                strict=True,
            )
        ]
    )


def sides(uv: Any) -> Any:
    """(T, 3) the lengths of the sides."""
    return np.linalg.norm(uv - uv[:, [1, 2, 0]], axis=2)


def scale_of(uv: Any, layout: Any, size: tuple[int, int]) -> float:
    """Texels a unit, which are the same for all triangles; none is mirrored."""
    assert layout.min() >= 0.0 and layout.max() <= 1.0
    assert (uv_areas(layout) > 0.0).all()
    scale = sides(layout * size) / sides(uv)
    assert np.allclose(scale, scale[0, 0], rtol=1e-9)
    return float(scale[0, 0])


def used(layout: Any) -> float:
    return float(uv_areas(layout).sum())


def free_texels(layout: Any, piece: Any, size: tuple[int, int], enough: int) -> int:
    """Between charts, after the layout is rounded to float32."""
    texels = layout.astype(np.float32).astype(np.float64) * size
    return kept_padding(texels, piece, *size, enough)


SIZES = [(256, 256), (512, 128), (96, 700), (1, 1), (7, 300), (5000, 3), (16384, 16384), (1, 16384)]


@pytest.mark.parametrize("size", SIZES)
def test_charts_are_moved_turned_and_scaled_alike(size: tuple[int, int]) -> None:
    uv, piece = shards(20)
    layout, padding = packed(uv, piece, size, 2)
    scale_of(uv, layout, size)
    assert 0 <= padding <= 2
    assert (uv_areas(layout.astype(np.float32)) > 0.0).all()


@pytest.mark.parametrize("padding", [0, 1, 4, 7])
@pytest.mark.parametrize("size", [(300, 200), (128, 256)])
def test_texels_that_charts_touch_at_all_are_apart(size: tuple[int, int], padding: int) -> None:
    uv, piece = curls(10)
    layout, kept = packed(uv, piece, size, padding)
    assert free_texels(layout, piece, size, kept) == kept
    assert kept == padding or padding > 4
    assert scale_of(uv, layout, size) > 0.0


def test_charts_lie_in_the_holes_of_others() -> None:
    """A ring as large as the image, and what has room nowhere but inside of it."""
    uv, piece = together([arc(0.9, 1.0), arc(0.5, 0.8), boxes((0.6, 0.6))[0]])
    layout, padding = packed(uv, piece, (256, 256), 4)
    assert padding == 4
    assert scale_of(uv, layout, (256, 256)) > 127.0
    assert free_texels(layout, piece, (256, 256), 4) == 4


@pytest.mark.parametrize("size", [(1000, 100), (100, 1000)])
def test_a_long_chart_lies_along_the_longer_side(size: tuple[int, int]) -> None:
    layout, _ = packed(*boxes((10.0, 1.0)), size, 4)
    assert used(layout) > 0.99


def test_a_chart_far_longer_than_all_else_sets_the_scale_and_costs_no_padding() -> None:
    uv, piece = boxes((100.0, 1.0), *[(1.0, 1.0)] * 40)
    layout, padding = packed(uv, piece, (512, 512), 4)
    assert padding == 4
    assert scale_of(uv, layout, (512, 512)) == pytest.approx(5.12, rel=2e-4)


def test_equal_squares_fill_rows_to_the_texel() -> None:
    """16 squares and three gaps of 4 texels a side of 64: 13 texels each."""
    layout, padding = packed(*boxes(*[(1.0, 1.0)] * 16), (64, 64), 4)
    assert padding == 4
    assert np.sqrt(used(layout) / 16) * 64 == pytest.approx(13.0, abs=5e-3)


def test_slanting_charts_are_turned_upright() -> None:
    uv, piece = boxes((3.0, 1.0), (2.0, 2.0), (5.0, 0.5))
    slanting = np.concatenate([turned(uv[piece == each], angle) for each, angle in enumerate((0.3, -0.6, 1.0))])
    layout, _ = packed(slanting, piece, (256, 256), 2)
    edges = (layout - layout[:, [1, 2, 0]])[::2, :2]  # those of the boxes
    assert np.abs(edges).min(axis=-1).max() < 1e-9
    assert scale_of(slanting, layout, (256, 256)) == pytest.approx(
        scale_of(uv, packed(uv, piece, (256, 256), 2)[0], (256, 256))
    )


@pytest.mark.parametrize("align", [False, True])
def test_charts_that_lie_well_are_turned_by_quarters_alone(align: bool) -> None:
    uv, piece = curls(12) if not align else boxes(*[(1.0 + 0.1 * i, 0.3 + 0.2 * i) for i in range(12)])
    layout, _ = packed(uv, piece, (256, 256), 2, align=align)
    before, after = (each[:, 1] - each[:, 0] for each in (uv, layout))
    before, after = before[:, 0] + 1j * before[:, 1], after[:, 0] + 1j * after[:, 1]
    quarters = np.angle(after / before) / (np.pi / 2)
    assert np.abs(quarters - np.round(quarters)).max() < 1e-9


def test_a_chart_is_not_turned_for_nothing() -> None:
    uv, piece = boxes((3.0, 3.0), (1.0, 1.0))
    layout, _ = packed(uv, piece, (64, 64), 2)
    edge = (layout - layout[:, [1, 2, 0]])[::2, 0]
    assert (edge[:, 0] < 0.0).all() and np.abs(edge[:, 1]).max() < 1e-12  # from the lower left to the lower right


def test_half_the_image_is_used_at_the_cost_of_padding_but_not_less() -> None:
    """Few large charts keep it; the more there are, the less is left; a gap is given up only where it is what costs."""
    kept = [packed(*shards(count), (256, 256), 4) for count in (30, 200, 2000)]
    assert [padding for _, padding in kept] == sorted((padding for _, padding in kept), reverse=True)
    assert kept[0][1] == 4
    assert kept[2][1] < 2
    assert used(kept[2][0]) > 0.5


@pytest.mark.parametrize("size", [(32, 32), (2, 300), (1, 1)])
def test_more_charts_than_texels_keep_their_areas(size: tuple[int, int]) -> None:
    uv, piece = shards(1200)
    layout, padding = packed(uv, piece, size, 4)
    assert padding == 0
    scale_of(uv, layout, size)
    assert used(layout) > 0.5
    assert (uv_areas(layout.astype(np.float32)) > 0.0).mean() > 0.999  # some are needles


def test_the_layout_is_the_same_at_any_power_of_two_and_number_of_threads() -> None:
    for uv, piece in (curls(20), shards(1500)):
        layout, _ = packed(uv, piece, (200, 300), 2, threads=1)
        for scale, threads in ((2.0**-20, 2), (2.0**190, 3)):
            assert np.array_equal(packed(uv * scale, piece, (200, 300), 2, threads=threads)[0], layout)


def test_what_has_no_area_lies_in_the_image() -> None:
    """Points, lines, triangles twice, charts of nothing but those, and none at all."""
    point, line = np.zeros((1, 3, 2)), np.array([[(0.0, 0.0), (3.0, 1.0), (1.5, 0.5)]])
    square = boxes((1.0, 2.0))[0]
    for shapes in ([point], [line], [point, point, line], [square, np.concatenate([square, square]), line, point]):
        uv, piece = together(shapes)
        layout, padding = packed(uv, piece, (40, 30), 2)
        assert np.isfinite(layout).all() and layout.min() >= 0.0 and layout.max() <= 1.0
        assert padding == 2
        lengths = sides(layout * (40, 30))
        assert np.allclose(lengths * sides(uv).max(), sides(uv) * lengths.max(), atol=1e-9)
    assert packed(np.zeros((0, 3, 2)), np.zeros(0, np.int64), (40, 30), 2)[0].shape == (0, 3, 2)


def test_triangles_on_one_another_and_mirrored_ones_are_given_room() -> None:
    square = boxes((1.0, 1.0))[0]
    uv, piece = together([np.concatenate([square, square + 0.5, square[:, ::-1] + (0.0, 1.0)]), arc(0.5, 0.7), square])
    layout, padding = packed(uv, piece, (100, 100), 3)
    assert free_texels(layout, piece, (100, 100), 3) == padding == 3


def test_numbers_that_no_triangle_has_change_nothing() -> None:
    uv, piece = together([arc(0.5, 1.0), arc(0.5, 1.0)])
    layout, padding = packed(uv, piece, (64, 64), 4)
    assert padding == 4
    apart, kept = packed(uv, piece * 9_999, (64, 64), 4)
    assert kept == 4 and np.array_equal(apart, layout)


def test_a_call_tells_how_far_it_is_and_stops() -> None:
    control = Control()
    packed(*shards(50), (256, 256), 2, control=control)
    assert control.done == control.total > 0
    control.cancel = 1
    with pytest.raises(Cancelled):
        packed(*shards(50), (256, 256), 2, control=control)


def test_what_cannot_be_packed_is_refused() -> None:
    uv, piece = shards(3)
    for size in ((0, 10), (10, 100_000)):
        with pytest.raises(InputError):
            packed(uv, piece, size, 2)
    for bad in (np.nan, np.inf, 2.0**201):
        with pytest.raises(InputError):
            packed(uv * (bad if bad > 1.0 else 1.0) + (0.0 if bad > 1.0 else bad), piece, (10, 10), 2)
    with pytest.raises(InputError):
        packed(uv, piece - 1, (10, 10), 2)
    for padding in (-1, 65_537, 2**31 - 1):
        with pytest.raises(InputError):
            packed(uv, piece, (10, 10), padding)


def perimeter(uv: Any, piece: Any) -> float:
    """Of all charts: the sides that only one of a chart's triangles has."""
    ends = np.round(np.stack([uv, uv[:, [1, 2, 0]]], axis=2), 9).reshape(-1, 2, 2)
    ends = np.sort(ends[..., 0] + 1j * ends[..., 1], axis=1)
    keys = np.concatenate([np.repeat(piece, 3)[:, None], ends], axis=1)
    _, first, uses = np.unique(keys, axis=0, return_index=True, return_counts=True)
    return float(sides(uv).ravel()[first[uses == 1]].sum())


@pytest.mark.parametrize(("size", "padding"), [((512, 512), 4), ((200, 300), 1)])
def test_the_scale_is_foreseen(size: tuple[int, int], padding: int) -> None:
    for uv, piece in (curls(12), shards(60), boxes(*[(1.0 + i % 3, 2.0) for i in range(40)])):
        scale = scale_of(uv, packed(uv, piece, size, padding)[0], size)
        foreseen = expected_scale(uv_areas(uv).sum(), perimeter(uv, piece), int(piece.max()) + 1, size, padding)
        assert 0.8 < scale / foreseen < 1.25


@pytest.mark.parametrize("size", [(512, 256), (200, 600)])
@pytest.mark.parametrize("kind", PLAIN)
def test_oblong_images(kind: str, size: tuple[int, int]) -> None:
    mesh = PLAIN[kind]
    result = unwrap(kind, *mesh, size=size, padding=4)
    assert_sound(mesh, result, size, 4)
    assert result.padding == 4
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
    assert_sound(mesh, result, (size, size), 4)


def test_too_many_charts_cost_padding_not_faces() -> None:
    """400 loose triangles on 64 texels a side: the padding shrinks, nothing is lost."""
    mesh = loose_triangles(400, seed=3)
    result = unwrap("confetti", *mesh, size=64, padding=4)
    assert_sound(mesh, result, (64, 64), 4)
    assert result.count == 400
    assert result.padding < 4
