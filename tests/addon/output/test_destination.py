"""Where baked maps go, and baking them again as they were."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.addon.ui.request import KEPT, request_from_image  # noqa: E402
from occlusion_bake.core.base.errors import InputError  # noqa: E402
from occlusion_bake.core.finish.image_file import read_image  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402
from occlusion_bake.tests.oracles.blender import pixels, press, select  # noqa: E402


@pytest.fixture(autouse=True)
def scene(registered: None, empty_scene: None) -> Any:
    """A floor beside a wall, selected."""
    blender.wall()
    select(blender.plane("Floor"))
    chosen = bpy.context.scene.occlusion_bake
    chosen.width = chosen.height = 32
    chosen.quality, chosen.rays, chosen.margin, chosen.threads = "RAYS", 16, 2, 2
    return chosen


def values() -> Any:
    """What the panel's settings bake, by the image in the file."""
    assert press() == {"FINISHED"}
    image = bpy.data.images["Floor AO"]
    found = pixels(image)[..., 0]
    bpy.data.images.remove(image)
    return found


# Files


@pytest.mark.parametrize(
    ("kind", "depth", "ending", "step"),
    [
        ("PNG", "8", ".png", 255),
        ("PNG", "16", ".png", 65535),
        ("EXR", "32", ".exr", None),
        ("TIFF", "16", ".tif", 65535),
    ],
)
def test_saved_by_a_template(scene: Any, tmp_path: Path, kind: str, depth: str, ending: str, step: int | None) -> None:
    right = values()
    scene.output, scene.format, scene.depth, scene.use_dither = "SAVED", kind, depth, False
    scene.path = str(tmp_path / "new" / "{object}_{map}_{width}")
    assert press() == {"FINISHED"}
    file = tmp_path / "new" / f"Floor_ao_32{ending}"
    written, told = read_image(file)
    assert np.abs(written[..., 0] - right).max() <= (0.5001 / step if step else 0.0)
    assert told["object"] == "Floor" and told["rays_per_texel"] == 16
    image = bpy.data.images["Floor AO"]
    assert Path(bpy.path.abspath(image.filepath)) == file and image.packed_file is None
    assert image.colorspace_settings.name == "Non-Color"
    assert np.allclose(pixels(image)[..., 0], written[..., 0], atol=1e-4)


def test_beside_the_blend_file(scene: Any, tmp_path: Path) -> None:
    scene.output = "SAVED"
    with pytest.raises(RuntimeError, match="which is not saved"):
        press()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "house.blend"))
    bpy.context.scene.occlusion_bake.path = "//textures/{file}_{object}_{map}.png"
    assert press() == {"FINISHED"}
    assert (tmp_path / "textures" / "house_Floor_ao.png").is_file()
    bpy.context.scene.occlusion_bake.path = r" ///more\{object} "
    assert press() == {"FINISHED"}
    assert (tmp_path / "more" / "Floor.png").is_file()


def test_a_second_bake_goes_into_the_same_image_and_file(scene: Any, tmp_path: Path) -> None:
    scene.output, scene.path = "SAVED", str(tmp_path / "{object}_{map}")
    press()
    image = bpy.data.images["Floor AO"]
    scene.use_distance, scene.distance = True, 1e-3
    press()
    assert bpy.data.images["Floor AO"] == image and pixels(image)[..., 0].min() > 0.9


def test_from_the_file_to_a_folder_and_back_its_users_follow(scene: Any, tmp_path: Path) -> None:
    scene.use_material = True
    press()
    (material,) = bpy.data.materials
    (texture,) = (node for node in material.node_tree.nodes if node.type == "TEX_IMAGE")
    scene.path = str(tmp_path / "{object}_{map}")
    for output, packed in (("SAVED", False), ("PACKED", True), ("SAVED", False)):
        scene.output = output
        assert press() == {"FINISHED"}
        assert [image.name for image in bpy.data.images if KEPT in image] == ["Floor AO"]
        assert texture.image == bpy.data.images["Floor AO"]
        assert (texture.image.packed_file is not None) == packed


