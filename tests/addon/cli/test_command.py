"""The command: what it writes and reports, and how it refuses what it cannot bake."""

from __future__ import annotations

import math
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.addon.cli.command import blender_command, main  # noqa: E402
from occlusion_bake.core.base.errors import Cancelled, InputError  # noqa: E402
from occlusion_bake.core.base.version import version  # noqa: E402
from occlusion_bake.core.finish.image_file import read_image  # noqa: E402
from occlusion_bake.core.finish.report import write_report  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402

pytestmark = pytest.mark.usefixtures("empty_scene")

STAGES = ("extract", "charts", "build", "trace", "solve", "write")


def floor_and_wall() -> None:
    """Asymmetrical in both axes: darkest at the right edge, in the upper half of the texture."""
    blender.plane("Floor")
    blender.wall()


def contents(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


# What is written


def test_the_report_has_what_is_promised(bake: Any) -> None:
    floor_and_wall()
    run = bake("--objects", "Floor", "--maps", "ao", "ro", "--coverage", "//out/coverage.png", "--threads", "2")
    assert (run.status, run.err) == (0, "")
    report = run.report
    assert {"version", "embree", "threads", "seconds", "objects"} <= report.keys()
    assert report["version"] == version() and report["threads"] == 2 and report["embree"]
    (floor,) = report["objects"]
    assert (report["rays_per_texel"], report["error_wanted"], report["filtered"]) == (4, None, False)
    promised = {"name", "size", "texels", "rays", "seconds", "error", "p99", "mean", "files"}
    assert promised <= floor.keys() and "cycles" not in floor
    assert (floor["name"], floor["size"], floor["texels"], floor["rays"]) == ("Floor", [64, 64], 64**2, 64**2 * 4 * 2)
    assert floor["error"].keys() == floor["p99"].keys() == floor["mean"].keys() == {"ao", "ro_10"}
    for name in ("ao", "ro_10"):
        assert 0.0 < floor["mean"][name] < 1.0 and 0.0 < floor["error"][name] < floor["p99"][name] < 0.5
    assert floor["files"].keys() == {"ao", "ro_10", "coverage"}
    assert all(Path(path).is_absolute() and Path(path).is_file() for path in floor["files"].values())


def test_times_add_up(bake: Any) -> None:
    blender.plane("One")
    blender.plane("Two", location=(0, 0, 1))
    blender.bare_cube("Three", location=(9, 0, 0))
    report = bake().report
    totals = 0.0
    for entry in report["objects"]:
        seconds = entry["seconds"]
        assert {*STAGES, "total"} <= seconds.keys()
        stages = [seconds[name] for name in seconds if name != "total"]
        assert min(stages) >= 0.0 and min(seconds[name] for name in ("build", "trace", "solve", "write")) > 0.0
        assert seconds["total"] >= sum(stages) - 1e-9
        totals += seconds["total"]
    charts = {entry["name"]: entry["seconds"]["charts"] for entry in report["objects"]}
    assert charts["Three"] > 0.0 and charts["One"] == charts["Two"] == 0.0
    shared = {name: value for name, value in report["seconds"].items() if name != "total"}
    assert shared.keys() == {"extract"} and shared["extract"] > 0.0
    assert report["seconds"]["total"] >= totals + sum(shared.values()) - 1e-9


def test_a_comparison_is_in_the_report_and_not_in_the_time(bake: Any) -> None:
    floor_and_wall()
    run = bake("--objects", "Floor", "--compare-cycles", "16", "--rays", "64", "--distance", "1.5")
    assert run.status == 0, run.err
    report = run.report
    (floor,) = report["objects"]
    cycles = floor["cycles"]
    assert {"samples", "seconds", "rmse", "bias", "p99"} <= cycles.keys()
    assert cycles["samples"] == 16 and cycles["seconds"] > 0.0
    assert abs(cycles["bias"]) <= cycles["rmse"] < 0.1 and cycles["rmse"] <= cycles["p99"] * 3 and cycles["p99"] < 0.5
    assert Path(cycles["picture"]).is_absolute() and Path(cycles["picture"]).is_file()
    assert "Floor_ao_compared.png" in run.files
    assert floor["seconds"]["total"] <= report["seconds"]["total"]


def test_what_cycles_has_no_bake_for_is_said_and_ao_compared(bake: Any) -> None:
    """Two objects in an atlas, of which RO is asked for alone."""
    floor_and_wall()
    blender.plane("Roof", location=(0, 0, 1))
    run = bake(
        "--objects", "Floor", "Roof", "--atlas", "Sheet", "--uv", "charts", "--maps", "ro", "--compare-cycles", "4"
    )
    assert run.status == 0, run.err
    assert "Cycles has no bake of RO 10; AO is compared" in run.lines
    (sheet,) = run.report["objects"]
    assert (sheet["mean"].keys(), sheet["files"].keys()) == ({"ro_10"}, {"ro_10"})
    assert sheet["cycles"]["samples"] == 4 and "cycles" not in run.report
    assert {"Sheet_ro_10.png", "Sheet_ao_compared.png"} < set(run.files) and "Sheet_ao.png" not in run.files


def test_a_batch_of_color_attributes_has_a_total(bake: Any, tmp_path: Path) -> None:
    blender.cube("Box")
    blender.plane("Floor", location=(0, 0, -1.1))
    run = bake("--color-attributes", str(tmp_path / "colours.blend"), "--compare-cycles", "4")
    assert run.status == 0, run.err
    box, floor = run.report["objects"]
    total = run.report["cycles"]
    assert (total["images"], total["texels"]) == (2, box["cycles"]["texels"] + floor["cycles"]["texels"])
    assert any(line.startswith("2 images together: ") for line in run.out.splitlines())
    assert {"Box_ao_compared.png", "Floor_ao_compared.png"} < set(run.files)


def test_one_that_cycles_would_not_bake_does_not_stop_the_others(bake: Any) -> None:
    blender.plane("Speck", uv=((0.01, 0.01), (0.012, 0.01), (0.012, 0.012), (0.01, 0.012)))
    blender.plane("Floor", location=(0, 0, 1))
    run = bake("--objects", "Speck", "Floor", "--compare-cycles", "1")
    assert run.status == 4 and run.complaint.startswith("1 of 2 images not compared; Speck: ")
    assert {"Speck_ao.png", "Floor_ao.png"} <= set(run.files)
    (refusal,) = run.report["refused"]
    assert refusal.startswith("Speck: ")
    speck, floor = run.report["objects"]
    assert "cycles" not in speck and floor["cycles"]["samples"] == 1


def test_the_image_says_what_was_baked(bake: Any) -> None:
    floor_and_wall()
    bpy.ops.object.camera_add(location=(0, 0, 5))
    bpy.context.scene.camera = bpy.context.object
    words = ("--maps", "ao", "ro", "--ro-exponent", "2.5", "--ro-direction", "camera", "--distance", "3", "--seed", "7")
    run = bake("--objects", "Floor", *words, "--ro-horizon", "divide")
    assert run.status == 0, run.err
    files = run.report["objects"][0]["files"]
    said = read_image(files["ro_2.5"])[1]
    expected = {"object": "Floor", "exponent": 2.5, "direction": "camera", "distance": 3.0, "seed": 7}
    expected["horizon"] = "divided"
    assert run.report["ro_horizon"] == "divide" and run.report["objects"][0]["inside"] == 0.0
    assert expected.items() <= said.items()
    assert said["rays_per_texel"] == 4 and version() in str(said["software"])
    assert said["map"] != read_image(files["ao"])[1]["map"]
    assert said["estimated_rmse"] == pytest.approx(run.report["objects"][0]["error"]["ro_2.5"])
    assert said["estimated_p99"] == pytest.approx(run.report["objects"][0]["p99"]["ro_2.5"])
    assert (said["error_wanted"], said["filtered"]) == ("none", "no")


# How far it goes


@pytest.mark.parametrize(
    ("words", "error", "filtered"),
    [
        ((), 1 / 255, True),
        (("--quality", "draft"), 1 / 50, True),
        (("--quality", "final"), 1 / 510, True),
        (("--error", "1/100"), 1 / 100, True),
        (("--error", "0.02", "--no-filter"), 0.02, False),
    ],
    ids=lambda each: " ".join(each) if isinstance(each, tuple) else None,
)
def test_a_bake_gets_to_the_error_asked_for(bake: Any, words: tuple[str, ...], error: float, filtered: bool) -> None:
    floor_and_wall()
    run = bake("--objects", "Floor", *words, effort=())
    assert (run.status, run.err) == (0, "")
    report, (floor,) = run.report, run.report["objects"]
    assert (report["error_wanted"], report["filtered"]) == (pytest.approx(error), filtered)
    assert report["rays_per_texel"] is None
    assert 0.0 < floor["error"]["ao"] <= error and not floor["warnings"]
    said = read_image(floor["files"]["ao"])[1]
    assert said["error_wanted"] == pytest.approx(error) and said["filtered"] == ("yes" if filtered else "no")
    assert said["estimated_rmse"] == pytest.approx(floor["error"]["ao"])
    assert said["rays_per_texel"] == pytest.approx(floor["rays"] / floor["texels"], abs=0.06)


def test_rays_are_plain_unless_the_filter_is_asked_for(bake: Any) -> None:
    floor_and_wall()
    plain, smooth = (bake("--objects", "Floor", *words).report for words in ((), ("--filter",)))
    assert (plain["filtered"], smooth["filtered"]) == (False, True)
    assert smooth["objects"][0]["error"]["ao"] < plain["objects"][0]["error"]["ao"] / 2


def test_a_naive_sampler_gets_plain_rays_unless_told_otherwise(bake: Any) -> None:
    floor_and_wall()
    naive = ("--objects", "Floor", "--sampler", "uniform_sphere")
    for words, rays, error in (((), 64, None), (("--error", "1/20"), None, 1 / 20)):
        report = bake(*naive, *words, effort=()).report
        assert (report["rays_per_texel"], report["error_wanted"]) == (rays, error)
        assert report["filtered"] == (error is not None)


def test_the_errors_are_said(bake: Any) -> None:
    floor_and_wall()
    run = bake("--objects", "Floor", "--maps", "ao", "ro", effort=("--quality", "draft"))
    (line,) = (each for each in run.out.splitlines() if each.startswith("Floor: 64x64"))
    (floor,) = run.report["objects"]
    for name in ("ao", "ro_10"):
        assert f"{name} ±{floor['error'][name]:.4f} (99 % within {floor['p99'][name]:.4f})" in line


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("--error", "0"), "error 0"),
        (("--error", "-1"), "error -1"),
        (("--error", "nan"), "error nan"),
        (("--error", "2"), "error 2"),
        (("--error", "1/0"), "1/0"),
        (("--error", "1/2/3"), "1/2/3"),
        (("--error", "little"), "'little' is no error; give one as 0.004 or 1/255"),
        (("--quality", "best"), "best"),
        (("--error", "0.01", "--quality", "good"), "--quality: not allowed with argument --error"),
    ],
    ids=" ".join,
)
def test_errors_that_are_refused(bake: Any, words: tuple[str, ...], named: str) -> None:
    blender.plane("Floor")
    bake(*words, effort=()).refused(named)


