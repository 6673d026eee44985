"""Which objects block light, how they are stored, and in whose frame: none of it may show in the picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from occlusion_bake.core.rays import occluders as module
from occlusion_bake.core.rays import pieces
from occlusion_bake.core.rays.embree import open_device
from occlusion_bake.core.rays.map_spec import AO
from occlusion_bake.core.rays.occluders import Occluders
from occlusion_bake.core.rays.ray_options import RayOptions
from occlusion_bake.core.rays.texel_surface import TexelSurface
from occlusion_bake.core.rays.tracer import TraceOptions, trace
from occlusion_bake.core.scene.scene import Instance, Scene
from occlusion_bake.core.scene.world_mesh import centre_of, world_mesh
from occlusion_bake.core.texels.rasterize import rasterize
from occlusion_bake.tests.oracles import shapes

RAYS = 64
MANY = 1e12  # rays for which all is worth building anew


def sums_of(
    target: Instance, occluders: Occluders, distance: float | None = None, *, expected: float = MANY
) -> np.ndarray:
    """AO of the target, in rays."""
    frame = occluders.frame_for(target, rays=expected)
    owner = rasterize(target.name, target.mesh.uv, 64, 64).owner
    surface = TexelSurface(world_mesh(target, frame.origin), owner)
    options = TraceOptions(RAYS, occlusion=RayOptions(distance))
    sums: np.ndarray = trace(frame.scene, surface, [AO], options).all[0]
    return sums


def made(instances: Sequence[Instance], distance: float | None = None) -> Occluders:
    return Occluders(open_device(), instances, RayOptions(distance))


@pytest.fixture
def crowd() -> list[Instance]:
    """A floor, and one mesh over it many times: moved, turned, stretched, mirrored; its own middle off its origin."""
    ball = shapes.sphere((3.0, -1.0, 0.5), 0.25, 24)
    rng = np.random.default_rng(3)
    places = []
    for i in range(12):
        matrix = shapes.matrix((0, 0, 0), rng.uniform(0.5, 2.0, 3) * [1, 1, -1 if i % 3 == 0 else 1], i % 2 == 0)
        middle = np.append(rng.uniform(-1.2, 1.2, 2), 0.8)
        matrix[:3, 3] = middle - matrix[:3, :3] @ (3.0, -1.0, 0.5)
        places.append(shapes.instance(ball, matrix, f"ball {i}"))
    return [shapes.instance(shapes.plane(2.0), name="floor"), *places]


@pytest.fixture
def instanced(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is flat but what must be."""
    monkeypatch.setattr(module, "LEAST_COPIED", 0)


@pytest.mark.usefixtures("instanced")
def test_instances_and_copies_give_the_same_picture(crowd: list[Instance]) -> None:
    occluders = made(crowd)
    copied = sums_of(crowd[0], occluders)
    assert occluders.frame_for(crowd[0], rays=MANY).instanced == frozenset()
    instanced = sums_of(crowd[0], occluders, expected=0)
    assert occluders.frame_for(crowd[0]).instanced == frozenset(range(1, 13))
    assert 0.3 < copied.mean() / RAYS < 0.9
    assert np.mean(copied != instanced) < 0.01  # rays that graze an edge
    assert np.abs(copied - instanced).max() <= 2


@pytest.mark.usefixtures("instanced")
def test_a_mesh_is_stored_once(crowd: list[Instance], monkeypatch: pytest.MonkeyPatch) -> None:
    built: list[object] = []
    geometry = pieces.Geometry
    monkeypatch.setattr(pieces, "Geometry", lambda *given: built.append(geometry(*given)) or built[-1])
    occluders = made(crowd)
    for target in (crowd[0], crowd[3], crowd[5]):
        occluders.frame_for(target)
    assert len(built) == 2  # the ball, and the floor


