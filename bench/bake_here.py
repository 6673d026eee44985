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
from ..addon.read.high_low_pairs import Pairing, paired_with
from ..addon.read.occluder_filter import OccluderFilter
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


def bake_here(
    names: Sequence[str], settings: Settings, *, highs: Sequence[str] = (), with_files: bool = False
) -> OwnBake:
    """Bake objects of the open file. highs: the meshes that the one object is baked from, where there are any.
    with_files: PNG of 16 bits are written too, and thrown away."""
    results: list[tuple[Instance, Baked]] = []
    progress, outcome = Progress(len(names)), Outcome()
    with TemporaryDirectory() as place:
        folder = Folder(Path(place))

        def deliver(result: Result) -> None:
            if with_files:
                folder.write(result.baked, told_by_images(settings), clean_name(result.name))
            results.append((result.target, result.baked))

        start = time.perf_counter()
        chosen = pairing_of(names, highs)
        occluding = OccluderFilter(excluded=chosen.excluded)
        job = BakeJob(chosen.targets, settings, occluding=occluding, highs=chosen.highs)
        run(bake_steps(bpy.context, job, progress, outcome, deliver), progress)
        seconds = time.perf_counter() - start
    assert outcome.baker is not None
    return OwnBake(seconds, results, outcome.baker.device.description)


def pairing_of(names: Sequence[str], highs: Sequence[str]) -> Pairing:
    """Who is baked, and from what, as *Selected to Active* has it: the low mesh blocks no light then."""
    targets = tuple(refs_of(bpy.data.objects[name] for name in names))
    if not highs:
        return Pairing(targets)
    (low,) = targets
    return paired_with(low, refs_of(bpy.data.objects[name] for name in highs), None, None)
