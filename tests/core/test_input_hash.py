"""What has the same hash has the same texture; what a texture depends on changes it, and nothing else does."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from occlusion_bake.core.bake import Baker, Goal, Settings
from occlusion_bake.core.base.digest import digest
from occlusion_bake.core.base.version import ALGORITHM
from occlusion_bake.core.maps.bent_normals import BentNormalMap, Space
from occlusion_bake.core.maps.occlusion import OcclusionMap
from occlusion_bake.core.rays.map_spec import AO, reflection
from occlusion_bake.core.rays.ray_options import RayOptions
from occlusion_bake.core.scene.cutout import Alpha, Cutout
from occlusion_bake.core.scene.image_texture import Wrap
from occlusion_bake.core.scene.scene import Camera, HighPoly, Instance, Scene
from occlusion_bake.core.settings import ImageSettings
from occlusion_bake.core.spherical.environment import Environment
from occlusion_bake.tests.oracles import shapes

NEAR = Settings(
    (OcclusionMap(AO), OcclusionMap(reflection(10))),
    image=ImageSettings(16, 16),
    goal=Goal(4),
    rays=RayOptions(distance=2.0),
)
# Of the bits of `_golden`, by the algorithm's number. Where a change to the code changes the bits, ALGORITHM grows by
# one, so that what was baked before is baked again, and its hash is added here.
GOLDEN = {1: "b39af7956caaa252"}


def stage() -> Scene:
    """A floor between a wall that it can see and a box out of reach."""
    wall = shapes.quad((1, -1, 0), (0, 2, 0), (0, 0, 1.5), name="wall")
    scene = shapes.scene(shapes.plane(), wall, camera=Camera((0, -5, 4), (0, 0.8, -0.6)))
    far = shapes.instance(shapes.block(name="far"), shapes.matrix((40.0, 0.0, 0.0)))
    return replace(scene, occluders=[*scene.occluders[:1], far, *scene.occluders[1:]])


def hash_of(scene: Scene, settings: Settings = NEAR, tile: int | None = None) -> str:
    return Baker(scene, settings).inputs_of(scene.targets[0], tile)


def with_target(scene: Scene, **changes: Any) -> Scene:
    """Its mesh changed, where it stands and where it occludes."""
    mesh = replace(scene.targets[0].mesh, **changes)
    target = replace(scene.targets[0], mesh=mesh)
    return replace(scene, targets=[target], occluders=[target if o.name == target.name else o for o in scene.occluders])


def with_occluder(scene: Scene, which: str, /, **changes: Any) -> Scene:
    return replace(scene, occluders=[replace(o, **changes) if o.name == which else o for o in scene.occluders])


def a_cutout(share: float) -> Cutout:
    return Cutout(
        [Alpha(np.full((1, 1), share, np.float32), wrap=Wrap.EXTEND)],
        np.zeros(2, np.int32),
        np.zeros((2, 3, 2), np.float32),
    )


MOVED = shapes.matrix((0.0, 0.0, 0.25))
SKY = Environment(np.ones((2, 2, 3), np.float32))
Change = Callable[[Scene], Scene]
COUNT: dict[str, Change] = {
    "a vertex": lambda scene: with_target(scene, vertices=scene.targets[0].mesh.vertices * np.float32(1.0001)),
    "UVs": lambda scene: with_target(scene, uv=scene.targets[0].mesh.uv * np.float32(0.5)),  # type: ignore[operator]
    "normals": lambda scene: with_target(scene, normals=np.tile(np.float32([0, 0, 1]), (2, 3, 1))),
    "the wall's place": lambda scene: with_occluder(scene, "wall", matrix=MOVED),
    "the wall's cutout": lambda scene: with_occluder(scene, "wall", cutout=a_cutout(0.5)),
    "how clear it is": lambda scene: with_occluder(scene, "wall", cutout=a_cutout(0.25)),
    "no wall": lambda scene: replace(scene, occluders=[o for o in scene.occluders if o.name != "wall"]),
    "not in its own way": lambda scene: replace(scene, occluders=scene.occluders[1:]),
    "what came near": lambda scene: with_occluder(scene, "far", matrix=shapes.matrix((3.5, 0.0, 0.0))),
    "order": lambda scene: replace(scene, occluders=scene.occluders[::-1]),
    "high meshes": lambda scene: replace(scene, highs={"plane": HighPoly([scene.occluders[2]])}),
    "extrusion": lambda scene: replace(scene, highs={"plane": HighPoly([scene.occluders[2]], extrusion=0.5)}),
}
DO_NOT_COUNT: dict[str, Change] = {
    "copies of all arrays": lambda scene: with_target(
        scene, vertices=scene.targets[0].mesh.vertices.copy(), triangles=scene.targets[0].mesh.triangles.copy()
    ),
    "what is far": lambda scene: with_occluder(scene, "far", matrix=shapes.matrix((50.0, 0.0, 0.0))),
    "no longer there, far off": lambda scene: replace(scene, occluders=[o for o in scene.occluders if o.name != "far"]),
    "another's name": lambda scene: with_occluder(scene, "wall", name="Wall.001"),
    "light that no map asks for": lambda scene: replace(scene, environment=SKY),
    "the camera": lambda scene: replace(scene, camera=Camera((1, 1, 1), (0, 0, -1))),
    "another target": lambda scene: replace(scene, targets=[*scene.targets, scene.occluders[2]]),
}


@pytest.mark.parametrize("what", COUNT)
def test_what_counts(what: str) -> None:
    scene = stage()
    assert hash_of(COUNT[what](scene)) != hash_of(scene)


def test_no_two_changes_are_taken_for_one_another() -> None:
    assert len({hash_of(change(stage())) for change in COUNT.values()}) == len(COUNT)


@pytest.mark.parametrize("what", DO_NOT_COUNT)
def test_what_does_not_count(what: str) -> None:
    scene = stage()
    changed = DO_NOT_COUNT[what](scene)
    assert hash_of(changed) == hash_of(scene)
    before, after = (next(iter(_values(each))) for each in (scene, changed))
    assert np.array_equal(before, after)  # and so the texture is the same


def _values(scene: Scene) -> list[Any]:
    return [each.values for each in Baker(scene, NEAR).bake(scene.targets[0]).maps.values()]


@pytest.mark.parametrize(
    "changed",
    [
        replace(NEAR, seed=1),
        replace(NEAR, maps=NEAR.maps[:1]),
        replace(NEAR, maps=(OcclusionMap(AO), OcclusionMap(reflection(11)))),
        replace(NEAR, maps=(BentNormalMap(),)),
        replace(NEAR, maps=(BentNormalMap(Space.WORLD),)),
        replace(NEAR, image=ImageSettings(16, 32)),
        replace(NEAR, image=ImageSettings(16, 16, margin=3)),
        replace(NEAR, goal=Goal(8)),
        replace(NEAR, goal=Goal(4, filtered=True)),
        replace(NEAR, rays=RayOptions(distance=2.0, front_only=True)),
        replace(NEAR, rays=RayOptions(distance=2.5)),
    ],
)
def test_settings_count(changed: Settings) -> None:
    assert hash_of(stage(), changed) != hash_of(stage())


def test_threads_do_not_and_tiles_do() -> None:
    assert hash_of(stage(), replace(NEAR, threads=1)) == hash_of(stage())
    assert len({hash_of(stage(), tile=tile) for tile in (None, 1001, 1002)}) == 3


def test_the_camera_counts_where_a_map_asks_for_it() -> None:
    settings = replace(NEAR, maps=(OcclusionMap(reflection(10, from_camera=True)),))
    scene = stage()
    moved = replace(scene, camera=Camera((1, 1, 1), (0, 0, -1)))
    assert hash_of(moved, settings) != hash_of(scene, settings)


def test_private_occluders_count_for_their_own_target() -> None:
    scene = stage()
    other = shapes.instance(shapes.plane(name="other"), MOVED)
    scene = replace(scene, targets=[*scene.targets, other], occluders=[*scene.occluders, other])
    private = replace(scene, private={"other"})
    assert hash_of(private) != hash_of(scene)
    baker = Baker(private, NEAR)
    moved = replace(other, matrix=shapes.matrix((0.0, 0.0, 0.5)))
    without = replace(private, targets=[scene.targets[0], moved], occluders=[*scene.occluders[:-1], moved])
    assert hash_of(without) == baker.inputs_of(scene.targets[0])


def test_a_result_bears_the_hash() -> None:
    scene = stage()
    assert Baker(scene, NEAR).bake(scene.targets[0]).inputs == hash_of(scene)


def test_digests_tell_values_apart() -> None:
    values: list[Any] = [
        *(None, True, 1, 1.0, "1", b"1", "", [], [[]], ["ab"], ["a", "b"], {"a": 1}, Space.WORLD, Wrap.CLIP),
        *(np.zeros(3, np.float32), np.zeros(3, np.int32), np.zeros((3, 1), np.float32), np.zeros(0, np.float32)),
        *(Goal(4), Goal(8), ImageSettings()),
    ]
    assert len({digest(value) for value in values}) == len(values)
    assert digest({"b", "a"}) == digest({"a", "b"}) and digest("a", "b") != digest("ab")
    with pytest.raises(TypeError, match="no digest"):
        digest(object())


def test_the_algorithm_has_another_number_where_its_bits_are_others() -> None:
    assert _golden() == GOLDEN[ALGORITHM]


def _golden() -> str:
    """Of AO to an error and of RO, plain, of shapes that are made without a sine."""
    box = shapes.instance(shapes.block(0.5, name="box"), shapes.matrix((0.3, -0.2, 0.5)))
    floor: Instance = shapes.instance(shapes.plane(2.0))
    scene, hasher = Scene([floor, box], [floor, box]), hashlib.sha256()
    image = ImageSettings(48, 48)
    for settings in (
        Settings(image=image, goal=Goal(error=0.01)),
        Settings((OcclusionMap(reflection(10)),), image, Goal(16)),
    ):
        for target in scene.targets:
            for made in Baker(scene, settings).bake(target).maps.values():
                hasher.update(made.values.tobytes())
    return hasher.hexdigest()[:16]
