"""The comparison with Cycles as steps: here, or in a child Blender beside the window, which goes on living."""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
import time
from collections.abc import Callable, Generator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy

from ...core.base.errors import InputError
from ...core.finish.report import Json, comparison_total, first_of, object_entry
from ...core.maps.occlusion import AMBIENT
from ...core.options.values import values_of
from ...core.progress import Progress
from ...core.settings import Settings
from ..charts.rollback import chart_rollback
from ..job.bake_job import BakeJob, bake_steps
from ..job.outcome import Outcome
from ..job.runner import Steps
from ..output.result import Result
from ..read.roles import roles_to_json
from .comparison import Compared, compare_with_cycles, without_a_bake

REPORT = "report.json"
_TEMPORARY = ("TMPDIR", "TEMP", "TMP")  # where programs are told to put what is temporary
Finish = Callable[[bpy.types.Context, Json], None]


def compare_here(context: bpy.types.Context, job: BakeJob, samples: int, progress: Progress, finish: Finish) -> Steps:
    """In this process; Cycles' part holds the main thread. `finish` gets what `compare_into` returns, and
    a line on maps that Cycles has no bake for."""
    with tempfile.TemporaryDirectory(prefix="occlusion-bake-") as folder:
        report = yield from compare_into(Path(folder), context, job, samples, progress)
        finish(context, _of_all_maps(job, report))


def compare_in_child(
    context: bpy.types.Context, job: BakeJob, samples: int, progress: Progress, finish: Finish
) -> Steps:
    """A copy of the file goes to a Blender without a window, which runs the command; this one only waits."""
    with tempfile.TemporaryDirectory(prefix="occlusion-bake-") as place:
        folder = Path(place)
        copy, values = folder / "scene.blend", folder / "values.json"
        progress.enter(f"{first_of([ref.label for ref in job.objects], 1)}: comparing")
        bpy.ops.wm.save_as_mainfile(filepath=str(copy), copy=True, check_existing=False)
        values.write_text(json.dumps(child_values(job, samples, folder)), encoding="utf-8")
        extension = __package__.rsplit(".", 2)[0]
        command = [bpy.app.binary_path, "-b", str(copy), "--addons", extension]
        command += ["-c", "occlusion_bake", "--values", str(values)]
        yield lambda: _wait_for(command, folder / "log", progress)
        finish(context, _of_all_maps(job, json.loads((folder / REPORT).read_text(encoding="utf-8"))))


def compare_into(
    folder: Path, context: bpy.types.Context, job: BakeJob, samples: int, progress: Progress
) -> Generator[Callable[[], Any], Any, Json]:
    """Bake and compare each object, the pictures into a folder.

    Returns objects: an entry for each image as reports have them, with `cycles`; total: of all, if they are several;
    lines: what is to be told of all. No charts are left behind. Raises as the bake, and InputError where nothing can be
    compared.
    """
    outcome, entries, uncompared = Outcome(), list[Json](), list[str]()
    alone = replace(job, settings=ao_alone(job.settings))

    def deliver(result: Result) -> None:
        compared = Compared.of(result, alone, outcome)
        try:
            cycles = compare_with_cycles(context, compared, samples, folder / f"{len(entries)}.png")
        except InputError as refusal:  # the others go on
            uncompared.append(str(refusal))
        else:
            entries.append({**object_entry(result.baked, {}), "cycles": cycles})

    with chart_rollback(context, outcome.charting.changes, []):
        yield from bake_steps(context, alone, progress, outcome, deliver)
    if not entries:
        raise InputError(uncompared[0])
    lines = [*outcome.notes, *outcome.refused, *uncompared]
    return {"objects": entries, "total": comparison_total(entries) if len(entries) > 1 else {}, "lines": lines}


def child_values(job: BakeJob, samples: int, folder: Path) -> Json:
    """The command's options, as JSON has them, with which it does `compare_into` for this job and leaves what that
    returns in the folder, as REPORT."""
    return {
        **values_of(ao_alone(job.settings)),
        "roles": roles_to_json(job.objects, job.highs, job.occluding),
        "udim": job.layout.udim.value,
        "atlas": job.layout.atlas or None,
        "uv": job.uv,
        "comparison": str(folder),
        "cycles_samples": samples,
        **({"color_attributes": str(folder / "unused.blend")} if job.layout.corners else {}),
    }


def _of_all_maps(job: BakeJob, report: Json) -> Json:
    """With a line on those that Cycles has no bake for."""
    return {**report, "lines": [*without_a_bake(job.settings), *report["lines"]]}


def ao_alone(settings: Settings) -> Settings:
    """What is compared of a bake: its AO, without margins."""
    return replace(settings, maps=(AMBIENT,), image=replace(settings.image, margin=0))


def _wait_for(command: list[str], log: Path, progress: Progress) -> None:
    """Run the child to its end. Raises Cancelled, after stopping it, and InputError with its last line if it fails."""
    with log.open("w+", encoding="utf-8", errors="replace") as output:
        hidden = getattr(subprocess, "CREATE_NO_WINDOW", 0)
        child = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            creationflags=hidden,
            env={**os.environ, **dict.fromkeys(_TEMPORARY, str(log.parent))},  # killed, it leaves there what it made
        )
        start, stage = time.monotonic(), progress.stage
        try:
            while child.poll() is None:
                progress.raise_if_cancelled()
                progress.stage = f"{stage}, {time.monotonic() - start:.0f} s"
                with suppress(subprocess.TimeoutExpired):
                    child.wait(0.05)
        finally:
            if child.poll() is None:
                child.kill()
                child.wait()
        if child.returncode != 0:
            output.seek(0)
            lines = [line.strip() for line in output if line.startswith("occlusion_bake: ")]
            reason = lines[-1].removeprefix("occlusion_bake: ") if lines else f"it ended with status {child.returncode}"
            raise InputError(f"the comparison's own Blender: {reason}")