# Files


@pytest.mark.parametrize(
    ("kind", "depth", "suffix"), [("png", 8, "png"), ("png", 16, "png"), ("exr", 32, "exr"), ("tiff", 32, "tif")]
)
def test_formats_hold_the_same_picture(bake: Any, kind: str, depth: int, suffix: str) -> None:
    floor_and_wall()
    run = bake("--objects", "Floor", "--format", kind, "--depth", str(depth))
    values = read_image(run.folder / f"Floor_ao.{suffix}")[0]
    grey = values if values.ndim == 2 else values[..., 0]
    assert grey.shape == (64, 64)
    assert grey[:32, 32:].mean() < grey[32:, :32].mean() - 0.05  # dark above and right: row 0 is the top
    if suffix == "exr":
        assert (values[..., 3] == 1.0).all()
    assert grey.mean() == pytest.approx(run.report["objects"][0]["mean"]["ao"], abs=0.6 / (2 ** min(depth, 16) - 1))


def test_the_same_seed_gives_the_same_bytes_and_another_does_not(bake: Any) -> None:
    floor_and_wall()
    pictures = []
    for words in (("--seed", "1"), ("--seed", "1", "--threads", "1"), ("--seed", "2")):
        run = bake("--objects", "Floor", *words, "--format", "exr", "--depth", "32")
        pictures.append(read_image(run.folder / "Floor_ao.exr")[0])
    np.testing.assert_array_equal(pictures[0], pictures[1])
    assert not np.array_equal(pictures[0], pictures[2])