@pytest.mark.parametrize(
    ("path", "words"),
    [
        ("{thing}", "only {object}, {map}"),
        ("{object", "only {object}"),
        ("{0}", "only"),
        ("{}", "only"),
        ("{object[x]}", "only"),
        ("{object.upper}", "only"),
        ("{object!z}", "only"),
        ("{width:99999999999}", "only"),
        ("", "empty"),
        ("textures/", "it is a folder; end it in a file's name"),
        (r"textures\.png", "it is a folder"),
        ("..", "it is a folder"),
        ("/", "it is a folder"),
    ],
)
def test_a_template_that_cannot_be_filled(scene: Any, tmp_path: Path, path: str, words: str) -> None:
    scene.output, scene.path = "SAVED", path and f"{tmp_path}/{path}"
    with pytest.raises(RuntimeError, match=words):
        press()
    assert not list(tmp_path.iterdir())


def test_two_maps_never_share_a_file(scene: Any, tmp_path: Path) -> None:
    scene.output, scene.path, scene.use_ro = "SAVED", f"{tmp_path}/{{object}}", True
    with pytest.raises(RuntimeError, match=r"Floor ao and Floor ro_10 would be one file"):
        press()
    assert not list(tmp_path.iterdir()) and "Floor AO" not in bpy.data.images


def test_a_depth_that_a_format_has_not(scene: Any, tmp_path: Path) -> None:
    scene.output, scene.path, scene.format, scene.depth = "SAVED", f"{tmp_path}/x", "EXR", "8"
    with pytest.raises(RuntimeError, match="cannot hold 8 bits"):
        press()


@pytest.mark.parametrize(
    ("names", "stems"),
    [
        (("Wall/left", "Wall_left"), ("Wall_left_2", "Wall_left")),
        (("A:B", "A*B", "A?B"), ("A_B_2", "A_B", "A_B_3")),
        (("Tree.", " Tree"), ("Tree_2", "Tree")),
        (("Part.1001", "nul"), ("Part_1001", "_nul")),  # as no tile, and no device
    ],
)
def test_each_object_has_files_of_its_own(
    scene: Any, tmp_path: Path, names: tuple[str, ...], stems: tuple[str, ...]
) -> None:
    """Whether they are baked together or one by one."""
    scene.output, scene.path = "SAVED", f"{tmp_path}/{{map}}/{{object}}.PNG"
    objects = [blender.plane(name, location=(5 * i, 9, 0)) for i, name in enumerate(names)]
    for chosen in (objects, *[[obj] for obj in objects]):
        select(*chosen)
        assert press() == {"FINISHED"}
    assert {path.name for path in (tmp_path / "ao").iterdir()} == {f"{stem}.png" for stem in stems}
    for name, stem in zip(names, stems, strict=True):
        assert read_image(tmp_path / "ao" / f"{stem}.png")[1]["object"] == name
        assert Path(bpy.data.images[f"{name} AO"].filepath).stem == stem