@pytest.mark.usefixtures("instanced")
def test_a_target_is_never_traced_as_an_instance_of_itself(crowd: list[Instance]) -> None:
    copied = sums_of(crowd[4], made(crowd))
    occluders = made(crowd)
    occluders.frame_for(crowd[0])
    frame = occluders.frame_for(crowd[4])
    assert 4 in frame.flat and 4 not in frame.instanced
    assert frame.instanced | frame.flat == frozenset(range(13))
    assert_allclose(frame.origin, centre_of(crowd[4]))
    difference = copied - sums_of(crowd[4], occluders, expected=0)
    assert np.mean(difference != 0) < 0.01 and np.abs(difference).max() <= 2


@pytest.mark.usefixtures("instanced")
def test_a_mesh_in_pieces_gives_the_same_picture(crowd: list[Instance], monkeypatch: pytest.MonkeyPatch) -> None:
    whole = sums_of(crowd[0], made(crowd))
    monkeypatch.setattr(pieces, "LARGEST", 100)
    difference = whole - sums_of(crowd[0], made(crowd), expected=0)
    assert np.mean(difference != 0) < 0.01 and np.abs(difference).max() <= 2


@pytest.mark.parametrize("triangles", [8192, 8193, 70_000])
def test_pieces_hold_each_triangle_once_and_are_compact(triangles: int) -> None:
    ball = shapes.sphere(segments=400)
    order = np.random.default_rng(1).permutation(len(ball.triangles))[:triangles]
    mesh = replace(ball, triangles=ball.triangles[order])
    cut = pieces.pieces_of(mesh, None)
    corners = np.concatenate([each.mesh.vertices[each.mesh.triangles] for each in cut])
    held, given = (np.unique(each.reshape(-1, 9), axis=0) for each in (corners, mesh.vertices[mesh.triangles]))
    assert_array_equal(held, given)
    assert len(corners) == triangles and max(len(each.mesh.triangles) for each in cut) <= pieces.LARGEST
    if triangles == 70_000:
        assert max(float(np.linalg.norm(each.half)) for each in cut) < 1.0  # the ball's is 1.7


def test_what_is_out_of_reach_is_left_out_and_changes_no_bit() -> None:
    floor = shapes.instance(shapes.plane(1.0), name="floor")
    near = shapes.instance(shapes.plane(1.0, 0.5), name="near")
    reach = 1.0
    touching, beyond = (shapes.instance(shapes.plane(1.0, z), name=f"at {z}") for z in (reach, reach * 1.01))
    aside = shapes.instance(shapes.sphere((2.5, 0, 0), 0.45), name="aside")
    diagonal = shapes.instance(shapes.sphere((1.9, 1.9, 0), 0.1), name="diagonal")  # each axis alone is within reach
    every = [floor, near, touching, beyond, aside, diagonal]
    occluders = made(every, reach)
    assert occluders.frame_for(floor, rays=MANY).flat == {0, 1, 2}
    assert_array_equal(sums_of(floor, occluders, reach), sums_of(floor, made(every[:2], reach), reach))
    assert made(every).frame_for(floor, rays=MANY).flat == set(range(6))


def test_the_reach_is_in_world_units() -> None:
    scaled = shapes.matrix((1e5, 0, 0), 1e3)
    floor, over = (shapes.instance(shapes.plane(1.0, z), scaled, f"at {z}") for z in (0.0, 0.5))
    assert made([floor, over], 499.0).frame_for(floor).flat == {0}
    assert made([floor, over], 501.0).frame_for(floor).flat == {0, 1}


@pytest.mark.usefixtures("instanced")
def test_what_is_near_and_large_stands_flat() -> None:
    """Rounding would move it against the surface; what is small, or far for its size, is as exact instanced."""
    bolt = shapes.instance(shapes.sphere(segments=16), shapes.matrix((1.01, 0, 0), 1e-3), "bolt")
    beside = shapes.instance(shapes.sphere(segments=16), shapes.matrix((1.02, 0, 0), 1e-3), "beside")
    hull = shapes.instance(shapes.sphere(segments=16), name="hull")
    far = shapes.instance(shapes.sphere(segments=16), shapes.matrix((1e3, 0, 0), 10.0), "far")
    level = shapes.instance(shapes.sphere(segments=16), shapes.matrix((1e5, 0, 0), (1.0, 1.0, 1e-12)), "level")
    occluders = made([bolt, beside, hull, far, level])
    frame = occluders.frame_for(bolt)
    assert frame.flat == {0, 2, 4} and frame.instanced == {1, 3}  # Embree could not invert the last one's matrix
    assert_allclose(frame.origin, (1.01, 0, 0), atol=1e-6)


