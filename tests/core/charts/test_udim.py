"""UDIM layouts: what is one, and that each tile holds what a bake of its part alone would."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from occlusion_bake.core.bake import Baker
from occlusion_bake.core.charts.udim import Udim, UvTiles, outside_tile, part_in_tile, tiles_of
from occlusion_bake.core.scene.scene import Mesh, Scene
from occlusion_bake.tests.oracles import shapes
from occlusion_bake.tests.oracles.settings import flat_settings

SETTINGS = flat_settings(width=32, height=32, rays=16, margin=2)


def room_in_tiles(*columns: int) -> Any:
    """The inside of a cube, its sides spread over tiles in turn."""
    room = shapes.room()
    uv = room.uv.copy()
    for side in range(6):
        column = columns[side % len(columns)]
        uv[2 * side : 2 * side + 2] += (column % 10, column // 10)
    return replace(room, uv=uv.astype(np.float32))


def tiles(mesh: Any, udim: Udim = Udim.AUTO) -> list[int]:
    return list(tiles_of(mesh, udim).numbers)


def moved(mesh: Any, *offset: float) -> Any:
    """UVs moved aside."""
    return replace(mesh, uv=mesh.uv + np.float32(offset))


def mirrored(mesh: Any) -> Any:
    """Mirrored in space, its UVs where they were, as by Blender's Mirror modifier."""
    turned = [0, 2, 1]
    across = mesh.vertices * np.float32([-1, 1, 1])
    return replace(mesh, vertices=across, triangles=mesh.triangles[:, turned].copy(), uv=mesh.uv[:, turned].copy())


def grid(cells: tuple[int, int], spread: tuple[float, float], bumps: float = 0.0) -> Any:
    """A terrain of so many cells whose UVs are spread evenly over so many tiles."""
    columns, rows = cells
    x, y = (
        each.ravel()
        for each in np.meshgrid(np.arange(columns + 1, dtype=np.int64), np.arange(rows + 1, dtype=np.int64))
    )
    low = (np.arange(rows, dtype=np.int64)[:, None] * (columns + 1) + np.arange(columns, dtype=np.int64)).ravel()
    quads = np.stack([low, low + 1, low + columns + 2, low + columns + 1], axis=1)
    triangles = quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3).astype(np.int32)
    vertices = np.stack([x, y, bumps * np.sin(x * 1.3) * np.cos(y * 0.7)], axis=1).astype(np.float32)
    uv = np.stack([x * (spread[0] / columns), y * (spread[1] / rows)], axis=1).astype(np.float32)
    return Mesh("terrain", vertices, triangles, uv[triangles])


def test_what_is_a_udim_layout() -> None:
    room = shapes.room()
    assert tiles_of(room) == UvTiles()  # one tile, the first, is no layout
    assert tiles(room_in_tiles(1)) == [1002]
    assert tiles(room_in_tiles(0, 3, 12)) == [1001, 1004, 1013]
    assert tiles(room_in_tiles(0, 999)) == [1001, 2000]
    assert tiles(replace(room, uv=None)) == []
    for outside in (-1, 1000):
        assert tiles(room_in_tiles(0, outside)) == []


def test_faces_without_a_place_in_the_texture_make_no_tile() -> None:
    quad = shapes.plane(1.0)
    for where, found in (((1.0, 1.0), []), ((1.5, 0.5), [])):
        flat = replace(quad, uv=np.full_like(quad.uv, where))
        assert tiles(shapes.joined([quad, flat])) == found
    beyond = moved(quad, 1, 0)
    assert tiles(shapes.joined([beyond, replace(quad, uv=np.zeros_like(quad.uv))])) == [1002]
    assert tiles(shapes.joined([beyond, replace(quad, uv=np.full_like(quad.uv, np.nan))])) == [1002]


