"""The same scene, the same bits: whatever the threads, the order of things, and what else is baked.

The scene has what could disturb that: a copied and an instanced mesh, smooth normals, a camera, several maps, and rays
of one chunk and of more than one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from occlusion_bake.core.bake import Baked, bake
from occlusion_bake.core.base.arrays import Floats
from occlusion_bake.core.rays import occluders
from occlusion_bake.core.rays.embree import open_device
from occlusion_bake.core.rays.map_spec import AO, MapSpec, reflection, sampled
from occlusion_bake.core.rays.occluders import Occluders
from occlusion_bake.core.rays.texel_surface import TexelSurface
from occlusion_bake.core.rays.tracer import TraceOptions, trace
from occlusion_bake.core.scene.scene import Camera, Instance, Scene
from occlusion_bake.core.scene.world_mesh import world_mesh
from occlusion_bake.core.texels.rasterize import rasterize
from occlusion_bake.tests.oracles import shapes
from occlusion_bake.tests.oracles.settings import flat_settings

LOBES = (AO, reflection(10), replace(reflection(40, from_camera=True), name="from camera"))
MAPS = (
    *LOBES,
    replace(sampled(AO, "uniform_hemisphere"), name="naive"),
    replace(sampled(LOBES[2], "uniform_sphere"), name="naive from camera"),
)
WIDTH, HEIGHT = 27, 19
CHUNKS = (64, 300, 700)  # rays: one chunk of 256, two, four
GRAZING = 2e-3  # share of values that rays along an edge may change
CAMERA = Camera((3.0, -4.0, 5.0), (0.0, 0.0, -1.0))


def at(x: float, y: float, z: float, size: float = 1.0) -> np.ndarray:
    """Turned askew, so that nothing lies along an axis."""
    turn = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = size * turn, (x, y, z)
    return matrix


@pytest.fixture
def scene(monkeypatch: pytest.MonkeyPatch) -> Scene:
    """Two balls of a shared mesh are targets, three more of it, a mirrored one and the floor are instanced."""
    monkeypatch.setattr(occluders, "MOST_COPIED", 0)
    shared, ground = (
        shapes.sphere(radius=0.5, segments=24, name="ball"),
        Instance("floor", shapes.plane(4.0, -0.5, "floor"), np.eye(4)),
    )
    places = [(0, 0, 0), (0.9, 0.3, 0.1), (-0.8, 0.7, -0.1), (0.1, 0.2, 0.8), (-0.3, -1.0, 0.2)]
    balls = [Instance(f"ball {i}", shared, at(*place)) for i, place in enumerate(places)]
    mirrored = Instance("mirrored", shared, at(0.4, -0.7, 0.6) * [-0.5, 0.7, 0.6, 1.0])
    return Scene([balls[0], balls[1], ground], [*balls, mirrored, ground], CAMERA)


def baked(scene: Scene, **settings: Any) -> list[Baked]:
    return list(bake(scene, flat_settings(**{"width": WIDTH, "height": HEIGHT, "rays": 64, "maps": MAPS, **settings})))


def assert_same_bits(a: Sequence[Baked], b: Sequence[Baked]) -> None:
    for one, other in zip(a, b, strict=True):
        for name, result in one.maps.items():
            twin = other.maps[name]
            assert_array_equal(result.values, twin.values)
            assert_array_equal(result.coverage, twin.coverage)
            assert (result.error, result.mean) == (twin.error, twin.mean)


@pytest.mark.usefixtures("unmeasured")
def test_the_scene_is_of_every_kind(scene: Scene) -> None:
    frame = Occluders(open_device(), scene.occluders).frame_for(scene.targets[0])
    assert len(frame.instanced) == 6 and len(frame.flat) == 1
    for result in baked(scene):
        covered = [result.maps[each.name].covered.mean() for each in LOBES]
        assert covered[0] == covered[1] > 0.9 and 0.2 < covered[2] <= covered[0]
        assert all(result.maps[each.name].values.std() > 0.05 for each in LOBES)


@pytest.mark.parametrize("rays", CHUNKS)
def test_neither_threads_nor_another_run_change_a_bit(rays: int, scene: Scene) -> None:
    """With many rays one target is enough."""
    several = Scene(scene.targets if rays == 64 else scene.targets[:1], scene.occluders, CAMERA)
    maps = MAPS if rays == 64 else LOBES
    one, *others = (baked(several, rays=rays, threads=threads, maps=maps) for threads in (1, 1, 2, 3, 5))
    for other in others:
        assert_same_bits(one, other)


@pytest.mark.usefixtures("unmeasured")
def test_another_seed_changes_them(scene: Scene) -> None:
    for first, second in zip(baked(scene), baked(scene, seed=1), strict=True):
        for name, result in first.maps.items():
            other = second.maps[name].values
            some_seen = (np.minimum(result.values, other) < 1.0) & (np.maximum(result.values, other) > 0.0)
            assert np.mean((result.values != other)[some_seen]) > 0.5


def sums(scene: Scene, owner: np.ndarray | None = None, maps: Sequence[MapSpec] = MAPS, **rays: Any) -> Floats:
    """The first target's, straight from the tracer."""
    target = scene.targets[0]
    frame = Occluders(open_device(), scene.occluders).frame_for(target)
    assert target.mesh.uv is not None
    whole = rasterize(target.name, target.mesh.uv, WIDTH, HEIGHT).owner
    camera = Camera(tuple(np.asarray(CAMERA.position) - frame.origin), CAMERA.forward)
    chosen = TraceOptions(**{"count": 300, "camera": camera, **rays})
    surface = TexelSurface(world_mesh(target, frame.origin), whole if owner is None else owner)
    return trace(frame.scene, surface, maps, chosen).all


