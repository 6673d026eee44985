"""The comparison with Cycles as steps: here, or in a child Blender beside the window, which goes on living."""

from __future__ import annotations

import json
import subprocess
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy

from ...core.base.errors import InputError
from ...core.charts.udim import Udim
from ...core.finish.report import object_entry
from ...core.maps.occlusion import AMBIENT
from ...core.options.values import values_of
from ...core.progress import Progress
from ...core.settings import Settings
from ..charts.chart_job import layer_of
from ..job.bake_job import BakeJob, Layout, bake_steps
from ..job.outcome import Outcome
from ..job.runner import Steps
from ..output.result import Result
from ..read.block_ref import find
from ..read.roles import roles_to_json
from ..typed import view_layer_in
from .comparison import Compared, compare_with_cycles

Finish = Callable[[bpy.types.Context, dict[str, Any]], None]


def compare_here(context: bpy.types.Context, job: BakeJob, samples: int, progress: Progress, finish: Finish) -> Steps:
    """In this process; Cycles' part holds the main thread. `finish` gets the report's entry."""
    alone = to_compare(job)
    with tempfile.TemporaryDirectory(prefix="occlusion-bake-") as folder:

        def deliver(result: Result) -> None:
            entry = object_entry(result.baked, {})
            obj = find(view_layer_in(context).objects, result.objects[0])
            if obj is None:
                raise InputError(f"{result.name}: removed during the bake; compare another")
            compared = Compared(obj, result.target, result.baked, alone.settings, job.occluding, layer_of(job.uv))
            cycles = compare_with_cycles(context, compared, samples, Path(folder, "compared.png"))
            finish(context, {**entry, "cycles": cycles})

        yield from bake_steps(context, alone, progress, Outcome(), deliver)


def compare_in_child(
    context: bpy.types.Context, job: BakeJob, samples: int, progress: Progress, finish: Finish
) -> Steps:
    """A copy of the file goes to a Blender without a window, which runs the command; this one only waits."""
    job = to_compare(job)
    with tempfile.TemporaryDirectory(prefix="occlusion-bake-") as folder:
        copy, values, report = (Path(folder, name) for name in ("scene.blend", "values.json", "report.json"))
        progress.enter(f"{job.objects[0].label}: comparing")
        bpy.ops.wm.save_as_mainfile(filepath=str(copy), copy=True, check_existing=False)
        handed_on = child_values(job, samples, Path(folder), report)
        values.write_text(json.dumps(handed_on), encoding="utf-8")
        extension = __package__.rsplit(".", 2)[0]
        command = [bpy.app.binary_path, "-b", str(copy), "--addons", extension]
        command += ["-c", "occlusion_bake", "--values", str(values)]
        yield lambda: _wait_for(command, Path(folder, "log"), progress)
        finish(context, json.loads(report.read_text(encoding="utf-8"))["objects"][0])


def ao_alone(settings: Settings) -> Settings:
    """What is compared of a bake: its AO, without margins."""
    return replace(settings, maps=(AMBIENT,), image=replace(settings.image, margin=0))


def to_compare(job: BakeJob) -> BakeJob:
    """The first object alone in an image. Raises InputError for one that is baked from others."""
    first = job.objects[0]
    if first in job.highs:
        raise InputError(
            f"{first.label}: a comparison is of an object's own surface; set High to Low > From to Own Surface"
        )
    return replace(job, objects=(first,), settings=ao_alone(job.settings), layout=Layout(udim=Udim.STACKED))


def child_values(job: BakeJob, samples: int, folder: Path, report: Path) -> dict[str, Any]:
    """The command's options, as JSON has them, for a job as `to_compare` gives it, and a comparison."""
    return {
        **values_of(job.settings),
        "roles": roles_to_json(job.objects, job.highs, job.occluding),
        "udim": Udim.STACKED.value,
        "uv": job.uv,
        "folder": str(folder),
        "report": str(report),
        "cycles_samples": samples,
    }


def _wait_for(command: list[str], log: Path, progress: Progress) -> None:
    """Run the child to its end. Raises Cancelled, after stopping it, and InputError with its last line if it fails."""
    with log.open("w+", encoding="utf-8", errors="replace") as output:
        hidden = getattr(subprocess, "CREATE_NO_WINDOW", 0)
        child = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT, creationflags=hidden
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
