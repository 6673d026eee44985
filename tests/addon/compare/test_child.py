"""What the comparison's own Blender is told, where names alone would say something else."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.addon.cli.command import blender_command  # noqa: E402
from occlusion_bake.addon.compare.steps import REPORT, child_values, compare_here  # noqa: E402
from occlusion_bake.addon.job.bake_job import BakeJob  # noqa: E402
from occlusion_bake.addon.job.runner import run  # noqa: E402
from occlusion_bake.addon.read.block_ref import refs_of  # noqa: E402
from occlusion_bake.addon.read.occluder_filter import OccluderFilter  # noqa: E402
from occlusion_bake.core.progress import Progress  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402
from occlusion_bake.tests.oracles.settings import flat_settings  # noqa: E402

pytestmark = pytest.mark.usefixtures("empty_scene")


def linked(name: str, folder: Path) -> Any:
    """The object of this name out of a file, linked into the open one."""
    with bpy.data.libraries.load(str(folder / "library.blend"), link=True) as (_, wanted):
        wanted.objects = [name]
    bpy.context.scene.collection.objects.link(wanted.objects[0])
    bpy.context.view_layer.update()
    return wanted.objects[0]


def in_child(job: BakeJob, folder: Path) -> Any:
    """The entry of the command that a child Blender would run, in this process on a copy of the file."""
    copy, values, report = (folder / name for name in ("copy.blend", "values.json", REPORT))
    values.write_text(json.dumps(child_values(job, 1, folder)), encoding="utf-8")
    bpy.ops.wm.save_as_mainfile(filepath=str(copy), copy=True)
    bpy.ops.wm.open_mainfile(filepath=str(copy))
    assert blender_command(["--values", str(values)]) == 0
    (entry,) = json.loads(report.read_text(encoding="utf-8"))["objects"]
    return entry


@pytest.mark.parametrize("name", ["-Rock", "--report=x.json", "scene", "self", "Room"])
def test_it_bakes_the_same_object_under_the_same_occluders(tmp_path: Path, name: str) -> None:
    """A floor under a linked roof of the same name, among what else has it, or changes what words mean."""
    blender.plane(name, location=(0.3, 0.0, 0.5))
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"))
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    floor = blender.plane(name)
    room = bpy.data.collections.new(name)
    room.objects.link(blender.plane("Lid", location=(0.0, 0.0, 0.01)))
    bpy.context.scene.collection.children.link(room)
    roof = linked(name, tmp_path)
    occluding = OccluderFilter(frozenset({roof.session_uid}))
    settings = flat_settings(width=16, height=16, rays=64, threads=2)
    job = BakeJob(tuple(refs_of([floor])), settings, None, occluding)
    entries: list[Any] = []
    progress = Progress()
    run(compare_here(bpy.context, job, 1, progress, lambda _, report: entries.extend(report["objects"])), progress)
    child = in_child(job, tmp_path)
    assert 0.2 < child["mean"]["ao"] < 0.8  # 0 under the lid, 1 in the open, and about 0.5 under the roof
    assert (child["mean"], child["name"]) == (entries[0]["mean"], name)
    assert [child["cycles"][part] for part in ("rmse", "bias")] == [
        entries[0]["cycles"][part] for part in ("rmse", "bias")
    ]