def test_size_in_both_directions(bake: Any) -> None:
    blender.plane()
    run = bake("--size", "48x16")
    assert run.report["objects"][0]["size"] == [48, 16]
    assert read_image(run.folder / "Plane_ao.png")[0].shape[:2] == (16, 48)


def test_coverage_is_in_the_exr_and_in_the_file_asked_for(bake: Any) -> None:
    blender.plane("Half", uv=((0, 0), (0.5, 0), (0.5, 1), (0, 1)))
    run = bake("--margin", "4", "--format", "exr", "--depth", "32", "--coverage", "//out/coverage.png")
    values, alpha = (read_image(run.folder / "Half_ao.exr")[0][..., channel] for channel in (0, 3))
    assert (values == 1.0).all()  # an open plane, its margin, and their mean beyond
    assert (alpha[:, :32] == 1.0).all() and (alpha[:, 32:] == 0.0).all()
    np.testing.assert_array_equal(read_image(run.folder / "coverage.png")[0][..., 0], alpha)


def test_names_that_clash_or_lead_elsewhere(bake: Any) -> None:
    names = ["a/b", "a:b", "A|B", "../x", "..", "größe 茶", "x" * 60]
    for place, name in enumerate(names):
        blender.plane(name, location=(0, 0, place))
    run = bake("--coverage", "//out/cover.png")
    assert run.status == 0, run.err
    entries = run.report["objects"]
    assert sorted(entry["name"] for entry in entries) == sorted(names)
    files = [Path(path) for entry in entries for path in entry["files"].values()]
    assert len(set(files)) == 2 * len(names)
    assert {path.parent for path in files} == {run.folder.resolve()}
    assert "größe 茶_ao.png" in run.files
    assert sorted(run.files) == sorted(["report.json", *(path.name for path in files)])


