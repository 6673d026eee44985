"""A plan and its items: the same files as of one run, whoever bakes them and in whatever portions."""

from __future__ import annotations

import json
import math
import os
import shutil
import signal
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.addon.cli.command import blender_command, main  # noqa: E402
from occlusion_bake.core.finish.image_file import read_image  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402

pytestmark = pytest.mark.usefixtures("empty_scene", "charts_here")

SMALL = ("--size", "32", "--margin", "2", "--rays", "4")


@dataclass(frozen=True)
class Farm:
    """A scene's file, its plan, and the command on them; each call gives status, stdout and stderr."""

    home: Path
    capfd: Any

    @property
    def scene(self) -> Path:
        return self.home / "scene.blend"

    @property
    def out(self) -> Path:
        return self.home / "out"

    @property
    def manifest(self) -> Path:
        return self.out / "manifest.json"

    def read(self) -> Any:
        return json.loads(self.manifest.read_text())

    def save(self) -> None:
        bpy.ops.wm.save_as_mainfile(filepath=str(self.scene), check_existing=False)

    def __call__(self, *words: Any) -> tuple[int, str, str]:
        self.capfd.readouterr()
        return main([str(word) for word in words]), *self.capfd.readouterr()

    def plan(self, *words: Any) -> tuple[int, str, str]:
        self.save()
        return self("plan", self.scene, *SMALL, "--output", self.out, *words)

    def bake(self, *words: Any) -> tuple[int, str, str]:
        return self("--manifest", self.manifest, *words)

    def merge(self) -> tuple[int, str, str]:
        return self("merge", self.manifest)

    def whole(self, *words: Any) -> dict[str, bytes]:
        """The images of one run on one machine."""
        folder = self.home / "whole"
        status, _, err = self(self.scene, *SMALL, "--output", folder, *words)
        assert status in (0, 4), err
        return images(folder)


def images(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.suffix in (".png", ".exr", ".tif")}


@pytest.fixture
def farm(tmp_path: Path, capfd: Any) -> Farm:
    return Farm(tmp_path, capfd)


def props(count: int = 5) -> None:
    """In a row, each within reach of the next alone."""
    for number in range(count):
        blender.cube(f"Prop {number}", location=(2.5 * number, 0.0, 0.0))


REACH = ("--distance", "1")


@pytest.mark.parametrize("portions", [("0-4",), ("0", "4,2", "1,3"), ("2/2", "1/2"), (None,)])
def test_any_portions_give_the_files_of_one_run(farm: Farm, portions: tuple[str | None, ...]) -> None:
    props()
    assert farm.plan("--maps", "ao", "ro", "bent")[0] == 0
    for items in portions:
        status, _, err = farm.bake(*(() if items is None else ("--items", items)))
        assert (status, err) == (0, "")
    assert farm.merge()[0] == 0
    assert len(images(farm.out)) == 15
    assert images(farm.out) == farm.whole("--maps", "ao", "ro", "bent")


@pytest.mark.parametrize("form", ["png", "exr", "tiff"])
def test_files_of_every_format_are_the_same_bytes(farm: Farm, form: str) -> None:
    """Whenever they are written: some formats would keep the time."""
    props(1)
    farm.plan("--format", form)
    farm.bake()
    before = images(farm.out)
    time.sleep(1.1)
    farm.bake("--no-resume")
    assert len(before) == 1 and images(farm.out) == before == farm.whole("--format", form)


def test_the_merged_report_is_that_of_one_run(farm: Farm) -> None:
    props(3)
    blender.bare_cube("Without UVs", location=(0, 5, 0))
    report = farm.home / "report.json"
    farm.plan("--report", farm.out / "report.json")
    for items in ("3", "0-2"):
        farm.bake("--items", items)
    assert farm.merge()[0] == 0
    farm.whole("--report", report)
    ours, theirs = (json.loads(path.read_text()) for path in (farm.out / "report.json", report))
    for each in (ours, theirs):
        for entry in each["objects"]:
            entry.pop("seconds")
            entry["files"] = {name: Path(file).name for name, file in entry["files"].items()}
    assert ours["objects"] == theirs["objects"]
    assert "charts" in ours["objects"][-1]
    same = set(theirs) - {"seconds", "objects", "notes"}
    assert {key: ours[key] for key in same} == {key: theirs[key] for key in same}


