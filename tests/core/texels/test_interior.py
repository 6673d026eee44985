"""The share of texels inside other meshes, where it is known by area; and what must not pass for inside."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from occlusion_bake.core.bake import Settings, bake
from occlusion_bake.core.base.errors import Cancelled, InputError
from occlusion_bake.core.base.kernel_api import Control
from occlusion_bake.core.finish.report import object_entry, write_report
from occlusion_bake.core.rays import occluders
from occlusion_bake.core.rays.embree import open_device
from occlusion_bake.core.rays.texel_surface import TexelSurface
from occlusion_bake.core.rays.trace_scene import TraceScene
from occlusion_bake.core.scene.scene import Instance, Mesh, Scene
from occlusion_bake.core.scene.world_mesh import WorldMesh, world_mesh
from occlusion_bake.core.texels import interior
from occlusion_bake.core.texels.interior import SAMPLED, interior_share
from occlusion_bake.tests.oracles import shapes
from occlusion_bake.tests.oracles.bakes import bake_among
from occlusion_bake.tests.oracles.settings import flat_settings

pytestmark = pytest.mark.usefixtures("unmeasured")
SETTINGS = flat_settings(width=48, height=32, rays=1, margin=0)
ORIGIN = np.zeros(3)


def share(target: Instance, *others: Instance, settings: Settings = SETTINGS) -> float:
    return bake_among(settings, target, *others).surface.interior


@pytest.mark.parametrize("instanced", [False, True])
@pytest.mark.parametrize("mirror", [1.0, -1.0])
@pytest.mark.parametrize(("offset", "scale"), [(0.0, 1.0), (1e5, 1e-3), (1e3, 1e3)])
def test_nested_balls(
    offset: float, scale: float, mirror: float, instanced: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The inner is wholly inside, the outer not at all: copied or instanced, mirrored or not, near or far."""
    if instanced:
        monkeypatch.setattr(occluders, "MOST_COPIED", 0)
    matrix = shapes.matrix((offset, -offset, offset), (scale, mirror * scale, 1.5 * scale), turned=True)
    ball, apart = shapes.sphere(segments=32), matrix.copy()
    apart[:3, 3] += 9 * scale
    inner = shapes.instance(shapes.sphere(radius=0.5, segments=32), matrix, "inner")
    outer, other = (shapes.instance(ball, each, name) for name, each in (("outer", matrix), ("other", apart)))
    assert share(inner, outer, other) == 1.0
    assert share(outer, inner, other) == 0.0


@pytest.mark.parametrize("depth", [0.25, 0.5, 0.75])
def test_a_box_sunk_into_another(depth: float) -> None:
    """Its bottom and so much of its four sides lie inside; each side is a sixth of the texels."""
    upper = shapes.instance(shapes.block(0.5), shapes.matrix((0.1, 0.2, 1.5 - depth)), "upper")
    lower = shapes.instance(shapes.block(), name="lower")
    assert share(upper, lower) == pytest.approx((1 + 4 * depth) / 6, abs=0.02)  # rows of texels, and a sample of them
    assert share(lower, upper) == pytest.approx(0.25 / 6, abs=0.01)  # where the upper stands, a quarter of a side


def test_what_touches_is_not_inside() -> None:
    lower = shapes.instance(shapes.block(), name="lower")
    upper = shapes.instance(shapes.block(0.5), shapes.matrix((0.1, 0.2, 1.5)), "upper")
    twin = shapes.instance(lower.mesh, name="twin")
    decal = shapes.instance(shapes.plane(0.5, 1.0), name="decal")
    assert share(upper, lower) == share(lower, upper) == share(lower, twin) == share(decal, lower) == 0.0


@pytest.mark.parametrize("half", [20.0, 2000.0])
def test_what_stands_on_a_large_turned_slab_is_not_inside(half: float) -> None:
    """The slab's own rounding is larger than what rays start off the box by."""
    turned = shapes.matrix((3.0, -2.0, 1.0), turned=True)
    slab = shapes.instance(shapes.block(), turned @ shapes.matrix((0, 0, -1), (half, half, 1.0)), "slab")
    box = shapes.instance(shapes.block(0.5), turned @ shapes.matrix((0.1, 0.2, 0.5)), "box")
    sunk = shapes.instance(shapes.block(0.5), turned @ shapes.matrix((0.1, 0.2, 0.4)), "sunk")
    assert share(box, slab) == 0.0
    assert share(sunk, slab) == pytest.approx((1.0 + 4 * 0.1) / 6.0, abs=0.02)


def test_sheets_hold_nothing() -> None:
    """A leaf or a roof shows its back to one half of the directions at most."""
    thing = shapes.instance(shapes.block(0.5), name="thing")
    roof, ground = (shapes.instance(shapes.plane(1e3, z), name=f"at {z}") for z in (0.6, -0.6))
    assert share(thing, roof) == share(thing, ground) == share(thing, roof, ground) == share(ground, roof) == 0.0


def test_a_ground_below_and_things_within_take_nothing_away() -> None:
    """Rays that get into a third mesh, or end below a ground, got out of the first one before, or do after."""
    ground = shapes.instance(shapes.plane(1e3, -3.0), name="ground")
    outer, middle, inner = (
        shapes.instance(shapes.sphere(radius=r, segments=32), name=f"of {r}") for r in (1.0, 0.8, 0.7)
    )
    assert share(middle, outer, inner, ground) == 1.0
    assert share(outer, middle, inner, ground) == 0.0