def test_a_long_name_is_cut_to_what_file_systems_take(bake: Any) -> None:
    for _ in range(2):
        blender.plane("茶" * 80)  # Blender cuts it too, later releases less
    run = bake()
    assert run.status == 0 and len(run.files) == 3


def test_two_slashes_are_the_scenes_folder(bake: Any, tmp_path: Path) -> None:
    blender.plane()
    run = bake("--output", "//baked", "--report", "//baked/r.json", "--coverage", "//c.png")
    assert run.status == 0, run.err
    assert {"Plane_ao.png", "r.json"} == {path.name for path in (tmp_path / "baked").iterdir()}
    assert (tmp_path / "c.png").is_file()


@pytest.mark.parametrize("option", ["--output", "--report", "--coverage"])
def test_two_slashes_without_a_saved_file(option: str, capfd: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    blender.plane()
    last = (option, "//x.png")
    assert blender_command(["--size", "8", "--rays", "1", "--output", str(tmp_path / "out"), *last]) == 2
    error = capfd.readouterr().err
    assert error.startswith("occlusion_bake: //x.png: ") and error.count("\n") == 1 and "save it" in error
    assert not Path("//x.png").exists() and not (tmp_path / "out").exists()


def test_inside_blender_the_open_file_is_baked(tmp_path: Path) -> None:
    blender.plane()
    assert blender_command(["--size", "16", "--rays", "1", "--output", str(tmp_path)]) == 0
    assert (tmp_path / "Plane_ao.png").is_file()


# What is baked


def test_by_default_all_that_renders(bake: Any) -> None:
    blender.plane("Seen")
    blender.plane("Hidden", location=(0, 0, 1)).hide_render = True
    blender.mesh("Points", ((0, 0, 0),), ())
    run = bake()
    assert run.status == 0
    assert [entry["name"] for entry in run.report["objects"]] == ["Seen"]


def test_an_object_named_twice_is_baked_once(bake: Any) -> None:
    blender.plane()
    run = bake("--objects", "Plane", "Plane")
    assert run.status == 0 and run.files == ["Plane_ao.png", "report.json"]


def test_one_that_cannot_be_baked_does_not_stop_the_others(bake: Any) -> None:
    blender.plane("Good")
    blender.plane("Better", location=(0, 0, 2))
    blender.plane("Broken", location=(9, 0, 0)).data.vertices[1].co.x = math.nan
    bare = blender.bare_cube("Bare and broken", location=(0, 9, 0))
    bare.data.vertices[0].co.y = math.inf
    blender.plane("Hidden").hide_render = True
    blender.mesh("Empty", ((0, 0, 0),), ())
    named = ("Good", "Broken", "Bare and broken", "Hidden", "Empty", "Nobody", "Better")
    run = bake("--objects", *named)
    assert run.status == 4
    assert run.files == ["Better_ao.png", "Good_ao.png", "report.json"]
    assert run.complaint.startswith("5 of 7 objects could not be baked; ")
    report = run.report
    assert {entry["name"] for entry in report["objects"]} == {"Good", "Better"}
    assert len(report["refused"]) == 5 and set(report["refused"]) <= set(run.lines)
    for name in ("Broken", "Bare and broken", "Hidden", "Empty", "Nobody"):
        assert sum(line.startswith(f"{name}: ") for line in report["refused"]) == 1


def test_none_of_several_can_be_baked(bake: Any) -> None:
    blender.plane("One").hide_render = True
    blender.plane("Two").hide_render = True
    assert bake().refused("2 of 2 objects could not be baked; One: ", "hidden").count("Two") == 0


# Files of other kinds


@pytest.fixture(scope="module")
def exported(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Blender's cube as model.obj, model.glb and model.ply."""
    folder = tmp_path_factory.mktemp("exported")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_cube_add()
    bpy.ops.wm.obj_export(filepath=str(folder / "model.obj"))
    bpy.ops.wm.ply_export(filepath=str(folder / "model.ply"), export_uv=True)
    bpy.ops.export_scene.gltf(filepath=str(folder / "model.glb"))
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "model.blend"))
    return folder