def test_a_second_run_changes_nothing(farm: Farm) -> None:
    props(3)
    farm.plan()
    farm.bake()
    farm.merge()
    before = {path: (path.read_bytes(), path.stat().st_mtime_ns) for path in farm.out.rglob("*") if path.is_file()}
    status, out, _ = farm.bake()
    assert status == 0 and "3 items have not changed" in out
    farm.merge()
    after = {path: (path.read_bytes(), path.stat().st_mtime_ns) for path in farm.out.rglob("*") if path.is_file()}
    assert before == after
    assert "3 items" not in farm.bake("--no-resume")[1]


def test_what_one_prop_can_reach_is_baked_again(farm: Farm) -> None:
    props()
    farm.plan(*REACH)
    farm.bake()
    before = {path.name: path.stat().st_mtime_ns for path in farm.out.glob("*.png")}
    bpy.data.objects["Prop 4"].location.z += 0.25
    farm.plan(*REACH)
    status, out, _ = farm.bake()
    assert status == 0 and "3 items have not changed" in out
    changed = {path.name for path in farm.out.glob("*.png") if path.stat().st_mtime_ns != before[path.name]}
    assert changed == {"Prop 3_ao.png", "Prop 4_ao.png"}
    assert images(farm.out) == farm.whole(*REACH)


def test_a_new_object_does_not_move_the_others_records(farm: Farm) -> None:
    props(3)
    farm.plan(*REACH)
    farm.bake()
    blender.cube("A first one", location=(0, 90, 0))
    farm.plan(*REACH)
    assert "3 items have not changed" in farm.bake()[1]
    assert farm.merge()[0] == 0


@pytest.mark.parametrize(
    "harm", [lambda data: b"", lambda data: data[: len(data) // 2], lambda data: data[:-1], lambda data: b"no image"]
)
def test_a_broken_file_is_baked_again(farm: Farm, harm: Callable[[bytes], bytes]) -> None:
    props(2)
    farm.plan()
    farm.bake()
    good, file = images(farm.out), farm.out / "Prop 1_ao.png"
    file.write_bytes(harm(file.read_bytes()))
    status, _, err = farm.merge()
    assert status == 4 and "bake --items 1" in err
    assert "1 items have not changed" in farm.bake()[1]
    assert images(farm.out) == good and farm.merge()[0] == 0


def test_a_file_of_other_inputs_is_baked_again(farm: Farm) -> None:
    props(2)
    farm.plan()
    farm.bake()
    good = images(farm.out)
    shutil.copy(farm.out / "Prop 0_ao.png", farm.out / "Prop 1_ao.png")
    assert farm.merge()[0] == 4
    farm.bake()
    assert images(farm.out) == good


def test_an_atlas_of_parts(farm: Farm) -> None:
    for number in range(3):
        blender.bare_cube(f"Part {number}", location=(3.0 * number, 0.0, 0.0))
    blender.plane("Floor", location=(0, 0, -1))
    farm.plan("--atlas", "Room", "--maps", "ao", "ro")
    assert [item["files"] for item in farm.read()["items"]] == [{}] * 4
    farm.bake("--items", "3")
    assert farm.merge()[0] == 4 and not images(farm.out)
    farm.bake("--items", "0-2")
    assert farm.merge()[0] == 0
    assert images(farm.out) == farm.whole("--atlas", "Room", "--maps", "ao", "ro")
    before = {path: path.stat().st_mtime_ns for path in farm.out.glob("*.png")}
    assert farm.merge()[0] == 0 and {path: path.stat().st_mtime_ns for path in before} == before
    assert json.loads((farm.out / "manifest_report.json").read_text())["objects"][0]["objects"] == [
        *("Part 0", "Part 1", "Part 2", "Floor")
    ]


def test_tiles_are_items(farm: Farm) -> None:
    uv = [(0.1, 0.1), (0.9, 0.1), (0.9, 0.9), (0.1, 0.9), (1.1, 0.1), (1.9, 0.1), (1.9, 0.9), (1.1, 0.9)]
    corners = [(x, y, 0) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1), (2, 0), (3, 0), (3, 1), (2, 1))]
    blender.mesh("Tiled", corners, [(0, 1, 2, 3), (4, 5, 6, 7)], uv)
    blender.wall("Wall", x=0.5)
    farm.plan("--objects", "Tiled")
    assert [item["tile"] for item in farm.read()["items"]] == [1001, 1002]
    farm.bake("--items", "1")
    assert set(images(farm.out)) == {"Tiled_ao.1002.png"}
    farm.bake("--items", "0")
    assert images(farm.out) == farm.whole("--objects", "Tiled") and farm.merge()[0] == 0


