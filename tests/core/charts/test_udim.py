"""UDIM layouts: what is one, and that each tile holds what a bake of its part alone would."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from occlusion_bake.core.bake import Baker
from occlusion_bake.core.charts.udim import outside_tile, part_in_tile, tiles_of
from occlusion_bake.core.scene.scene import Scene
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


def test_what_is_a_udim_layout() -> None:
    room = shapes.room()
    assert tiles_of(room) == []  # one tile, the first, is no layout
    assert tiles_of(room_in_tiles(1)) == [1002]
    assert tiles_of(room_in_tiles(0, 3, 12)) == [1001, 1004, 1013]
    assert tiles_of(room_in_tiles(0, 999)) == [1001, 2000]
    assert tiles_of(replace(room, uv=None)) == []
    for outside in (-1, 1000):
        assert tiles_of(room_in_tiles(0, outside)) == []


def test_faces_without_a_place_in_the_texture_make_no_tile() -> None:
    quad = shapes.plane(1.0)
    for where, tiles in (((1.0, 1.0), []), ((1.5, 0.5), [])):
        flat = replace(quad, uv=np.full_like(quad.uv, where))
        assert tiles_of(shapes.joined([quad, flat])) == tiles
    beyond = replace(quad, uv=quad.uv + np.float32([1, 0]))
    assert tiles_of(shapes.joined([beyond, replace(quad, uv=np.zeros_like(quad.uv))])) == [1002]


def test_a_texture_that_repeats_is_none() -> None:
    room = shapes.room()
    for scale in (2.0, 7.3):
        assert tiles_of(replace(room, uv=room.uv * np.float32(scale))) == []
    assert tiles_of(replace(room, uv=room.uv + np.float32(0.5))) == []
    broken = room.uv.copy()
    broken[0, 0, 0] = np.nan
    assert tiles_of(replace(room, uv=broken)) == []


def test_copies_moved_aside_are_none() -> None:
    """Mirrored halves and repeated parts, a whole tile away: they show the first tile's texture."""
    ball, quad = shapes.sphere(segments=16), shapes.plane(1.0)
    for offset in ((1, 0), (0, 1), (3, 2)):
        moved = replace(ball, uv=ball.uv + np.float32(offset))
        assert tiles_of(shapes.joined([ball, moved])) == []
    other = replace(ball, uv=ball.uv * np.float32(0.7) + np.float32([1, 0]))
    assert tiles_of(shapes.joined([ball, other])) == [1001, 1002]
    full = [replace(quad, uv=quad.uv + np.float32([i, 0])) for i in range(3)]  # a wall of three squares
    assert tiles_of(shapes.joined(full)) == [1001, 1002, 1003]


def test_uvs_on_the_border_belong_to_their_triangle() -> None:
    quad = shapes.plane(1.0)
    assert tiles_of(replace(quad, uv=quad.uv + np.float32(1.0))) == [1012]
    assert tiles_of(replace(quad, uv=quad.uv + np.float32(1.0 - 1e-6))) == [1012]


@pytest.mark.parametrize("smooth", [True, False])
def test_a_tile_holds_its_part_alone(smooth: bool) -> None:
    """Each tile of a ball in two is what the ball's UVs, moved there, give: to the bit, and nothing of the others."""
    ball = shapes.sphere(segments=16, smooth=smooth)
    right = ball.uv.mean(axis=1)[:, 0] > 0.5
    layout = ball.uv * np.float32([1.0, 1.0])
    layout[right] += np.float32([1.0, 0.0])
    target = shapes.instance(replace(ball, uv=layout))
    others = [shapes.instance(shapes.plane(4.0, -1.5, name="floor"))]
    assert tiles_of(target.mesh) == [1001, 1002]
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


def test_the_part_of_a_tile() -> None:
    target = shapes.instance(room_in_tiles(0, 21))
    part = part_in_tile(target, 1022).mesh
    assert len(part.triangles) == (~outside_tile(target.mesh, 1022)).sum() == 6
    assert part.uv is not None and part.uv.min() >= 0.0 and part.uv.max() <= 1.0
