"""One channel of an image that is there: in its file the numbers are the map's, whatever Blender makes of them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.addon.output.image_channel import (  # noqa: E402
    check_image_channel,
    lines_on_channel,
    store_channel,
)
from occlusion_bake.core.base.errors import InputError  # noqa: E402
from occlusion_bake.core.finish.image_file import read_image, write_image  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402
from occlusion_bake.tests.oracles.blender import bake_onto, pixels, set_panel  # noqa: E402

pytestmark = pytest.mark.usefixtures("empty_scene")

SIZE = (12, 8)
THERE = np.random.default_rng(1).random((8, 12, 4), dtype=np.float32)  # alpha, too, which Blender multiplies floats by
MAP = np.random.default_rng(2).random((8, 12), dtype=np.float32)
FILES = [("a.png", 8, 255), ("a.png", 16, 65535), ("a.tif", 16, 65535), ("a.exr", 16, 2048), ("a.exr", 32, 0)]


def loaded(path: Path, *, depth: int = 16, packed: bool = False, values: Any = THERE) -> Any:
    """An image of a new file."""
    write_image(path, values, depth=depth)
    image = bpy.data.images.load(str(path))
    if packed:
        image.pack()
    return image


def in_file(image: Any, folder: Path) -> Any:
    """What a file holds, or a packed one."""
    path = Path(image.filepath)
    if image.packed_file is not None:
        path = folder / f"packed{path.suffix}"
        path.write_bytes(image.packed_file.data)
    return read_image(path)[0]


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize(("name", "depth", "steps"), FILES)
def test_the_file_holds_the_map_and_what_else_it_held(
    name: str, depth: int, steps: int, packed: bool, tmp_path: Path
) -> None:
    for space in ("sRGB", "Non-Color", "ACEScg"):
        for mode in ("STRAIGHT", "PREMUL", "CHANNEL_PACKED", "NONE"):
            for channel in "GA":
                image = loaded(tmp_path / name, depth=depth, packed=packed)
                image.alpha_mode, image.colorspace_settings.name = mode, space
                before, at = in_file(image, tmp_path), "RGBA".index(channel)
                store_channel(image, channel, MAP, dither=False)
                after = in_file(image, tmp_path)
                assert np.abs(after[..., at] - MAP).max() <= (0.5001 / steps if steps else 0.0), (space, mode, channel)
                assert np.array_equal(np.delete(after, at, axis=2), np.delete(before, at, axis=2))
                assert not image.is_dirty and (image.packed_file is not None) == packed
                bpy.data.images.remove(image)


def test_blender_shows_what_the_file_holds(tmp_path: Path) -> None:
    """Values in alpha are no opacity: no colour may be multiplied by them."""
    image = loaded(tmp_path / "a.png")
    colours = pixels(image)[..., :3] / pixels(image)[..., 3:]
    store_channel(image, "A", MAP, dither=False)
    assert image.colorspace_settings.name == "sRGB" and image.alpha_mode == "CHANNEL_PACKED"
    np.testing.assert_allclose(pixels(image)[..., 3], MAP, atol=1e-5)
    np.testing.assert_allclose(pixels(image)[..., :3], colours, rtol=1e-3)


@pytest.mark.parametrize("depth", [8, 16])
def test_the_line_is_said_where_materials_read_a_channel_as_a_colour(depth: int, tmp_path: Path) -> None:
    image = loaded(tmp_path / "a.png", depth=depth)
    (line,) = lines_on_channel(image, "R")
    assert line.startswith("a.png: its color space is sRGB, so that materials read its R as a color") and (
        "set it to Non-Color" in line
    )
    assert not lines_on_channel(image, "A")
    for space in ("Non-Color", "Linear Rec.709"):
        image.colorspace_settings.name = space
        assert not lines_on_channel(image, "R")


def painted(path: Path) -> Any:
    image = loaded(path)
    image.pixels.foreach_set(np.zeros(4 * 12 * 8, np.float32))
    image.update()
    return image


def lost(path: Path) -> Any:
    image = loaded(path)
    path.unlink()
    image.buffers_free()
    return image


def radiance(path: Path) -> Any:
    made = bpy.data.images.new("Made", *SIZE, float_buffer=True)
    made.file_format, made.filepath_raw = "HDR", str(path.with_suffix(".hdr"))
    made.save()
    return bpy.data.images.load(made.filepath_raw)


@pytest.mark.parametrize(
    ("make", "channel", "words"),
    [
        (painted, "R", "changes that are not saved; save it first"),
        (lost, "R", r"its file .*a\.png is missing; find it"),
        (radiance, "R", "save it as PNG, TIFF or OpenEXR"),
        (lambda _: bpy.data.images.new("Tiles", *SIZE, tiled=True), "R", "Tiles: it is UDIM tiles; choose a single"),
        (lambda _: bpy.data.images.new("New", *SIZE, float_buffer=True), "A", "New: it has no alpha"),
        (lambda path: loaded(path, values=THERE[..., :3]), "A", "it has no channel A; choose one of R, G, B"),
        (lambda path: loaded(path, values=MAP), "R", "it has no channel R; save it as RGB"),
        (lambda path: loaded(path, values=MAP, packed=True), "R", r"^a\.png: it has no channel R"),
    ],
)
def test_what_cannot_take_it_is_refused(make: Callable[[Path], Any], channel: str, words: str, tmp_path: Path) -> None:
    image = make(tmp_path / "a.png")
    with pytest.raises(InputError, match=words):
        check_image_channel(image, channel, SIZE)


def test_what_is_painted_and_packed_stays(tmp_path: Path) -> None:
    image = loaded(tmp_path / "a.png", depth=8, packed=True)
    grey = np.full(4 * 12 * 8, 0.4, np.float32)
    image.pixels.foreach_set(grey)
    image.update()
    store_channel(image, "R", MAP, dither=False)
    assert np.abs(pixels(image)[..., 0] - MAP).max() <= 0.5001 / 255
    np.testing.assert_allclose(pixels(image)[..., 1:], 0.4, atol=1e-6)


@pytest.mark.parametrize("floats", [False, True])
def test_a_new_image_that_nobody_has_touched_is_packed(floats: bool, tmp_path: Path) -> None:
    """Or it would be lost with the session."""
    image = bpy.data.images.new("New", *SIZE, float_buffer=floats, is_data=True)
    store_channel(image, "R", MAP, dither=False)
    assert image.packed_file is not None and not image.is_dirty
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "saved.blend"))
    assert np.abs(pixels("New")[..., 0] - MAP).max() <= (1e-6 if floats else 0.5001 / 255)


def test_bytes_of_other_formats_are_left_to_be_saved(tmp_path: Path) -> None:
    made = bpy.data.images.new("Made", *SIZE)
    made.file_format, made.filepath_raw = "TARGA", str(tmp_path / "a.tga")
    made.save()
    image = bpy.data.images.load(str(tmp_path / "a.tga"))
    store_channel(image, "R", MAP, dither=False)
    assert image.is_dirty
    image.save()
    assert np.abs(read_image(tmp_path / "a.tga")[0][..., 0] - MAP).max() <= 0.5001 / 255


def test_a_bake_goes_into_a_file_of_16_bits_in_srgb(registered: None, tmp_path: Path) -> None:
    blender.wall()
    blender.plane("Floor")
    set_panel(width=32, height=32, quality="RAYS", rays=16, margin=2)
    assert bake_onto("Floor") == {"FINISHED"}
    right = pixels("Floor AO")[..., 0]
    image = loaded(tmp_path / "orm.png", values=np.ones((32, 32, 3), np.float32))
    set_panel(output="CHANNEL", image=image, channel="R")
    assert bake_onto("Floor") == {"FINISHED"}
    assert right.min() < 0.9 and np.abs(read_image(tmp_path / "orm.png")[0][..., 0] - right).max() <= 0.5001 / 65535
    assert "orm.png: its color space is sRGB" in bpy.context.window_manager.occlusion_bake.lines
