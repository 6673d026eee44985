"""Which objects block light, how they are stored, and in whose frame: none of it may show in the picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from occlusion_bake.core.rays import occluders as module
from occlusion_bake.core.rays.embree import open_device
from occlusion_bake.core.rays.map_spec import AO
from occlusion_bake.core.rays.occluders import FRAME_RADII, Occluders
from occlusion_bake.core.rays.ray_options import RayOptions
from occlusion_bake.core.rays.texel_surface import TexelSurface
from occlusion_bake.core.rays.tracer import TraceOptions, trace
from occlusion_bake.core.scene.scene import Instance, Scene
from occlusion_bake.core.scene.world_mesh import centre_of, world_mesh
from occlusion_bake.core.texels.rasterize import rasterize
from occlusion_bake.tests.oracles import shapes

RAYS = 64


def sums_of(target: Instance, occluders: Occluders, distance: float | None = None) -> np.ndarray:
    """AO of the target, in rays."""
    frame = occluders.frame_for(target)
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


def test_instances_and_copies_give_the_same_picture(crowd: list[Instance], monkeypatch: pytest.MonkeyPatch) -> None:
    copies = made(crowd)
    copied = sums_of(crowd[0], copies)
    assert copies.frame_for(crowd[0]).instanced == frozenset()
    monkeypatch.setattr(module, "COPIED_TRIANGLES", 0)
    instances = made(crowd)
    instanced = sums_of(crowd[0], instances)
    assert instances.frame_for(crowd[0]).instanced == frozenset(range(1, 13))
    assert 0.3 < copied.mean() / RAYS < 0.9
    assert np.mean(copied != instanced) < 0.01  # rays that graze an edge
    assert np.abs(copied - instanced).max() <= 2


def test_an_instanced_mesh_is_stored_once(crowd: list[Instance], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "COPIED_TRIANGLES", 0)
    built: list[object] = []
    geometry = module.Geometry
    monkeypatch.setattr(module, "Geometry", lambda *given: built.append(geometry(*given)) or built[-1])
    occluders = made(crowd)
    for target in (crowd[0], crowd[3], crowd[5]):
        occluders.frame_for(target)
    assert len(built) == 1


def test_a_target_is_never_traced_as_an_instance_of_itself(
    crowd: list[Instance], monkeypatch: pytest.MonkeyPatch
) -> None:
    copied = sums_of(crowd[4], made(crowd))
    monkeypatch.setattr(module, "COPIED_TRIANGLES", 0)
    occluders = made(crowd)
    occluders.frame_for(crowd[0])
    frame = occluders.frame_for(crowd[4])
    assert 4 in frame.flat and 4 not in frame.instanced
    assert frame.instanced == frozenset(range(1, 13)) - {4}
    assert_allclose(frame.origin, centre_of(crowd[4]))
    difference = copied - sums_of(crowd[4], occluders)
    assert np.mean(difference != 0) < 0.01 and np.abs(difference).max() <= 2


def test_what_is_out_of_reach_is_left_out_and_changes_no_bit() -> None:
    floor = shapes.instance(shapes.plane(1.0), name="floor")
    near = shapes.instance(shapes.plane(1.0, 0.5), name="near")
    reach = 1.0
    touching, beyond = (shapes.instance(shapes.plane(1.0, z), name=f"at {z}") for z in (reach, reach * 1.01))
    aside = shapes.instance(shapes.sphere((2.5, 0, 0), 0.45), name="aside")
    diagonal = shapes.instance(shapes.sphere((1.9, 1.9, 0), 0.1), name="diagonal")  # each axis alone is within reach
    every = [floor, near, touching, beyond, aside, diagonal]
    occluders = made(every, reach)
    assert occluders.frame_for(floor).flat == {0, 1, 2}
    assert_array_equal(sums_of(floor, occluders, reach), sums_of(floor, made(every[:2], reach), reach))
    assert made(every).frame_for(floor).flat == set(range(6))


def test_the_reach_is_in_world_units() -> None:
    scaled = shapes.matrix((1e5, 0, 0), 1e3)
    floor, over = (shapes.instance(shapes.plane(1.0, z), scaled, f"at {z}") for z in (0.0, 0.5))
    assert made([floor, over], 499.0).frame_for(floor).flat == {0}
    assert made([floor, over], 501.0).frame_for(floor).flat == {0, 1}


def test_near_objects_share_a_frame() -> None:
    row = [shapes.instance(shapes.sphere(segments=16), shapes.matrix((x, 0, 0)), f"at {x}") for x in (0, 2.5, 5)]
    occluders = made(row)
    frames = [occluders.frame_for(target) for target in row]
    assert frames[0] is frames[1] is frames[2]
    assert_allclose(frames[0].origin, 0, atol=1e-6)


def test_a_tiny_object_far_away_gets_a_frame_of_its_own() -> None:
    large = shapes.instance(shapes.sphere(segments=16), name="large")
    tiny = shapes.instance(shapes.sphere(segments=16), shapes.matrix((2, 0, 0), 1e-3), "tiny")
    occluders = made([large, tiny])
    first = occluders.frame_for(large)
    second = occluders.frame_for(tiny)
    assert first is not second
    assert_allclose(second.origin, (2, 0, 0), atol=1e-6)
    assert occluders.frame_for(tiny) is second


def test_the_frame_is_left_where_the_object_is_too_far_for_its_size() -> None:
    radius = np.sqrt(3.0)  # of the box about the sphere
    for distance, shared in ((0.99 * FRAME_RADII * radius, True), (1.01 * FRAME_RADII * radius, False)):
        pair = [shapes.instance(shapes.sphere(), shapes.matrix((x, 0, 0)), f"at {x}") for x in (0.0, distance)]
        occluders = made(pair)
        first, second = (occluders.frame_for(target) for target in pair)
        assert (first is second) is shared


def test_a_frame_that_lacks_an_occluder_is_not_reused() -> None:
    row = [shapes.instance(shapes.sphere(segments=16), shapes.matrix((x, 0, 0)), f"at {x}") for x in (0, 3, 6)]
    occluders = made(row, distance=1.5)
    assert occluders.frame_for(row[0]).flat == {0, 1}
    assert occluders.frame_for(row[1]).flat == {0, 1, 2}


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


def test_a_broken_mesh_is_still_shared(crowd: list[Instance], monkeypatch: pytest.MonkeyPatch) -> None:
    vertices = crowd[1].mesh.vertices.copy()
    vertices[40] = np.nan
    broken = replace(crowd[1].mesh, vertices=vertices)
    monkeypatch.setattr(module, "COPIED_TRIANGLES", 0)
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