@pytest.mark.parametrize("kind", ["blend", "obj", "glb", "ply"])
def test_as_a_process_of_its_own(exported: Path, start: Any, tmp_path: Path, kind: str) -> None:
    words = ("--size", "64", "--rays", "2", "--output", "out", "--report", "out/report.json")
    child = start(str(exported / f"model.{kind}"), *words)
    out, err = child.communicate(timeout=60)
    assert (child.returncode, err) == (0, ""), out
    (picture,) = (tmp_path / "out").glob("*_ao.png")
    values = read_image(picture)[0]
    assert values.max() == 1.0  # a cube alone hides nothing of itself


def test_a_name_that_is_not_utf8_is_read_and_cannot_be_written(bake: Any, tmp_path: Path) -> None:
    odd = b"caf\xe9".decode(errors="surrogateescape")
    try:
        (tmp_path / odd).mkdir()
    except (OSError, UnicodeEncodeError):
        pytest.skip("the file system takes UTF-8 alone")
    blender.bare_cube("Bare")
    file = tmp_path / odd / f"{odd}.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(file))
    for words in (("--output", "//"), ("--report", f"{odd}.json"), ("--coverage", "//c.png"), ("--objects", odd)):
        run = bake(*words, file=file)
        assert run.status == 2 and "caf\\udce9" in run.complaint and "not UTF-8" in run.complaint and not run.files
    run = bake(file=file)
    assert (run.status, run.err, run.files) == (0, "", ["Bare_ao.png", "caf__charts.blend", "report.json"])


@pytest.mark.parametrize("kind", ["blend", "obj", "glb", "gltf", "ply", "stl"])
def test_a_text_with_a_models_name(bake: Any, tmp_path: Path, kind: str) -> None:
    file = tmp_path / f"poem.{kind}"
    file.write_text("Whose woods these are\nI think I know\n")
    bake(file=file).refused(str(file), kind)