def test_a_frame_does_not_depend_on_those_before(crowd: list[Instance]) -> None:
    alone = made(crowd)
    among = made(crowd)
    for target in crowd:
        among.frame_for(target)
    for target in crowd[:3]:
        one, other = (each.frame_for(target) for each in (alone, among))
        assert_array_equal(one.origin, other.origin)
        assert one.flat == other.flat and one.instanced == other.instanced
        assert_array_equal(sums_of(target, alone, expected=0), sums_of(target, among, expected=0))


def test_the_frame_of_a_target_is_kept_for_its_next_image(crowd: list[Instance]) -> None:
    occluders = made(crowd)
    assert occluders.frame_for(crowd[0]) is occluders.frame_for(crowd[0])
    assert occluders.frame_for(crowd[0]) is not occluders.frame_for(crowd[1])


def test_broken_triangles_are_reported_and_left_out() -> None:
    floor = shapes.instance(shapes.plane(2.0), name="floor")
    ball = shapes.sphere((0, 0, 0.7), 0.5, 24)
    vertices = ball.vertices.copy()
    vertices[100], vertices[130, 1] = np.nan, np.inf
    broken = replace(ball, vertices=vertices)
    touched = np.isin(ball.triangles, (100, 130)).any(axis=1)
    assert touched.any()
    rest = replace(ball, triangles=ball.triangles[~touched])
    occluders = made([floor, shapes.instance(broken, name="Rock.003")])
    assert occluders.warnings == ["Rock.003: triangles with non-finite vertices do not occlude"]
    without = made([floor, shapes.instance(rest)])
    assert without.warnings == []
    assert_array_equal(sums_of(floor, occluders), sums_of(floor, without))


@pytest.mark.usefixtures("instanced")
def test_a_broken_mesh_is_still_shared(crowd: list[Instance]) -> None:
    vertices = crowd[1].mesh.vertices.copy()
    vertices[40] = np.nan
    broken = replace(crowd[1].mesh, vertices=vertices)
    occluders = made([crowd[0], *(replace(each, mesh=broken) for each in crowd[1:])])
    assert len(occluders.warnings) == 12
    assert occluders.frame_for(crowd[0]).instanced == frozenset(range(1, 13))


def test_a_transform_that_is_not_finite_is_reported() -> None:
    floor = shapes.instance(shapes.plane(1.0), name="floor")
    lost = shapes.instance(shapes.plane(1.0), shapes.matrix((np.nan, 0, 0)), "Rock.003")
    occluders = made([floor, lost])
    assert occluders.warnings == ["Rock.003: its transform is not finite; it does not occlude"]
    assert occluders.frame_for(floor).flat == {0}


def test_a_target_need_not_be_an_occluder() -> None:
    room = shapes.instance(shapes.room())
    assert np.all(sums_of(room, made([]))[rasterize("room", room.mesh.uv, 64, 64).covered] == RAYS)
    assert np.all(sums_of(room, made([room])) == 0)


def test_an_occluder_without_faces_does_no_harm() -> None:
    floor = shapes.instance(shapes.plane(1.0), name="floor")
    loose = replace(floor.mesh, triangles=np.zeros((0, 3), np.int32))
    none = replace(loose, vertices=np.zeros((0, 3), np.float32))
    scene = Scene([floor], [floor, shapes.instance(loose, name="points"), shapes.instance(none, name="nothing")])
    assert np.all(sums_of(floor, made(scene.occluders)) == RAYS)