def test_a_texture_that_repeats_is_none() -> None:
    room = shapes.room()
    for scale in (2.0, 7.3):
        found = tiles_of(replace(room, uv=room.uv * np.float32(scale)))
        assert found.numbers == () and "repeats; set UDIM to Layout" in found.warnings("Room")[0]
    assert tiles(moved(room, 0.5, 0.5)) == []


@pytest.mark.parametrize("bumps", [0.0, 0.3])
@pytest.mark.parametrize(
    ("cells", "spread", "last"),
    [((8, 8), (2, 2), 1012), ((16, 16), (2, 2), 1012), ((64, 64), (4, 4), 1034), ((12, 8), (1.5, 1), 1002)],
)
def test_a_grid_spread_evenly_is_a_layout(
    cells: tuple[int, int], spread: tuple[float, float], last: int, bumps: float
) -> None:
    """Though each triangle has others at its place in the other tiles, one in each."""
    found = tiles(grid(cells, spread, bumps))
    assert (found[0], found[-1], len(found)) == (1001, last, np.ceil(spread[0]) * np.ceil(spread[1]))


def test_copies_moved_aside_are_none() -> None:
    """Mirrored halves, and repeated parts upon one another in a tile: they show the first tile's texture."""
    ball, room = shapes.sphere(segments=16), shapes.room()
    for offset in ((1, 0), (0, 1), (3, 2)):
        found = tiles_of(shapes.joined([ball, moved(mirrored(ball), *offset)]))
        assert found.numbers == () and "copies" in found.warnings("Ball")[0]
        assert tiles(shapes.joined([ball, moved(ball, *offset), moved(ball, *offset)])) == []
    below = replace(room, uv=room.uv * np.float32(0.5))  # beside what is there once
    body = moved(below, 0.5, 0.5)
    assert tiles(shapes.joined([body, below, *[moved(below, 1, 0)] * 3])) == []
    assert tiles(shapes.joined([body, below, moved(mirrored(below), 1, 0)])) == []


def test_equal_parts_with_a_tile_for_each_are_a_layout() -> None:
    ball, quad, room = shapes.sphere(segments=16), shapes.plane(1.0), shapes.room()
    folded = replace(room, uv=np.tile(room.uv[:2], (6, 1, 1)))  # a crate whose sides share their place
    for part in (ball, quad, folded):
        assert tiles(shapes.joined([moved(part, i, 0) for i in range(3)])) == [1001, 1002, 1003]
    smaller = replace(ball, uv=ball.uv * np.float32(0.7) + np.float32([1, 0]))
    assert tiles(shapes.joined([ball, mirrored(smaller), smaller])) == [1001, 1002]  # upon nothing of the first


def test_one_says_which_it_is() -> None:
    ball, room = shapes.sphere(segments=16), shapes.room()
    copies, layout = shapes.joined([ball, moved(mirrored(ball), 1, 0)]), room_in_tiles(0, 3)
    assert tiles(copies, Udim.LAYOUT) == [1001, 1002] and not tiles_of(copies, Udim.LAYOUT).warnings("Ball")
    assert tiles(layout, Udim.STACKED) == [] and not tiles_of(layout, Udim.STACKED).warnings("Room")
    assert tiles(room, Udim.LAYOUT) == [1001]
    # Two triangles, over four tiles: their diagonal goes by the other two.
    assert tiles(replace(shapes.plane(1.0), uv=shapes.plane(1.0).uv * np.float32(2)), Udim.LAYOUT) == [
        *(1001, 1002),
        *(1011, 1012),
    ]
    corner = replace(shapes.plane(1.0), uv=np.float32([[(0, 0), (2, 0), (0, 2)], [(0, 0), (1, 0), (1, 1)]]))
    assert tiles(corner, Udim.LAYOUT) == [1001, 1002, 1011]  # the edge goes through the corner of 1012
    outside = tiles_of(moved(room, -0.5, 0.0), Udim.LAYOUT)
    assert outside.numbers == (1001,)
    assert "leave the UDIM tiles" in outside.warnings("Room")[0]


