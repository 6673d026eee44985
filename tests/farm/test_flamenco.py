"""The job type for Flamenco, run under node as the Manager runs it, and its tasks as workers do."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

JOB_TYPE = Path(__file__).resolve().parents[2] / "farm" / "flamenco" / "occlusion_bake.js"
# What the Manager gives a script: `author` and `path`; and what becomes of a job, printed.
MANAGER = """
const fs = require("fs"), vm = require("vm");
const author = {
    Command: (name, parameters) => ({ name, parameters }),
    Task: (name, type) => ({
        name, type, commands: [], dependencies: [],
        addCommand(command) { this.commands.push(command); },
        addDependency(task) { this.dependencies.push(task.name); },
    }),
};
const tasks = [], job = { settings: JSON.parse(process.argv[2]), addTask: (task) => tasks.push(task) };
const context = vm.createContext({ author, path: require("path").posix, job });
vm.runInContext(fs.readFileSync(process.argv[1], "utf8") + "\\ncompileJob(job); this.type = JOB_TYPE;", context);
console.log(JSON.stringify({ type: context.type, tasks }));
"""
SETTINGS = {"output": "/textures", "options": "--maps ao", "tasks": 3, "blendfile": "/level.blend"}

pytestmark = pytest.mark.skipif(shutil.which("node") is None, reason="node is not there")


def compiled(**settings: Any) -> Any:
    command = ["node", "-e", MANAGER, str(JOB_TYPE), json.dumps({**SETTINGS, **settings})]
    return json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)


def test_its_settings_are_of_flamencos_kinds() -> None:
    for setting in compiled()["type"]["settings"]:
        assert setting["type"] in ("string", "int32", "float", "bool")
        assert setting.get("subtype", "dir_path") in ("file_path", "dir_path", "file_name", "hashed_file_path")
        assert setting.get("visible", "web") in ("visible", "hidden", "submission", "web")
        assert setting["description"]
    keys = [setting["key"] for setting in compiled()["type"]["settings"]]
    assert sorted(keys) == sorted(SETTINGS)


def test_the_merge_waits_for_all_and_all_for_the_plan() -> None:
    tasks = {task["name"]: task for task in compiled()["tasks"]}
    bakes = [name for name in tasks if name.startswith("bake")]
    assert len(bakes) == 3 and list(tasks) == ["plan", *bakes, "merge"]  # none is used before it is there
    assert all(tasks[name]["dependencies"] == ["plan"] for name in bakes)
    assert tasks["merge"]["dependencies"] == bakes and not tasks["plan"]["dependencies"]
    for task in tasks.values():
        (command,) = task["commands"]
        assert task["type"] == "blender" and command["name"] == "exec" and command["parameters"]["exe"] == "{blender}"
    assert len(compiled(tasks=0)["tasks"]) == 3


def test_its_tasks_bake(tmp_path: Path, capfd: Any) -> None:
    bpy: Any = pytest.importorskip("bpy")
    from occlusion_bake.addon.cli.command import blender_command
    from occlusion_bake.tests.oracles import blender

    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    for number in range(4):
        blender.plane(f"Prop {number}", location=(3.0 * number, 0.0, 0.0))
    scene = tmp_path / "level.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(scene))
    options = '--size 16 --rays 4 --objects "Prop 0" "Prop 2" "Prop 3"'
    for task in compiled(output=str(tmp_path / "out"), options=options, blendfile=str(scene))["tasks"]:
        words = task["commands"][0]["parameters"]["args"]
        at = words.index("--command")
        assert words[0] == "--background" and words[1:at] == ([str(scene)] if task["name"] == "plan" else [])
        assert words[at + 1] == "occlusion_bake" and blender_command(words[at + 2 :]) == 0
    assert {path.name for path in (tmp_path / "out").glob("*.png")} == {f"Prop {n}_ao.png" for n in (0, 2, 3)}
    assert sum(line.startswith("Saved: '") for line in capfd.readouterr().out.splitlines()) == 3