@pytest.mark.parametrize("kind", ["blend", "glb", "ply"])
def test_a_model_of_which_half_is_missing(bake: Any, exported: Path, tmp_path: Path, kind: str) -> None:
    whole = (exported / f"model.{kind}").read_bytes()
    file = tmp_path / f"half.{kind}"
    file.write_bytes(whole[: len(whole) // 2])
    bake(file=file).refused(str(file))


def test_an_image_named_blend(bake: Any, tmp_path: Path) -> None:
    blender.plane()
    file = tmp_path / "picture.blend"
    (bake(report=False).folder / "Plane_ao.png").rename(file)
    bake(file=file, report=False).refused(str(file), ".blend")


@pytest.mark.parametrize(
    ("name", "word"),
    [("missing.blend", "no such file"), ("folder.blend", "no such file"), ("model.xyz", "unknown kind")],
)
def test_files_that_are_none(bake: Any, tmp_path: Path, name: str, word: str) -> None:
    (tmp_path / "folder.blend").mkdir()
    (tmp_path / "model.xyz").touch()
    bake(file=tmp_path / name).refused(name, word)


def test_a_file_without_a_mesh(bake: Any) -> None:
    bpy.ops.object.light_add()
    bake().refused("no mesh", "add one")


# Meshes that cannot be baked, and those that can in part


def spoil(name: str) -> None:
    """One scene for each thing that is wrong."""
    if name == "no faces":
        blender.mesh("Thing", ((0, 0, 0), (1, 0, 0)), ())
        return
    obj = blender.plane("Thing")
    if name == "not finite":
        obj.data.vertices[2].co.z = math.nan
    elif name == "zero area":
        obj.data.vertices.foreach_set("co", [1.0, 2.0, 3.0] * 4)
    elif name == "hidden from render":
        obj.hide_render = True
    elif name == "no area in the texture":
        obj.data.uv_layers[0].uv.foreach_set("vector", [0.25] * 8)
    elif name == "outside the 0-1 square":
        obj.data.uv_layers[0].uv.foreach_set("vector", [-2, 2, -1, 2, -1, 3, -2, 3])


@pytest.mark.parametrize(
    "wrong",
    ["no faces", "not finite", "zero area", "hidden from render", "no area in the texture", "outside the 0-1 square"],
)
def test_a_mesh_that_cannot_be_baked(bake: Any, wrong: str) -> None:
    spoil(wrong)
    named = ("--uv", "UVMap") if wrong == "no area in the texture" else ()  # or charts are made
    assert bake(*named).refused("Thing: ", wrong).count(";") >= 1  # the cure


def test_broken_neighbours_are_left_out_with_a_warning(bake: Any) -> None:
    blender.plane("Floor")
    blender.plane("Broken", location=(0, 0, 1)).data.vertices[0].co.x = math.nan
    run = bake("--objects", "Floor")
    assert run.status == 0
    assert any("Broken" in line for line in run.lines)


def two_squares(second: Any, flat: bool = False) -> None:
    """Two squares apart, the first with the left half of the texture, the second with UVs as given."""
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (3, 0, 0), (4, 0, 0), (4, 1, 0), (3, 1, 0)]
    if flat:
        corners[4:] = [(3, 0, 0), (4, 0, 0), (5, 0, 0), (6, 0, 0)]
    first = ((0, 0), (0.5, 0), (0.5, 1), (0, 1))
    blender.mesh("Thing", corners, ((0, 1, 2, 3), (4, 5, 6, 7)), (*first, *second))


@pytest.mark.parametrize(
    ("second", "line"),
    [
        (((0, 0), (0.5, 0), (0.5, 1), (0, 1)), "Thing: UVs overlap on 2048 of 2048 texels (100.0 %)"),
        (((0.25, 0), (0.75, 0), (0.75, 1), (0.25, 1)), "Thing: UVs overlap on 1024 of 3072 texels (33.3 %)"),
        (((-0.5, 0), (0, 0), (0, 1), (-0.5, 1)), "Thing: 2 triangles leave the 0-1 UV square"),
        (((0.6, 0.5), (0.7, 0.5), (0.8, 0.5), (0.9, 0.5)), "Thing: 2 triangles have no area in the texture"),
    ],
)
def test_uvs_that_bake_in_part(bake: Any, second: Any, line: str) -> None:
    two_squares(second)
    run = bake()
    assert (run.status, run.err) == (0, "")
    assert [each for each in run.lines if each.startswith(line)] == run.report["objects"][0]["warnings"] != []


def test_triangles_without_area_are_left_out_with_a_warning(bake: Any) -> None:
    two_squares(((0.5, 0), (1, 0), (1, 1), (0.5, 1)), flat=True)
    run = bake()
    assert run.status == 0 and run.report["objects"][0]["texels"] == 64 * 32
    assert any(line.startswith("Thing: 2 triangles have zero area") for line in run.lines)


# Options that are refused


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("--size", "0"), "size 0x0"),
        (("--size", "-5"), "size -5x-5"),
        (("--size", "100000"), "65536"),
        (("--size", "64x0"), "64x0"),
        (("--size", "12y"), "12y"),
        (("--size", "1x2x3"), "1x2x3"),
        (("--rays", "0"), "rays 0"),
        (("--rays", "1.5"), "1.5"),
        (("--rays", "9999999"), "rays"),
        (("--error", "0.01"), "--error: not allowed with argument --rays"),
        (("--quality", "good"), "--quality: not allowed with argument --rays"),
        (("--distance", "-1"), "distance -1"),
        (("--distance", "0"), "distance 0"),
        (("--distance", "nan"), "distance nan"),
        (("--distance", "inf"), "distance inf"),
        (("--maps", "ro", "--ro-exponent", "-1"), "exponent -1"),
        (("--maps", "ro", "--ro-exponent", "10", "nan"), "exponent nan"),
        (("--maps", "ro", "--ro-exponent", "inf"), "exponent inf"),
        (("--maps", "ro", "--ro-exponent", "soft"), "soft"),
        (("--maps", "ro", "--ro-direction", "camera"), "camera"),
        (("--maps", "curvature"), "curvature"),
        (("--objects", "Nobody"), "Nobody: no such object"),
        (("--uv", "Lightmap"), "Floor: no UV map named Lightmap"),
        (("--format", "jpg"), "jpg"),
        (("--format", "png", "--depth", "32"), "png"),
        (("--format", "exr", "--depth", "8"), "exr"),
        (("--depth", "12"), "12"),
        (("--margin", "-1"), "margin -1"),
        (("--threads", "-1"), "threads -1"),
        (("--compare-cycles", "0"), "--compare-cycles 0"),
        (("--compare-cycles", "-3"), "--compare-cycles -3"),
        (("--coverage", "//out/coverage.jpg"), "coverage.jpg"),
        (("--coverage", "//coverage"), "coverage"),
        (("--bounces", "3"), "--bounces"),
        (("--out", "elsewhere"), "--out"),
        (("another.blend",), "another.blend"),
    ],
    ids=" ".join,
)
def test_options_that_are_refused(bake: Any, words: tuple[str, ...], named: str) -> None:
    blender.plane("Floor")
    bake(*words).refused(named)


