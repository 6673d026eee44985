"""The command's other outputs: a channel of an image that is there, colour attributes in a copy of the scene."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.core.finish.image_file import read_image, write_image  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402

pytestmark = pytest.mark.usefixtures("empty_scene")


@pytest.fixture
def orm(tmp_path: Path) -> Path:
    path = tmp_path / "orm.png"
    write_image(path, np.random.default_rng(1).random((64, 64, 3), dtype=np.float32), depth=8)
    return path


def test_ao_into_the_red_of_an_orm(bake: Any, orm: Path) -> None:
    before = read_image(orm)[0]
    blender.plane("Floor")
    blender.wall()
    run = bake("--objects", "Floor", "--into", f"{orm}:r")
    assert (run.status, run.err) == (0, "")
    after = read_image(orm)[0]
    np.testing.assert_array_equal(after[..., 1:], before[..., 1:])
    assert after[..., 0].mean() == pytest.approx(run.report["objects"][0]["mean"]["ao"], abs=2e-3)
    assert run.report["objects"][0]["files"] == {"ao": str(orm)}
    assert run.files == ["report.json"]


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (("--into", "orm.png"), "'orm.png' is no channel of a file"),
        (("--into", "nowhere.png:R"), "nowhere.png: cannot be read as an image"),
        (("--into", "{orm}:A"), "it has no channel A"),
        (("--into", "{orm}:R", "--size", "32"), "it is 64x64 and the bake 32x32"),
        (("--into", "{orm}:R", "--maps", "ao", "ro"), "a channel takes one grey map of one object"),
        (("--into", "{orm}:R", "--color-attributes", "x.blend"), "--into: color attributes are no images"),
        (("--color-attributes", "x.png"), "end its name in .blend"),
    ],
)
def test_what_is_refused_before_the_bake(bake: Any, orm: Path, words: Any, line: str) -> None:
    blender.plane("Floor")
    before = orm.read_bytes()
    assert line in bake(*(word.format(orm=orm) for word in words)).refused()
    assert orm.read_bytes() == before


def test_color_attributes_in_a_copy_of_the_scene(bake: Any, tmp_path: Path) -> None:
    blender.plane("Floor", uv=None)
    blender.wall()
    run = bake("--objects", "Floor", "--color-attributes", str(tmp_path / "colours.blend"))
    assert (run.status, run.err) == (0, "")
    assert run.files == ["report.json"] and run.report["objects"][0]["files"] == {}
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "colours.blend"))
    mesh = bpy.data.objects["Floor"].data
    values = [each.color[0] for each in mesh.color_attributes["AO"].data]
    assert not mesh.uv_layers and min(values) < 0.9 and max(values) <= 1.0