def test_high_meshes_ground_and_charts(farm: Farm) -> None:
    blender.bare_cube("Crate_low")
    blender.cube("Crate_high", size=2.05)
    blender.bare_cube("Post_low", location=(4, 0, 0))
    blender.cube("Post_high", size=2.05, location=(4, 0, 0))
    words = ("--objects", "Crate_low", "Post_low", "--pairs", "--ground")
    farm.plan(*words)
    assert farm.read()["settings"]["ground"] is True and farm.read()["items"][0]["charts"]["count"] > 0
    for items in ("1", "0"):
        assert farm.bake("--items", items)[0] == 0
    assert images(farm.out) == farm.whole(*words)


# What cannot be baked


def test_what_cannot_be_baked_is_refused_when_it_is_planned(farm: Farm) -> None:
    props(1)
    flat = blender.plane("Flat")
    flat.scale = (0, 0, 0)
    nowhere = blender.plane("Nowhere", uv=[(5, 5)] * 4)
    status, _, err = farm.plan("--objects", "Prop 0", "Flat", nowhere.name, "--uv", "UVMap")
    assert status == 0 and "Flat" in err
    assert [item["name"] for item in farm.read()["items"]] == ["Prop 0"]
    assert len(farm.read()["refused"]) == 2
    farm.bake()
    status, _, err = farm.merge()
    assert status == 4 and "2 cannot be baked; Flat" in err
    assert len(json.loads((farm.out / "manifest_report.json").read_text())["refused"]) == 2
    only = farm.plan("--objects", "Flat")
    assert only[0] == 2 and "Flat" in only[2]


def test_an_item_that_is_refused_is_no_fault_of_the_task(farm: Farm) -> None:
    """A low mesh that sees no high one: that is known when its rays are traced."""
    blender.cube("A_low")
    blender.cube("A_high", location=(50, 0, 0))
    blender.cube("B_low", location=(9, 0, 0))
    blender.cube("B_high", location=(9, 0, 0), size=2.05)
    farm.plan("--objects", "A_low", "B_low", "--pairs")
    status, _, err = farm.bake()
    assert status == 0 and "none of its texels sees a high mesh" in err
    status, out, err = farm.merge()
    assert status == 4 and "1 of 2 items are baked" in out and "1 cannot be baked; A_low" in err
    assert set(images(farm.out)) == {"B_low_ao.png"}


@pytest.mark.parametrize(
    "words", [("--color-attributes", "a.blend"), ("--coverage", "a.png"), ("--compare-cycles",), ("--into", "a.png:R")]
)
def test_what_no_plan_has(farm: Farm, words: tuple[str, ...]) -> None:
    props(1)
    status, _, err = farm.plan(*words)
    assert status == 2 and words[0] in err and not farm.out.exists()


# What is not as it was planned


def changed(farm: Farm, change: Callable[[Any], Any]) -> None:
    content = farm.read()
    change(content)
    farm.manifest.write_text(json.dumps(content))


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda content: content.update(version="9.9"), "planned by Occlusion Bake 9.9"),
        (lambda content: content.update(algorithm=0), "algorithm 0"),
        (lambda content: content.update(format=7), "plan again"),
        (lambda content: content.pop("options"), "plan again"),
        (lambda content: content.pop("items"), "no manifest"),
        (lambda content: content["items"][0].pop("inputs"), "plan again"),
        (lambda content: content["items"][0].update(more=1), "plan again"),
        (lambda content: content["items"][0].update(inputs="0" * 64), "not as it was planned"),
        (lambda content: content["items"][0].update(target=99), "plan again"),
    ],
)
def test_another_manifest_is_refused(farm: Farm, change: Callable[[Any], Any], says: str) -> None:
    props(1)
    farm.plan()
    changed(farm, change)
    status, _, err = farm.bake()
    assert status == 2 and says in err and err.count("\n") == 1 and str(farm.out) in err
    assert not images(farm.out)


