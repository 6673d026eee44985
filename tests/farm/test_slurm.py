"""The scripts for Slurm, against stubs of its commands and of Blender; `make farm` runs them on a Slurm."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

HOME = Path(__file__).resolve().parents[2] / "farm" / "slurm"
pytestmark = pytest.mark.skipif(os.name != "posix", reason="Slurm's machines have bash")

Called = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture
def call(tmp_path: Path) -> Called:
    """Runs a script beside commands that tell how they were called. bakes: what Blender does then, in sh."""

    def called(script: str, *words: str, bakes: str = "true", **variables: str) -> subprocess.CompletedProcess[str]:
        programs = tmp_path / "programs"
        programs.mkdir(exist_ok=True)
        told = 'echo "$(basename "$0")$(printf " <%s>" "$@")"'
        for name, then in {"sbatch": "echo '7;cluster'", "scontrol": "true", "blender": bakes}.items():
            out = ">&2" if name == "sbatch" else ""
            (programs / name).write_text(f"#!/bin/sh\n{told} {out}\n{then}\n")
            (programs / name).chmod(0o755)
        inherited = {name: value for name, value in os.environ.items() if name != "BLENDER" and name[:5] != "SLURM"}
        environment = {**inherited, "PATH": f"{programs}:{os.environ['PATH']}", **variables}
        return subprocess.run([str(HOME / script), *words], env=environment, capture_output=True, text=True)

    return called


def task(call: Called, bakes: str, **variables: str) -> subprocess.CompletedProcess[str]:
    own = {"SLURM_ARRAY_JOB_ID": "7", "SLURM_ARRAY_TASK_ID": "3", "SLURMD_NODENAME": "node1"}
    return call("bake.sh", "/my level/m.json", "20", bakes=bakes, **own, **variables)


def test_the_merge_is_submitted_behind_the_array(call: Called, tmp_path: Path) -> None:
    manifest = tmp_path / "my level.json"
    manifest.touch()
    ran = call("submit.sh", str(manifest), "20", "--partition=day", "--dependency=afterok:3")
    bake, merge = ran.stderr.splitlines()
    assert "<--partition=day> <--dependency=afterok:3> <--parsable> <--array=1-20>" in bake and bake.endswith(
        f"bake.sh> <{manifest}> <20>"
    )
    assert (
        "<--partition=day> <--dependency=afterok:3> <--parsable> <--dependency=afterany:7>" in merge
        and merge.endswith(f"merge.sh> <{manifest}>")
    )
    assert ran.returncode == 0 and ran.stdout == "bake: job 7, 20 tasks\nmerge: job 7\n"


@pytest.mark.parametrize("words", [(), ("manifest.json",), ("no such manifest.json", "20")])
def test_nothing_is_submitted_of_nothing(call: Called, words: tuple[str, ...]) -> None:
    ran = call("submit.sh", *words)
    assert ran.returncode != 0 and ran.stderr and "sbatch <" not in ran.stderr


def test_a_task_bakes_its_share(call: Called) -> None:
    ran = task(call, "exit 4")
    words = [
        "--background",
        "--command",
        "occlusion_bake",
        "--manifest",
        "/my level/m.json",
        "--items",
        "3/20",
        "--threads",
        "0",
    ]
    wanted = " ".join(["blender", *(f"<{word}>" for word in words)])
    assert ran.stdout.splitlines() == ["share 3 of 20 on node1, restarts: 0", wanted]
    assert ran.returncode == 4


@pytest.mark.parametrize(("restarts", "again"), [("0", True), ("2", True), ("3", False)])
def test_a_task_that_was_killed_is_run_again_but_not_for_ever(call: Called, restarts: str, again: bool) -> None:
    ran = task(call, "kill -9 $$", SLURM_RESTART_COUNT=restarts)
    assert ran.returncode == 137 and ("scontrol <requeue> <7_3>" in ran.stdout) == again


@pytest.mark.parametrize("bakes", ["kill -TERM $$", "exit 255", "exit 3", "exit 1"])
def test_nothing_else_is_run_again(call: Called, bakes: str) -> None:
    """A task that was cancelled as it began least of all."""
    ran = task(call, bakes)
    assert ran.returncode and "requeue" not in ran.stdout


def test_a_task_takes_the_processors_that_it_was_given(call: Called) -> None:
    assert "<--threads> <8>" in task(call, "true", SLURM_CPUS_PER_TASK="8").stdout


def test_a_task_that_is_told_to_end_ends_after_its_bake(call: Called) -> None:
    """With the bake's own status; the shell around it, which is told too, waits for it."""
    ran = task(call, "trap 'sleep 0.3; exit 3' TERM; kill -TERM $PPID $$; sleep 5")
    assert ran.returncode == 3 and "requeue" not in ran.stdout


def test_the_merge_has_its_own_status(call: Called) -> None:
    ran = call("merge.sh", "m.json", bakes="exit 4")
    assert ran.returncode == 4
    assert ran.stdout == "blender <--background> <--command> <occlusion_bake> <merge> <m.json>\n"
