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

from ...core.bake import Settings
from ...core.base.errors import InputError
from ...core.finish.report import object_entry
from ...core.progress import Progress
from ...core.rays.map_spec import AO
from ..charts.chart_job import layer_of
from ..job.bake_job import Options, Outcome, Result, bake_steps
from ..job.runner import Steps
from ..read.occluder_filter import words_of
from .comparison import compare_with_cycles

Finish = Callable[[bpy.types.Context, dict[str, Any]], None]


def compare_here(
    context: bpy.types.Context, options: Options, samples: int, progress: Progress, finish: Finish
) -> Steps:
    """In this process; Cycles' part holds the main thread. `finish` gets the report's entry."""
    alone = to_compare(options)
    with tempfile.TemporaryDirectory(prefix="occlusion-bake-") as folder:

        def deliver(result: Result) -> None:
            entry = object_entry(result.baked, {})
            picture = Path(folder, "compared.png")
            cycles = compare_with_cycles(
                *(context, result.target, result.baked, alone.settings, samples, layer_of(options.uv), picture),
                options.occluding,
            )
            finish(context, {**entry, "cycles": cycles})

        yield from bake_steps(context, alone, progress, Outcome(), deliver)


def compare_in_child(
    context: bpy.types.Context, options: Options, samples: int, progress: Progress, finish: Finish
) -> Steps:
    """A copy of the file goes to a Blender without a window, which runs the command; this one only waits."""
    options = to_compare(options)
    with tempfile.TemporaryDirectory(prefix="occlusion-bake-") as folder:
        copy, report = Path(folder, "scene.blend"), Path(folder, "report.json")
        progress.enter(f"{options.objects[0]}: comparing")
        bpy.ops.wm.save_as_mainfile(filepath=str(copy), copy=True, check_existing=False)
        words = child_arguments(options, samples, Path(folder), report)
        extension = __package__.rsplit(".", 2)[0]
        command = [bpy.app.binary_path, "-b", str(copy), "--addons", extension, "-c", "occlusion_bake", *words]
        yield lambda: _wait_for(command, Path(folder, "log"), progress)
        finish(context, json.loads(report.read_text(encoding="utf-8"))["objects"][0])


def ao_alone(settings: Settings) -> Settings:
    """What is compared of a bake: its AO, without margins."""
    return replace(
        settings, estimators=(AO,), margin=0, divide_horizon=False, bent=None, coding=None, lights=Settings.lights
    )


def to_compare(options: Options) -> Options:
    """The first object alone in an image. Raises InputError for one that is baked from others."""
    first = options.objects[0]
    if first in options.highs:
        raise InputError(f"{first}: a comparison is of an object's own surface; set High to Low > From to Own Surface")
    settings = ao_alone(options.settings)
    return replace(options, objects=(first,), settings=settings, atlas="", tiled=False, colours=False)


def child_arguments(options: Options, samples: int, folder: Path, report: Path) -> list[str]:
    """The command's arguments for `ao_alone` of the first object, and a comparison."""
    chosen = options.settings
    words = [f"--objects={options.objects[0]}", "--size", f"{chosen.width}x{chosen.height}"]
    words += ["--rays", str(chosen.rays)] if chosen.error is None else ["--error", repr(chosen.error)]
    words += ["--filter" if chosen.goal.filtered else "--no-filter"]
    words += ["--margin", "0", "--threads", str(chosen.threads), "--seed", str(chosen.seed)]
    words += ["--output", str(folder), "--report", str(report), "--compare-cycles", str(samples)]
    words += ["--distance", repr(chosen.distance)] if chosen.distance is not None else []
    words += ["--falloff", chosen.falloff.name.lower(), "--min-distance", repr(chosen.nearest)]
    words += ["--spread", repr(chosen.spread)] + ["--front-faces"] * chosen.front_only
    words += ["--normal-maps"] * chosen.normal_maps
    words += ["--occluders", *_occluders(options)] + ["--ground"] * options.occluding.ground + ["--no-udim"]
    return words + ([f"--uv={options.uv}"] if options.uv is not None else [])


def _occluders(options: Options) -> list[str]:
    """As the command takes them; less those that stand for others."""
    occluding = options.occluding
    if occluding.names is not None or occluding.alone or not occluding.less:
        return words_of(occluding)
    return [obj.name for obj in bpy.context.view_layer.objects if occluding.counts(obj.name)]


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
