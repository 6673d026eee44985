"""What became of a bake, filled while the work goes on."""

from __future__ import annotations

from dataclasses import dataclass, field

from ...core.bake import Baker
from ...core.base.errors import InputError
from ..charts.chart_job import ChartJob
from ..read.block_ref import BlockRef
from .job_clock import JobClock

WAITING, BAKING, DONE, REFUSED = "waiting", "baking", "done", "refused"


@dataclass
class Outcome:
    """refused: a line for each object that could not be baked. notes: lines on charts made, and on what Cycles would
    trace. states: by object, in the order that they are baked. clock: the whole job's. complete: whether it went on to
    its end. left: those of the finished that have not changed, and were not baked again."""

    baker: Baker | None = None
    finished: list[BlockRef] = field(default_factory=list)
    refused: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    charting: ChartJob = field(default_factory=ChartJob)
    states: dict[BlockRef, str] = field(default_factory=dict)
    left: list[BlockRef] = field(default_factory=list)
    clock: JobClock = field(default_factory=JobClock)
    complete: bool = False

    @property
    def occluders(self) -> list[str]:
        """What the objects are called that block light, the targets among them where they do."""
        return sorted({each.belongs_to for each in self.baker.scene.occluders}) if self.baker is not None else []

    def refuse(self, ref: BlockRef, why: InputError) -> None:
        """An object cannot be baked; objects that share a reason share its line."""
        if str(why) not in self.refused:
            self.refused.append(str(why))
        self.states[ref] = REFUSED

    def finish(self, ref: BlockRef) -> None:
        """An object is baked and delivered."""
        self.finished.append(ref)
        self.states[ref] = DONE

    def leave(self, ref: BlockRef) -> None:
        """An object has what it would be baked to."""
        self.left.append(ref)
        self.finish(ref)

    def complaint(self, objects: int) -> str:
        """The line to end with where some of so many objects were refused."""
        if objects == 1:
            return self.refused[0]
        missing = objects - len(self.finished)
        return f"{missing} of {objects} objects could not be baked; {self.refused[0]}"