@pytest.mark.parametrize("rays", CHUNKS)
def test_a_texel_is_the_same_baked_alone_or_with_others(rays: int, scene: Scene) -> None:
    """A tile, every seventh texel, and one row: whatever is left out, the rest keeps its bits."""
    uv = scene.targets[0].mesh.uv
    assert uv is not None
    owner = rasterize("ball", uv, WIDTH, HEIGHT).owner
    row, column = np.mgrid[:HEIGHT, :WIDTH]
    whole = sums(scene, maps=LOBES, count=rays)
    for mask in ((row < 8) & (column < 8), (column + 3 * row) % 7 == 0, row == 9):
        part = sums(scene, np.where(mask, owner, -1).astype(np.int32), LOBES, count=rays)
        assert_array_equal(part, np.where(mask, whole, 0))


@pytest.mark.parametrize("width", [8, 4, 1])
def test_packet_widths_agree(width: int, scene: Scene) -> None:
    """They cut the same rays by other arithmetic: a ray along an edge may go either way."""
    wide, narrow = (sums(scene, maps=LOBES, packet_width=each) for each in (16, width))
    assert_array_equal(wide < 0, narrow < 0)  # which texels face the camera does not hang on the width
    difference = (wide - narrow)[wide >= 0]
    assert np.mean(difference != 0) < GRAZING
    assert np.abs(difference).max() <= 2  # of 300 rays
    assert abs(difference.mean()) / 300 < 1e-6


@pytest.mark.usefixtures("unmeasured")
def test_the_order_of_maps_changes_nothing(scene: Scene) -> None:
    first = Scene(scene.targets[:1], scene.occluders, CAMERA)
    for there, back in zip(baked(first), baked(first, maps=MAPS[::-1]), strict=True):
        assert list(back.maps) == list(there.maps)[::-1]
        for name, result in there.maps.items():
            assert_array_equal(result.values, back.maps[name].values)


@pytest.mark.usefixtures("unmeasured")
def test_the_order_of_occluders_changes_nothing_but_grazing_rays(scene: Scene) -> None:
    """Another order is another tree; where a ray meets an edge, another triangle is asked first."""
    shuffled = [scene.occluders[i] for i in (4, 6, 0, 2, 5, 3, 1)]
    bakes, others = (baked(Scene(scene.targets, order, CAMERA), maps=LOBES) for order in (scene.occluders, shuffled))
    for there, back in zip(bakes, others, strict=True):
        for each in LOBES:
            difference = there.maps[each.name].values - back.maps[each.name].values
            assert np.mean(difference != 0) < GRAZING
            assert np.abs(difference).max() <= 2 / 64


@pytest.mark.usefixtures("unmeasured")
def test_copies_and_instances_agree(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    """An instance is traced in its own frame: rounding moves it by half an ulp, and rays that graze it may differ."""
    instanced = baked(scene, maps=LOBES)
    monkeypatch.setattr(occluders, "LEAST_COPIED", 1 << 40)
    monkeypatch.setattr(occluders, "MOST_COPIED", 1 << 40)
    for there, back in zip(instanced, baked(scene, maps=LOBES), strict=True):
        for each in LOBES:
            difference = there.maps[each.name].values - back.maps[each.name].values
            assert np.mean(difference != 0) < 5 * GRAZING
            assert np.abs(difference).max() <= 2 / 64
            assert abs(there.maps[each.name].mean - back.maps[each.name].mean) < 1e-5