def test_sheets_at_random_hold_next_to_nothing() -> None:
    """A thicket that hides every direction: half of its leaves turn their backs."""
    rng = np.random.default_rng(4)
    leaf = shapes.plane(0.35)
    leaves = []
    for i in range(600):
        axis = rng.normal(size=3)
        frame = np.linalg.qr(np.stack([axis, *rng.normal(size=(2, 3))], axis=1))[0]
        matrix = np.eye(4)
        matrix[:3, :3] = frame[:, [1, 2, 0]]
        matrix[:3, 3] = rng.uniform(1.0, 2.0) * axis / np.linalg.norm(axis)
        leaves.append(shapes.instance(leaf, matrix, f"leaf {i}"))
    baked = bake_among(SETTINGS, shapes.instance(shapes.sphere(radius=0.5, segments=16), name="trunk"), *leaves)
    assert baked.maps["ao"].mean < 0.1
    assert baked.surface.interior < 0.01


def test_an_objects_own_faces_do_not_count() -> None:
    """Turned inside out it sees its own backs alone; within another, it is looked through."""
    ball = shapes.sphere(radius=0.5, segments=32)
    inside_out = Mesh("inside out", ball.vertices, ball.triangles[:, ::-1].copy(), ball.uv[:, ::-1].copy())
    target = shapes.instance(inside_out)
    far = shapes.instance(shapes.block(), shapes.matrix((5, 0, 0)), "far")
    assert share(target) == share(target, far) == 0.0
    assert share(target, shapes.instance(shapes.block(), name="around")) == 1.0


def test_a_room_that_faces_inwards_holds_nothing() -> None:
    ball = shapes.instance(shapes.sphere(radius=0.5, segments=16))
    assert share(ball, shapes.instance(shapes.room())) == 0.0
    assert share(ball, shapes.instance(shapes.block())) == 1.0


def test_the_distance_does_not_matter() -> None:
    ball = shapes.instance(shapes.sphere(radius=0.01, segments=16))
    settings = flat_settings(width=48, height=32, rays=1, distance=0.1)
    baked = bake_among(settings, ball, shapes.instance(shapes.block()))
    assert baked.surface.interior == 1.0 and baked.maps["ao"].mean > 0.99


def test_a_frame_that_serves_several_knows_each_ones_own_faces() -> None:
    outer, inner = (shapes.instance(shapes.sphere(radius=r, segments=32), name=f"of {r}") for r in (1.0, 0.7))
    shares = {baked.name: baked.surface.interior for baked in bake(Scene([outer, inner], [outer, inner]), SETTINGS)}
    assert shares == {"of 1.0": 0.0, "of 0.7": 1.0}
    ghost = shapes.instance(shapes.sphere(radius=0.8, segments=32), name="ghost")
    (baked,) = bake(Scene([ghost], [outer, inner]), SETTINGS)  # it does not occlude
    assert baked.surface.interior == 1.0


def test_values_are_as_they_were_and_a_line_tells(tmp_path: Path) -> None:
    lower = shapes.instance(shapes.block(), name="lower")
    upper = shapes.instance(shapes.block(0.5), shapes.matrix((0.1, 0.2, 1.0)), "Rock.003")
    baked = bake_among(SETTINGS, upper, lower)
    assert baked.maps["ao"].values.min() == 0.0
    (line,) = baked.warnings
    assert line.startswith("Rock.003: about 50 % of the texels lie inside another mesh") and "\n" not in line
    assert object_entry(baked, {})["inside"] == baked.surface.interior
    write_report(tmp_path / "report.json", object_entry(baked, {}))
    assert json.loads((tmp_path / "report.json").read_text())["inside"] == baked.surface.interior
    assert interior.warning("a", 0.0) == interior.warning("a", 0.019) == []


def stage() -> tuple[TraceScene, WorldMesh]:
    inner, outer = (world_mesh(shapes.instance(shapes.block(half)), ORIGIN) for half in (0.5, 1.0))
    scene = TraceScene(open_device())
    assert [scene.add(each.vertices, each.triangles) for each in (inner, outer)] == [0, 1]
    assert scene.add(inner.vertices, inner.triangles[:0]) == -1
    scene.commit()
    return scene, inner


def test_without_texels_there_is_no_share() -> None:
    scene, inner = stage()
    assert interior_share(scene, TexelSurface(inner, np.full((8, 8), -1, np.int32)), 0) == 0.0


def test_threads_and_size_change_nothing() -> None:
    """However many texels there are, SAMPLED of them tell, spread over rows and columns, and always the same."""
    scene, inner = stage()
    for size in (1, 40, 512):
        owner = np.full((size, size), 3, np.int32)
        assert {interior_share(scene, TexelSurface(inner, owner, threads=threads), 0) for threads in (1, 2, 3)} == {1.0}
    spread = interior.spread(np.arange(512 * 512, dtype=np.int64))
    assert len(spread) == SAMPLED and np.all(np.diff(spread) > 0)
    for place in (spread % 512, spread // 512):
        assert np.bincount(place // 64, minlength=8).min() > 0.9 * SAMPLED / 8
    assert_array_equal(interior.spread(np.arange(SAMPLED, dtype=np.int64)), np.arange(SAMPLED, dtype=np.int64))


def test_it_can_be_cancelled_and_refuses_what_is_not_built() -> None:
    scene, inner = stage()
    owner = np.zeros((8, 8), np.int32)
    with pytest.raises(Cancelled):
        interior_share(scene, TexelSurface(inner, owner), 0, control=Control(cancel=1))
    control = Control()
    interior_share(scene, TexelSurface(inner, owner), 0, control=control)
    assert control.done == control.total == 64
    with pytest.raises(InputError, match="built"):
        interior_share(TraceScene(open_device()), TexelSurface(inner, owner), 0)
