"""One bake of ours as the button does it, for measurements."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

import bpy

from ..addon.job.bake_job import BakeJob, bake_steps
from ..addon.job.outcome import Outcome
from ..addon.job.runner import run
from ..addon.output.result import Result
from ..core.finish.baked import Baked
from ..core.finish.map_files import Folder
from ..core.options.values import told_by_images
from ..core.progress import Progress
from ..core.scene.scene import Instance
from ..core.settings import Settings


def bake_here(
    names: Sequence[str], settings: Settings, output: Path | None = None
) -> tuple[float, list[tuple[Instance, Baked]], str]:
    """Bake objects of the open file. Returns seconds from the button to the textures, the results, and the Embree.

    output: a folder for PNG files of 16 bits; None writes nothing.
    """
    results: list[tuple[Instance, Baked]] = []
    folder = Folder(output) if output else None

    def deliver(result: Result) -> None:
        if folder:
            folder.write(result.baked, told_by_images(settings), folder.stem(result.name))
        results.append((result.target, result.baked))

    start = time.perf_counter()
    progress, outcome = Progress(len(names)), Outcome()
    run(bake_steps(bpy.context, BakeJob(tuple(names), settings), progress, outcome, deliver), progress)
    seconds = time.perf_counter() - start
    assert outcome.baker is not None
    return seconds, results, outcome.baker.device.description
