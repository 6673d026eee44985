"""A scene that was written is the scene that is read: all of it, or what a target needs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from occlusion_bake.core.bake import Baker, Goal, Settings
from occlusion_bake.core.base.errors import InputError
from occlusion_bake.core.batch.scene_file import StoredScene, write_scene
from occlusion_bake.core.maps.occlusion import OcclusionMap
from occlusion_bake.core.rays.map_spec import AO, light
from occlusion_bake.core.rays.ray_options import RayOptions
from occlusion_bake.core.scene.cutout import Alpha, Cutout
from occlusion_bake.core.scene.image_texture import ImageTexture, Wrap
from occlusion_bake.core.scene.normal_map import NormalMap, NormalMapLayer
from occlusion_bake.core.scene.scene import Camera, HighPoly, Scene
from occlusion_bake.core.settings import ImageSettings
from occlusion_bake.core.spherical.environment import Environment
from occlusion_bake.tests.oracles import shapes

SETTINGS = Settings((OcclusionMap(AO),), ImageSettings(16, 16), Goal(4), normal_maps=True)


def stage() -> Scene:
    """With one of everything."""
    ball = shapes.with_tangents(shapes.sphere((0, 0, 0.5), 0.4, 12), (0.6, 0.8, 0.0))
    count = len(ball.triangles)
    bumps = ImageTexture(np.random.default_rng(1).random((4, 4, 3), np.float32), wrap=Wrap.MIRROR)
    normals = NormalMap([NormalMapLayer(bumps, ball.tangents, 0.5)], np.zeros(count, np.int32), ball.uv)  # type: ignore[arg-type]
    target = replace(shapes.instance(ball, shapes.matrix((1.0, 2.0, 3.0), 1.5, True)), normal_map=normals)
    alpha = Alpha(np.random.default_rng(2).random((3, 5), np.float32), False, Wrap.CLIP)
    quad = shapes.plane(1.0, 1.2, "leaf")
    leaf = replace(shapes.instance(quad), cutout=Cutout([alpha], np.zeros(2, np.int32), quad.uv))  # type: ignore[arg-type]
    floor = shapes.instance(shapes.plane(3.0, name="floor"))
    far = shapes.instance(shapes.block(name="far"), shapes.matrix((30.0, 0.0, 0.0)))
    camera = Camera((1.0, 2.0, 3.0), (0.0, 0.6, -0.8), True)
    highs = {"floor": HighPoly([floor, leaf], far, 0.25)}
    sky = Environment(np.random.default_rng(3).random((4, 4, 3), np.float32))
    return Scene([target, floor], [target, floor, far, leaf], camera, {"leaf"}, highs, sky)


@pytest.fixture
def stored(tmp_path: Path) -> StoredScene:
    write_scene(tmp_path / "scene", stage())
    return StoredScene(tmp_path / "scene")


def test_all_of_it_comes_back(stored: StoredScene) -> None:
    """Everything that a hash knows of is the same, and so are names and what is shared."""
    given, read = stage(), stored.with_targets([0, 1], np.inf)
    for settings in (SETTINGS, replace(SETTINGS, maps=(OcclusionMap(light()),))):
        before, after = Baker(given, settings), Baker(read, settings)
        for ours, theirs in zip(given.targets, read.targets, strict=True):
            assert before.inputs_of(ours) == after.inputs_of(theirs)
    assert [each.name for each in read.occluders] == [each.name for each in given.occluders]
    assert [each.belongs_to for each in read.targets] == [each.belongs_to for each in given.targets]
    assert read.targets[0] is read.occluders[0] and read.highs["floor"].meshes[0] is read.targets[1]
    assert (read.camera, set(read.private)) == (given.camera, set(given.private))


def test_what_is_out_of_reach_is_not_read(stored: StoredScene) -> None:
    read = stored.with_targets([0], 5.0)
    assert [each.name for each in read.targets] == ["sphere"]
    assert [each.name for each in read.occluders] == ["sphere", "floor", "leaf"]
    assert not read.highs
    settings = replace(SETTINGS, rays=RayOptions(distance=5.0))
    given = stage()
    whole, part = Baker(given, settings), Baker(read, settings)
    assert whole.inputs_of(given.targets[0]) == part.inputs_of(read.targets[0])
    one, other = (b.bake(s.targets[0]).maps["ao"].values for b, s in ((whole, given), (part, read)))
    assert np.array_equal(one, other)


def test_a_scene_of_one_object(tmp_path: Path) -> None:
    alone = shapes.scene(shapes.plane())
    write_scene(tmp_path / "scene", replace(alone, occluders=[]))
    read = StoredScene(tmp_path / "scene").with_targets([0], 1.0)
    assert len(read.targets) == 1 and not read.occluders and read.environment is None


@pytest.mark.parametrize("name", ["scene.json", "float32.npy", "int32.npy"])
@pytest.mark.parametrize("harm", ["gone", "empty", "short"])
def test_what_is_broken_is_told(tmp_path: Path, name: str, harm: str) -> None:
    folder = tmp_path / "scene"
    write_scene(folder, stage())
    file = folder / name
    data = file.read_bytes()
    file.unlink()
    if harm != "gone":
        file.write_bytes(data[: len(data) // 2 if harm == "short" else 0])
    with pytest.raises(InputError, match="scene"):
        StoredScene(folder).with_targets([0, 1], np.inf)


def test_writing_again_takes_the_place_of_what_was_there(tmp_path: Path) -> None:
    write_scene(tmp_path, stage())
    write_scene(tmp_path, shapes.scene(shapes.plane()))
    assert [each.name for each in StoredScene(tmp_path).with_targets([0], np.inf).targets] == ["plane"]