def test_a_path_begins_at_home_or_beside_the_blend_file(
    scene: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Never in the folder that Blender happens to run in."""
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.setenv("USERPROFILE", str(tmp_path / "home"))
    monkeypatch.chdir(tmp_path)
    scene.output, scene.path = "SAVED", "textures/{object}"
    with pytest.raises(RuntimeError, match=r"Path textures/{object}: .* which is not saved; save that"):
        press()
    scene.path = "~nobody_at_all/{object}"
    with pytest.raises(RuntimeError, match="no such user"):
        press()
    scene.path = "~"
    with pytest.raises(RuntimeError, match="it is a folder"):
        press()
    assert not list(tmp_path.iterdir())
    scene.path = "~/textures/{object}"
    assert press() == {"FINISHED"}
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "{a}" / ".." / "house.blend"))
    bpy.data.objects["Floor"].name = "~"
    bpy.context.scene.occlusion_bake.path = "{object}/{map}"
    assert press() == {"FINISHED"}
    found = {path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*.png")}
    assert found == {"home/textures/Floor.png", "~/ao.png"}


# Channels


@pytest.mark.parametrize("is_float", [False, True])
@pytest.mark.parametrize("channel", "RGBA")
def test_one_channel_and_no_other(scene: Any, is_float: bool, channel: str) -> None:
    right = values()
    orm = bpy.data.images.new("ORM", 32, 32, alpha=True, float_buffer=is_float, is_data=True)
    random = np.random.default_rng(0).integers(0, 256, 4 * 32 * 32).astype(np.float32) / 255
    orm.pixels.foreach_set(random)
    before = pixels(orm).copy()
    scene.output, scene.image, scene.channel, scene.use_dither = "CHANNEL", orm, channel, False
    assert press() == {"FINISHED"}
    after, at = pixels(orm), "RGBA".index(channel)
    assert np.abs(after[..., at] - right).max() <= (0.0 if is_float else 0.5001 / 255)
    assert np.array_equal(np.delete(after, at, axis=2), np.delete(before, at, axis=2))
    assert orm.packed_file is not None  # or it would be lost with the file
    assert "Floor AO" not in bpy.data.images and KEPT not in orm


def test_dither_keeps_the_mean_of_what_is_between_two_steps(scene: Any) -> None:
    """A tilted floor under nothing but a wall: its values lie anywhere between steps of 1/255."""
    scene.width = scene.height = 128
    right = values()
    means = {}
    for dither in (False, True):
        orm = bpy.data.images.new("ORM", 128, 128, is_data=True)
        scene.output, scene.image, scene.use_dither = "CHANNEL", orm, dither
        press()
        there = pixels(orm)[..., 0]
        error = (there - right) * 255
        assert np.abs(error).max() < (1.0 if dither else 0.5001)
        means[dither] = error[right < 1.0].mean()
        assert np.all(there[right == 1.0] == 1.0)
    # A uniform move of half a step at most has a standard error of 0.5 / sqrt(n) steps at most.
    assert abs(means[True]) < 4 * 0.5 / np.sqrt(np.count_nonzero(right < 1.0))


def test_a_channel_that_cannot_be_filled(scene: Any) -> None:
    scene.output = "CHANNEL"
    with pytest.raises(RuntimeError, match="none is chosen"):
        press()
    scene.image = bpy.data.images.new("ORM", 64, 64)
    with pytest.raises(RuntimeError, match="ORM: it is 64x64 and the bake 32x32"):
        press()
    scene.image = bpy.data.images.new("Fits", 32, 32)
    scene.use_ro = True
    with pytest.raises(RuntimeError, match="takes one grey map of one object"):
        press()


# Again


def test_an_image_is_baked_again_as_it_was(scene: Any) -> None:
    scene.use_ground, scene.occluders, scene.seed = True, "SELF", 7
    press()
    image = bpy.data.images["Floor AO"]
    first = pixels(image).copy()
    scene.seed, scene.use_ground, scene.occluders, scene.rays, scene.width = 8, False, "SCENE", 2, 16
    job = request_from_image(bpy.context.view_layer, image).job
    assert (job.objects, job.settings.seed, job.settings.image.width) == (blender.refs("Floor"), 7, 32)
    assert job.occluding.alone and job.occluding.ground
    image.pixels.foreach_set(np.zeros(4 * 32 * 32, np.float32))
    with bpy.context.temp_override(edit_image=image):
        assert bpy.ops.occlusion_bake.again() == {"FINISHED"}
    assert np.array_equal(pixels(image), first)
    assert scene.seed == 8 and scene.width == 16  # the panel stays


def test_an_image_that_cannot_be_baked_again_says_why(scene: Any) -> None:
    press()
    image = bpy.data.images["Floor AO"]
    bpy.data.objects.remove(bpy.data.objects["Floor"])
    with pytest.raises(InputError, match="Floor AO: its object Floor is not in this view layer"):
        request_from_image(bpy.context.view_layer, image)
    image[KEPT] = '{"panel": {}, "roles": {"objects": ["Floor"], "targets": [0]}}'
    with pytest.raises(InputError, match="Floor AO: it was baked by another version"):
        request_from_image(bpy.context.view_layer, image)
    image[KEPT] = "{}"
    with pytest.raises(InputError, match="does not tell how it was baked"):
        request_from_image(bpy.context.view_layer, image)
