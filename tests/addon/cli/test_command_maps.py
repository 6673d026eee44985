"""The command's other maps and options, as files and in the report."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

pytest.importorskip("bpy")

from occlusion_bake.core.finish.image_file import read_image
from occlusion_bake.core.spherical.directional_format import DirectionalFormat, channel_names, from_images, rebuild
from occlusion_bake.core.spherical.lobe import open_horizon
from occlusion_bake.tests.oracles import blender

pytestmark = pytest.mark.usefixtures("empty_scene")


@pytest.fixture
def floor() -> None:
    blender.plane("Floor")


def test_bent_normals_and_a_code_as_pictures(floor: None, bake: Any) -> None:
    run = bake("--maps", "bent", "--bent-y", "down", "--code", "sh_3", "--depth", "8")
    assert run.status == 0, run.err
    names = ["Floor_bent.png", *(f"Floor_sh_3_{number}.png" for number in range(4)), "report.json"]
    assert run.files == names
    bent, told = read_image(run.folder / "Floor_bent.png")
    np.testing.assert_allclose(bent.mean(axis=(0, 1)), (0.5, 0.5, 1.0), atol=0.01)
    assert np.sqrt(np.mean((bent - (0.5, 0.5, 1.0)) ** 2)) < 0.06  # of few rays each
    assert told["green"] == "down"
    pictures = [read_image(run.folder / f"Floor_sh_3_{number}.png")[0] for number in range(4)]
    code = DirectionalFormat("sh", 3)
    values = from_images([np.rint(each * 255).astype(np.uint8) for each in pictures], code).reshape(-1, 16)
    leaning = np.repeat([[np.sin(0.8), 0.0, np.cos(0.8)]], len(values), axis=0)
    np.testing.assert_allclose(rebuild(values, code, leaning, 10.0), open_horizon(10.0, np.cos(0.8)), atol=0.03)
    assert run.report["objects"][0]["error"]["sh_3"] < 0.02


def test_a_code_as_one_exr_of_named_channels(floor: None, bake: Any) -> None:
    run = bake("--code", "mask_8", "--format", "exr", "--depth", "16")
    assert run.status == 0, run.err
    assert run.files == ["Floor_ao.exr", "Floor_mask_8.exr", "report.json"]
    values, told = read_image(run.folder / "Floor_mask_8.exr")
    assert values.shape == (64, 64, len(channel_names(DirectionalFormat("mask", 8))))
    assert np.all(values == 255.0)  # all cells are open
    assert told["code"] == "mask_8" and told["code_rays"] == 256


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (("--code", "sh_9"), "degree"),
        (("--code", "fourier_3"), "--code fourier_3: no such code"),
        (("--code", "mask_12"), "8 or 16"),
        (("--code", "sh_3", "--code-rays", "100"), "power of two"),
        (("--code", "sh_3", "--format", "tiff", "--depth", "32"), "8 or 16 bits a channel"),
        (("--spread", "0"), "spread 0"),
        (("--falloff", "linear"), "it needs a distance"),
        (("--min-distance", "-1"), "minimum distance -1"),
        (("--maps", "light"), "light: it may be above 1"),
        (("--maps", "bent", "--into", "{folder}/orm.png:R"), "one grey map"),
        (("--maps", "bent", "--color-attributes", "{folder}/x.blend"), "take AO and RO alone"),
    ],
)
def test_what_cannot_be_is_one_line(words: tuple[str, ...], line: str, floor: None, bake: Any, tmp_path: Any) -> None:
    run = bake(*(word.format(folder=tmp_path) for word in words))
    assert run.status == 2
    assert line in run.err and run.err.strip().count("\n") == 0


def test_options_reach_the_bake_and_the_report(bake: Any) -> None:
    """A plate that covers the floor: near, far, from behind."""
    blender.plane("Floor")
    lid = blender.plane("Lid", uv=None, location=(0.0, 0.0, 0.5))
    lid.scale = (100.0, 100.0, 1.0)
    means = {}
    for words in ((), ("--front-faces",), ("--min-distance", "0.8", "--distance", "1"), ("--spread", "10"),
                  ("--falloff", "linear", "--distance", "1")):  # fmt: skip
        run = bake("--objects", "Floor", *words)
        assert run.status == 0, run.err
        means[words[:1]] = run.report["objects"][0]["mean"]["ao"]
    assert means[()] < 0.01 and means[("--front-faces",)] == 1.0 and means[("--spread",)] == 0.0
    assert means[("--falloff",)] == pytest.approx(0.75, abs=0.02)
    assert means[("--min-distance",)] == pytest.approx(1 - 0.5**2 / 0.8**2 + 0.25, abs=0.02)
    told = bake("--objects", "Floor", "--falloff", "smooth", "--distance", "2", "--spread", "90").report
    assert (told["falloff"], told["spread"], told["minimum_distance"], told["faces"]) == ("smooth", 90.0, 0.0, "both")


def test_tangents_that_do_not_exist(bake: Any) -> None:
    ring = np.linspace(0, 2 * np.pi, 6)[:-1]
    corners = np.stack([np.cos(ring), np.sin(ring), 0 * ring], axis=1)
    blender.mesh("Pentagon", corners.tolist(), [range(5)], 0.5 + 0.4 * corners[:, :2])
    run = bake("--maps", "bent")
    assert run.status == 2 and "Pentagon: it has faces of more than four corners" in run.err
    assert bake("--maps", "bent", "--bent-space", "world").status == 0
