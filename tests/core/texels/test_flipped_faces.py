"""The share of texels whose faces look into their own mesh, where it is known; and what must not pass for it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from occlusion_bake.core.bake import bake
from occlusion_bake.core.rays import occluders
from occlusion_bake.core.rays.map_spec import reflection
from occlusion_bake.core.scene.scene import Camera, Mesh, Scene
from occlusion_bake.tests.oracles import shapes
from occlusion_bake.tests.oracles.bakes import bake_among
from occlusion_bake.tests.oracles.settings import flat_settings

pytestmark = pytest.mark.usefixtures("unmeasured")
SETTINGS = flat_settings(width=48, height=32, rays=4, margin=0)


def turn(mesh: Mesh, rows: Any) -> Mesh:
    """These triangles the other way round."""
    assert mesh.uv is not None
    triangles, uv = mesh.triangles.copy(), mesh.uv.copy()
    triangles[rows], uv[rows] = triangles[rows][:, ::-1], uv[rows][:, ::-1]
    return replace(mesh, triangles=triangles, uv=uv, normals=None)


def side_by_side(*parts: Mesh) -> Mesh:
    """One mesh, in whose texture the parts stand side by side."""
    wide, moves = np.float32([1 / len(parts), 1.0]), np.float32([[i / len(parts), 0.0] for i in range(len(parts))])
    return shapes.joined([replace(part, uv=part.uv * wide + move) for part, move in zip(parts, moves, strict=True)])


@pytest.mark.parametrize("mirror", [1.0, -1.0])
@pytest.mark.parametrize(("offset", "scale"), [(0.0, 1.0), (1e5, 1e-2), (1e3, 1e3)])
def test_faces_turned_round(offset: float, scale: float, mirror: float) -> None:
    """One side of a box, then two that look at one another: a sixth of the texels each, and a line that says so."""
    matrix = shapes.matrix((offset, -offset, offset), (scale, mirror * scale, scale), turned=True)
    for sides in (0, 1, 2):
        baked = bake_among(SETTINGS, shapes.instance(turn(shapes.block(), slice(0, 2 * sides)), matrix))
        assert baked.surface.flipped == pytest.approx(sides / 6.0, abs=0.01)
        told = [line for line in baked.warnings if "the backs of its own faces alone" in line]
        assert len(told) == (sides > 0), baked.warnings


def test_what_is_sound_has_none() -> None:
    """Closed, open, seen from within, before a wall, among others; and what does not occlude itself."""
    ball, plane = shapes.sphere(segments=32), shapes.plane(1.0)
    room, open_room = shapes.room(), shapes.room(("-x", "+x", "-y", "+y", "-z"))
    bowl = turn(ball, slice(None))
    bowl = replace(bowl, triangles=bowl.triangles[200:], uv=bowl.uv[200:])  # type: ignore[index]
    for mesh in (ball, plane, room, open_room, bowl, shapes.block()):
        floor = shapes.instance(shapes.plane(9.0, -2.0, name="floor"))
        assert bake_among(SETTINGS, shapes.instance(mesh), floor).surface.flipped == 0.0
    target = shapes.instance(turn(shapes.block(), slice(0, 2)))
    (ghost,) = bake(Scene([target], [shapes.instance(plane)]), SETTINGS)
    assert ghost.surface.flipped == 0.0


def test_a_part_buried_in_another_of_the_same_mesh() -> None:
    baked = bake_among(SETTINGS, shapes.instance(side_by_side(shapes.block(0.5), shapes.block())))
    assert baked.surface.buried == pytest.approx(0.5, abs=0.01) and baked.surface.flipped == 0.0
    assert any("lie inside other parts of the mesh itself" in line for line in baked.warnings)
    assert not any("turned inwards" in line for line in baked.warnings)


def test_parts_that_touch() -> None:
    """A row of three: of each inner side, which its neighbour's covers, nobody sees anything, and none is turned."""
    row = side_by_side(*(shapes.moved(shapes.block(), (2 * i, 0, 0)) for i in range(3)))
    baked = bake_among(SETTINGS, shapes.instance(row))
    assert baked.surface.buried == pytest.approx(4 / 18, abs=0.02) and baked.surface.flipped == 0.0


def test_a_stray_part_far_away_turns_nothing() -> None:
    """Where a face could not be looked from as closely as another may lie before it, it is not judged."""
    small, large = shapes.block(0.05), shapes.moved(shapes.block(0.5), (0, 0, 0.6))
    stray = shapes.moved(shapes.plane(0.1), (1e5, 0, 0))
    baked = bake_among(SETTINGS, shapes.instance(side_by_side(small, large, stray)))
    assert baked.surface.flipped == baked.surface.buried == 0.0


def test_instances_around_it_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(occluders, "MOST_COPIED", 0)
    target = shapes.instance(turn(shapes.block(), slice(0, 2)))
    ball = shapes.sphere(segments=8)
    others = [shapes.instance(ball, shapes.matrix((4 * i, 0, 0)), f"ball {i}") for i in (1, 2, 3)]
    assert bake_among(SETTINGS, target, *others).surface.flipped == pytest.approx(1 / 6, abs=0.01)


WALLS = shapes.joined([shapes.block(1.1), shapes.room()], "Box")  # thick ones; both sides at one place in the texture
OUTSIDE_AWAY = replace(WALLS, uv=WALLS.uv + np.repeat(np.float32([2.0, 0.0]), 12)[:, None, None])  # type: ignore[operator]
MISSHADED = replace(
    shapes.block(name="Box"), normals=-shapes.face_normals(shapes.block())[:, None].repeat(3, 1).astype(np.float32)
)


@pytest.mark.parametrize(
    ("mesh", "around", "cause"),
    [
        (shapes.room(name="Box"), None, "its normals are turned inwards"),
        (WALLS, None, "its UVs overlap, and the texels show the inside of a closed shell"),
        (OUTSIDE_AWAY, None, "its texels are on the inside of a closed shell"),
        (shapes.block(0.5, "Box"), shapes.room(), "other objects shut it in"),
        (MISSHADED, None, "its custom normals point into its faces"),
    ],
)
def test_a_map_without_light_is_told_with_its_cause(mesh: Mesh, around: Mesh | None, cause: str) -> None:
    """Inside out and closed there is nothing to tell it from a room by but that all is black."""
    others = [] if around is None else [shapes.instance(around)]
    baked = bake_among(SETTINGS, shapes.instance(mesh), *others)
    assert baked.maps["ao"].mean == 0.0
    (line,) = (line for line in baked.warnings if "no light reaches it" in line)
    assert line.startswith(f"Box: no light reaches it: {cause}")
    assert [each for each in baked.warnings if "turned" in each] == [line] * ("turned" in cause)


def test_a_room_that_is_open_is_not_dark() -> None:
    assert not bake_among(SETTINGS, shapes.instance(shapes.room(("-x", "+x", "-z")))).warnings


def test_what_faces_away_from_the_camera_is_not_dark() -> None:
    settings = flat_settings((reflection(10.0, from_camera=True),), width=16, height=16, rays=4, margin=0)
    plane = shapes.instance(shapes.plane(1.0))
    (baked,) = bake(Scene([plane], [plane], Camera((0.0, 0.0, -5.0), (0.0, 0.0, 1.0))), settings)
    assert baked.warnings == [] and not baked.maps["ro_10"].covered.any()