@pytest.mark.parametrize("text", ["", "{", "[]", "null", "no JSON", '{"items": []}'])
def test_what_is_no_manifest(farm: Farm, text: str) -> None:
    props(1)
    farm.plan()
    farm.manifest.write_text(text)
    for run in (farm.bake(), farm.merge()):
        assert run[0] == 2 and str(farm.manifest) in run[2] and run[2].count("\n") == 1
    missing = farm("--manifest", farm.home / "none.json")
    assert missing[0] == 2 and "none.json: No such file" in missing[2] and "plan" in missing[2]


def test_a_scene_that_changed_is_planned_again(farm: Farm) -> None:
    props(2)
    farm.plan()
    farm.bake("--items", "0")
    good = images(farm.out)
    bpy.data.objects["Prop 0"].location.z += 1.0
    farm.save()
    status, _, err = farm.bake()
    assert status == 2 and "scene.blend: it was changed after it was planned; plan again" in err
    assert images(farm.out) == good
    farm.scene.unlink()  # as on a machine that never had it
    assert farm.bake()[0] == 0
    (farm.out / "manifest.blend").write_bytes(b"other")
    status, _, err = farm.bake("--no-resume")
    assert status == 2 and "manifest.blend: it was changed" in err


def test_an_item_out_of_range(farm: Farm) -> None:
    props(2)
    farm.plan()
    status, _, err = farm.bake("--items", "1-2")
    assert status == 2 and "2 items, 0 to 1" in err and not images(farm.out)
    assert "goes down" in farm.bake("--items", "1-0")[2]


def test_a_folder_of_two_manifests(farm: Farm) -> None:
    props(1)
    farm.plan()
    farm.bake()
    good = images(farm.out)
    status, _, err = farm.plan("--manifest", farm.home / "other.json", "--seed", "1")
    assert status == 2 and "another manifest" in err and str(farm.manifest) in err
    assert not (farm.home / "other.json").exists() and images(farm.out) == good
    assert farm.plan("--seed", "1")[0] == 0  # the same one, planned again
    # one that was planned elsewhere and brought here
    shutil.copytree(farm.out, farm.home / "copy")
    content = farm.read() | {"id": "other", "folder": str(farm.out)}
    (farm.home / "copy" / "manifest.json").write_text(json.dumps(content))
    status, _, err = farm("--manifest", farm.home / "copy" / "manifest.json")
    assert status == 2 and "another manifest" in err and images(farm.out) == good


def test_a_folder_that_was_moved(farm: Farm) -> None:
    """As it is mounted elsewhere on another machine."""
    props(2)
    farm.plan()
    farm.bake("--items", "0")
    farm.scene.unlink()
    there = farm.home / "elsewhere"
    farm.out.rename(there)
    assert farm("--manifest", there / "manifest.json")[0] == 0
    assert farm("merge", there / "manifest.json")[0] == 0
    assert set(images(there)) == {"Prop 0_ao.png", "Prop 1_ao.png"}


def test_a_manifest_takes_no_other_files_place(farm: Farm) -> None:
    props(1)
    notes = farm.home / "notes.json"
    notes.write_text('{"mine": 1}')
    status, _, err = farm.plan("--manifest", notes)
    assert status == 2 and "no plan's" in err and json.loads(notes.read_text()) == {"mine": 1}
    status, _, err = farm.plan("--manifest", farm.home / "plan.txt")
    assert status == 2 and "end its name in .json" in err
    (farm.home / "a.json").mkdir()
    status, _, err = farm.plan("--manifest", farm.home / "a.json")
    assert status == 2 and "a folder of that name" in err
    (farm.home / "utf16.json").write_bytes("{}".encode("utf-16"))
    status, _, err = farm.plan("--manifest", farm.home / "utf16.json")
    assert status == 2 and "no plan's" in err


@pytest.mark.parametrize("words", [("--manifest", "//scene.json"), ("--report", "//out/manifest.json")])
def test_a_plan_does_not_write_over_the_scene_or_itself(farm: Farm, words: tuple[str, str]) -> None:
    props(1)
    farm.save()
    before = farm.scene.read_bytes()
    status, _, err = farm("plan", farm.scene, *SMALL, "--output", farm.out, *words)
    assert status == 2 and words[0] in err and err.count("\n") == 1
    assert farm.scene.read_bytes() == before and not farm.manifest.exists()


def test_a_plan_does_not_write_over_a_report_or_a_scene_of_others(farm: Farm) -> None:
    props(1)
    farm.out.mkdir()
    for name in ("manifest.blend", "manifest_report.json"):
        other = farm.out / name
        other.write_text("mine")
        status, _, err = farm.plan()
        assert status == 2 and str(other) in err and other.read_text() == "mine"
        other.unlink()