def test_a_few_triangles_over_a_border_leave_a_layout_what_it_is() -> None:
    """They are baked in both tiles; those in no tile are told of."""
    terrain = grid((16, 16), (2, 1))
    terrain.uv[100, 0] += np.float32([0.0, -0.03])
    terrain.uv[-1] -= np.float32([3.0, 0.0])
    found = tiles_of(terrain)
    assert found.numbers == (1001, 1002) and found.outside == 1
    alone = grid((16, 16), (1, 1))
    alone.uv[-1] += np.float32([0.04, 0.0])
    assert tiles_of(alone) == UvTiles()
    over = grid((256, 1), (2, 1))
    over.uv[over.uv[..., 0] == 1.0] += np.float32([0.001, 0.0])
    assert tiles(over) == [1001, 1002]
    in_both = ~outside_tile(over, 1001) & ~outside_tile(over, 1002)
    assert np.count_nonzero(in_both) == 2


def test_uvs_on_the_border_belong_to_their_triangle() -> None:
    quad = shapes.plane(1.0)
    assert tiles(moved(quad, 1.0, 1.0)) == [1012]
    assert tiles(moved(quad, 1.0 - 1e-6, 1.0 - 1e-6)) == [1012]


@pytest.mark.parametrize("smooth", [True, False])
def test_a_tile_holds_its_part_alone(smooth: bool) -> None:
    """Each tile of a ball in two is what the ball's UVs, moved there, give: to the bit, and nothing of the others."""
    ball = shapes.sphere(segments=16, smooth=smooth)
    right = ball.uv.mean(axis=1)[:, 0] > 0.5
    layout = ball.uv * np.float32([1.0, 1.0])
    layout[right] += np.float32([1.0, 0.0])
    target = shapes.instance(replace(ball, uv=layout))
    others = [shapes.instance(shapes.plane(4.0, -1.5, name="floor"))]
    assert tiles(target.mesh) == [1001, 1002]
    baker = Baker(Scene([target], [target, *others]), SETTINGS)
    plain = Baker(Scene([shapes.instance(ball)], [shapes.instance(ball), *others]), SETTINGS)
    whole = plain.bake(shapes.instance(ball)).maps["ao"]
    parts = [baker.bake(target, tile) for tile in (1001, 1002)]
    assert [part.tile for part in parts] == [1001, 1002]
    assert_array_equal(parts[0].maps["ao"].covered | parts[1].maps["ao"].covered, whole.covered)
    for part in parts:
        assert part.warnings == []
        ao = part.maps["ao"]
        only = ao.covered & ~parts[1 - parts.index(part)].maps["ao"].covered
        assert only.sum() > 0.45 * whole.covered.sum()
        assert np.abs(ao.values[only] - whole.values[only]).mean() < 1e-3  # moved UVs are rounded


def test_a_triangle_over_a_border_is_baked_on_both_sides() -> None:
    """A floor across two tiles, with the texels and the values of one image twice as wide."""
    floor = replace(shapes.plane(1.0), uv=shapes.plane(1.0).uv * np.float32([2.0, 1.0]))
    others = [shapes.instance(shapes.plane(4.0, 2.0, name="ceiling"))]
    baker = Baker(Scene([shapes.instance(floor)], [shapes.instance(floor), *others]), SETTINGS)
    for tile in tiles(floor, Udim.LAYOUT):
        baked = baker.bake(shapes.instance(floor), tile)
        assert baked.warnings == [] and baked.maps["ao"].covered.all()


def test_the_part_of_a_tile() -> None:
    target = shapes.instance(room_in_tiles(0, 21))
    part = part_in_tile(target, 1022).mesh
    assert len(part.triangles) == (~outside_tile(target.mesh, 1022)).sum() == 6
    assert part.uv is not None and part.uv.min() >= 0.0 and part.uv.max() <= 1.0