def test_the_file_is_asked_for(capfd: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 2
    error = capfd.readouterr().err
    assert error.startswith("occlusion_bake: ") and error.count("\n") == 1 and "FILE" in error


def test_help_is_no_error(capfd: pytest.CaptureFixture[str]) -> None:
    assert main(["--help"]) == 0
    assert "--compare-cycles" in capfd.readouterr().out


@pytest.mark.parametrize("option", ["--output", "--report", "--coverage"])
@pytest.mark.parametrize("place", ["a file", "/proc"])
def test_a_folder_that_cannot_be_written(bake: Any, tmp_path: Path, option: str, place: str) -> None:
    if place == "/proc" and sys.platform != "linux":
        pytest.skip("no such folder here")
    blender.plane()
    (tmp_path / "a file").write_text("in the way")
    where = tmp_path / place
    bake(option, str(where / "sub" / "x.png")).refused(str(where))
    assert (tmp_path / "a file").read_text() == "in the way"


@pytest.mark.parametrize("option", ["--report", "--coverage"])
def test_a_folder_in_the_place_of_a_file(bake: Any, tmp_path: Path, option: str) -> None:
    blender.plane()
    (tmp_path / "taken.png").mkdir()
    bake(option, str(tmp_path / "taken.png")).refused("taken.png", "folder")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--report", "//Plane_ao.png"), "it is no image; end its name in .json"),  # the texture's own name
        (("--report", "//scene.blend"), "it is the scene"),
        (("--coverage", "//x.png", "--into", "//sub/../x.png:R"), "another option's file"),
    ],
)
def test_no_named_file_takes_the_place_of_another(bake: Any, tmp_path: Path, words: tuple[str, ...], told: str) -> None:
    blender.plane()
    (tmp_path / "sub").mkdir()
    bake(*words).refused(told)
    assert not (tmp_path / "scene.blend").read_bytes().startswith(b"{")
    assert list(contents(tmp_path)) == ["scene.blend"]


@pytest.fixture
def tiny_disk(tmp_path: Path) -> Any:
    """A file system of 40 KB."""
    folder = tmp_path / "disk"
    folder.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", "size=40k", "none", str(folder)]
    if not sys.platform.startswith("linux") or subprocess.run(command, capture_output=True).returncode:
        pytest.skip("no small disk can be mounted here: only root may")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


def test_a_full_disk_leaves_what_was_there(bake: Any, tiny_disk: Path) -> None:
    floor_and_wall()
    before = {"Floor_ao.tif": b"an older bake", "ballast": bytes(24 * 1024)}
    for name, content in before.items():
        (tiny_disk / name).write_bytes(content)
    words = ("--size", "256", "--rays", "64", "--format", "tiff", "--depth", "32", "--output", str(tiny_disk))
    run = bake("--objects", "Floor", *words)
    assert run.status == 2 and "Floor_ao.tif" in run.complaint and not run.files
    assert contents(tiny_disk) == before


def test_a_full_disk_before_the_bake(bake: Any, tiny_disk: Path) -> None:
    blender.plane()
    (tiny_disk / "ballast").write_bytes(bytes(40 * 1024))
    bake("--report", str(tiny_disk / "report.json")).refused(str(tiny_disk), "free some space")
    assert contents(tiny_disk).keys() == {"ballast"}


def test_a_full_disk_for_the_report(tiny_disk: Path) -> None:
    path = tiny_disk / "report.json"
    path.write_text("an older report")
    with pytest.raises(InputError, match=r"report\.json: .*choose another place"):
        write_report(path, {"name": "x" * 100_000})
    assert contents(tiny_disk) == {"report.json": b"an older report"}


def test_a_full_disk_for_the_charts(bake: Any, tiny_disk: Path) -> None:
    blender.bare_cube("Bare")
    (tiny_disk / "ballast").write_bytes(bytes(32 * 1024))
    run = bake("--output", str(tiny_disk))
    assert run.status == 2 and str(tiny_disk / "scene_charts.blend") in run.complaint
    assert contents(tiny_disk).keys() == {"ballast", "Bare_ao.png"}


# Cancelled


STOPS = ["SIGINT", "SIGTERM", "SIGHUP"]


@pytest.fixture
def heard(stop: str) -> Iterator[None]:
    """Whoever started the tests may have told their processes to ignore the signal, as nohup does."""
    number = signal.Signals[stop]
    before = signal.getsignal(number)
    if before is signal.SIG_IGN:
        signal.signal(number, signal.default_int_handler if stop == "SIGINT" else signal.SIG_DFL)
    yield
    signal.signal(number, before)


