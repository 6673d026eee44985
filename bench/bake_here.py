"""One bake of ours as the button does it, for measurements."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import bpy

from ..addon.job.bake_job import BakeJob, bake_steps
from ..addon.job.outcome import Outcome
from ..addon.job.runner import run
from ..addon.output.result import Result
from ..addon.read.block_ref import refs_of
from ..core.finish.baked import Baked
from ..core.finish.file_names import clean_name
from ..core.finish.map_files import Folder
from ..core.options.values import told_by_images
from ..core.progress import Progress
from ..core.scene.scene import Instance
from ..core.settings import Settings


class OwnBake(NamedTuple):
    """seconds: from the button to the textures."""

    seconds: float
    results: list[tuple[Instance, Baked]]
    embree: str

    @property
    def baked(self) -> Baked:
        """The first object's."""
        return self.results[0][1]


def bake_here(names: Sequence[str], settings: Settings, *, with_files: bool = False) -> OwnBake:
    """Bake objects of the open file. with_files: PNG of 16 bits are written too, and thrown away."""
    results: list[tuple[Instance, Baked]] = []
    progress, outcome = Progress(len(names)), Outcome()
    with TemporaryDirectory() as place:
        folder = Folder(Path(place))

        def deliver(result: Result) -> None:
            if with_files:
                folder.write(result.baked, told_by_images(settings), clean_name(result.name))
            results.append((result.target, result.baked))

        start = time.perf_counter()
        job = BakeJob(tuple(refs_of(bpy.data.objects[name] for name in names)), settings)
        run(bake_steps(bpy.context, job, progress, outcome, deliver), progress)
        seconds = time.perf_counter() - start
    assert outcome.baker is not None
    return OwnBake(seconds, results, outcome.baker.device.description)