def test_a_plan_that_comes_to_nothing_leaves_the_one_before(farm: Farm, monkeypatch: pytest.MonkeyPatch) -> None:
    from occlusion_bake.addon.cli import plan
    from occlusion_bake.core.base.errors import InputError

    props(2)
    farm.plan()
    farm.bake("--items", "0")

    def full(*_: Any) -> None:
        raise InputError("manifest.blend: no space left")

    monkeypatch.setattr(plan, "save_copy", full)
    bpy.data.objects["Prop 0"].location.z += 0.5
    assert farm.plan("--output", farm.out)[0] == 2
    farm.scene.unlink()
    assert farm.bake()[0] == 0 and farm.merge()[0] == 0


def test_a_vertex_of_an_occluder_that_is_not_finite(farm: Farm) -> None:
    props(2)
    broken = blender.cube("Broken", location=(0, 3, 0))
    broken.data.vertices[0].co.x = math.nan
    farm.plan("--objects", "Prop 0", "Prop 1")
    assert farm.bake()[0] == 0
    assert images(farm.out) == farm.whole("--objects", "Prop 0", "Prop 1")
    farm.merge()
    report = json.loads((farm.out / "manifest_report.json").read_text())
    assert sum("non-finite" in line for entry in report["objects"] for line in entry["warnings"]) == 1


# In other hands


def test_in_blenders_own_command(farm: Farm) -> None:
    props(2)
    farm.save()
    farm.capfd.readouterr()
    assert blender_command(["plan", *SMALL, "--output", str(farm.out)]) == 0
    assert blender_command(["--manifest", str(farm.manifest), "--items", "0"]) == 0
    assert blender_command(["--manifest", str(farm.manifest), "--items", "1"]) == 0
    assert blender_command(["merge", str(farm.manifest)]) == 0
    assert images(farm.out) == farm.whole()


def test_lines_for_engines(farm: Farm) -> None:
    """Of an item that takes long enough to be looked at, many times over."""
    props(1)
    farm.plan("--size", "256", "--rays", "1024")
    _, out, _ = farm.bake("--progress", "openjd")
    percents = [float(line.split()[1]) for line in out.splitlines() if line.startswith("openjd_progress: ")]
    assert percents == sorted(percents) and percents[-1] == 100.0
    assert any(line.startswith("openjd_status: Prop 0: ") for line in out.splitlines())
    _, out, _ = farm.bake("--progress", "flamenco", "--no-resume")
    assert f"Saved: '{farm.out / 'Prop 0_ao.png'}'" in out.splitlines()


@pytest.mark.skipif(os.name != "posix", reason="sends signals")
def test_a_task_that_is_ended_leaves_whole_files(farm: Farm, start: Any) -> None:
    """SIGTERM in the middle: status 3; what is done stays, and the rest is baked by whoever comes next."""
    for number in range(6):
        blender.cube(f"Prop {number}", location=(2.5 * number, 0.0, 0.0))
    farm.save()
    farm("plan", farm.scene, "--size", "256", "--rays", "512", "--output", farm.out)
    child = start("--manifest", str(farm.manifest))
    deadline = time.monotonic() + 60.0
    while not images(farm.out) and time.monotonic() < deadline and child.poll() is None:
        time.sleep(0.02)
    child.send_signal(signal.SIGTERM)
    _, err = child.communicate(timeout=60)
    assert child.returncode == 3 and err == "occlusion_bake: cancelled\n"
    done = images(farm.out)
    assert 0 < len(done) < 6
    for name in done:
        values, told = read_image(farm.out / name)
        assert math.isfinite(float(values.sum())) and told["inputs"]
    assert not list(farm.out.glob(".*.png"))
    status, out, _ = farm.bake()
    assert status == 0 and f"{len(done)} items have not changed" in out
    assert images(farm.out).items() >= done.items()
    assert farm.merge()[0] == 0


def test_items_need_no_blender(farm: Farm, start: Any) -> None:
    """Neither its module nor the seconds that it takes to load."""
    props(1)
    farm.plan()
    (farm.home / "bpy.py").write_text("raise SystemExit('Blender was loaded')")
    child = start("--manifest", str(farm.manifest))
    assert child.communicate(timeout=60)[1] == "" and child.returncode == 0