@pytest.mark.skipif(os.name != "posix", reason="sends signals")
@pytest.mark.usefixtures("heard")
@pytest.mark.parametrize("stop", STOPS)
def test_a_stop_leaves_everything_as_it_was(start: Any, tmp_path: Path, stop: str) -> None:
    """Also in the temporary folder, where Blender and we have been."""
    (tmp_path / "temporary").mkdir()
    floor_and_wall()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    (tmp_path / "Floor_ao.png").write_bytes(b"an older bake")
    (tmp_path / "report.json").write_bytes(b"an older report")
    before = contents(tmp_path)
    words = ("--objects", "Floor", "--rays", "1000000", "--output", ".", "--report", "report.json")
    child = start("scene.blend", *words, environment={"TMPDIR": str(tmp_path / "temporary")})
    for line in child.stdout:
        if "tracing" in line:
            break
    assert [path.name[:8] for path in (tmp_path / "temporary").iterdir()] == ["blender_"]
    child.send_signal(signal.Signals[stop])
    _, err = child.communicate(timeout=30)
    assert child.returncode == 3
    assert err == "occlusion_bake: cancelled\n"
    assert contents(tmp_path) == before and not list((tmp_path / "temporary").iterdir())


@pytest.mark.skipif(os.name != "posix", reason="sends signals")
@pytest.mark.usefixtures("heard")
@pytest.mark.parametrize("stop", STOPS)
def test_a_stop_while_the_file_is_read(bake: Any, monkeypatch: pytest.MonkeyPatch, stop: str) -> None:
    from occlusion_bake.addon.cli import command

    before = [signal.getsignal(each) for each in signal.valid_signals()]
    monkeypatch.setattr(command, "load", lambda _: os.kill(os.getpid(), signal.Signals[stop]))
    run = bake(file="scene.blend")
    assert (run.status, run.complaint, run.files) == (3, "cancelled", [])
    assert [signal.getsignal(each) for each in signal.valid_signals()] == before


def test_a_cancel_stays_one_where_what_is_done_cannot_be_saved(bake: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    from occlusion_bake.addon.cli import command

    def cancelled(entry: Any) -> str:
        if entry["name"] == "Second":
            raise Cancelled
        return "done"

    def unsaved(*_: Any) -> None:
        raise InputError("scene_charts.blend: there is no room")

    monkeypatch.setattr(command, "summary", cancelled)
    monkeypatch.setattr(command, "save_copy", unsaved)
    for place, name in enumerate(("First", "Second")):
        blender.bare_cube(name, location=(9 * place, 0, 0))
    run = bake("--objects", "First", "Second")
    assert run.status == 3
    assert run.err == "occlusion_bake: scene_charts.blend: there is no room\nocclusion_bake: cancelled\n"


def test_ctrl_c_before_the_bake(tmp_path: Path, capfd: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    from occlusion_bake.addon.cli import command

    def interrupted(path: Path) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(command, "load", interrupted)
    assert main([str(tmp_path / "scene.blend")]) == 3
    assert capfd.readouterr().err == "occlusion_bake: cancelled\n"


@pytest.mark.skipif(os.name != "posix", reason="sends signals")
@pytest.mark.parametrize("objects", [("One",), ("One", "Two")])
def test_ctrl_c_while_a_result_is_delivered(
    bake: Any, monkeypatch: pytest.MonkeyPatch, objects: tuple[str, ...]
) -> None:
    """As in Cycles' part of a comparison, which holds the main thread."""
    from occlusion_bake.addon.cli import command

    def interrupted(*arguments: Any) -> Any:
        os.kill(os.getpid(), signal.SIGINT)
        return compare(*arguments)

    compare = command.compare_with_cycles
    monkeypatch.setattr(command, "compare_with_cycles", interrupted)
    for place, name in enumerate(objects):
        blender.plane(name, location=(0, 0, place))
    run = bake("--compare-cycles", "1")
    assert (run.status, run.complaint) == (3, "cancelled")
    assert [name for name in run.files if name.endswith("_ao.png")] == ["One_ao.png"]
    assert "report.json" not in run.files


def test_a_reader_who_leaves_ends_it(start: Any, tmp_path: Path) -> None:
    floor_and_wall()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    child = start("scene.blend", "--rays", "1000000", "--output", "out")
    child.stdout.close()
    assert (child.wait(60), child.stderr.read()) == (3, "")


def test_a_fault_of_ours_is_another_status(bake: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    from occlusion_bake.addon.cli import command

    monkeypatch.setattr(command, "object_entry", lambda *_: 1 / 0)
    blender.plane()
    run = bake()
    assert run.status == 1 and "ZeroDivisionError" in run.err


def test_letters_that_the_terminal_lacks(start: Any, tmp_path: Path) -> None:
    blender.plane("茶")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    words = ("--size", "16", "--rays", "1", "--output", "out")
    child = start("scene.blend", *words, environment={"PYTHONIOENCODING": "ascii:strict"})
    _, err = child.communicate(timeout=60)
    assert (child.returncode, err) == (0, "")
    assert (tmp_path / "out" / "茶_ao.png").is_file()
