"""What takes how long in a bake of several objects: what they share, and what is one object's own."""

from __future__ import annotations

from ...core.base.timing import Stopwatch

CYCLES = "cycles"  # the stage of a comparison: its time is not the bake's
REST = "rest"  # what belongs to no stage of its own


class JobClock(Stopwatch):
    """A stopwatch whose stages may be handed over to the object that they were spent on."""

    def __init__(self) -> None:
        super().__init__()
        self._handed_over: set[str] = set()

    def hand_over(self, stage: str) -> float:
        """The seconds of a stage, which are one object's from now on."""
        self._handed_over.add(stage)
        return self.seconds.get(stage, 0.0)

    @property
    def shared(self) -> dict[str, float]:
        """What the objects share, by stage, and `total`: all but Cycles' part of comparisons."""
        took = {stage: seconds for stage, seconds in self.seconds.items() if stage != CYCLES}
        shared = {stage: took[stage] for stage in took if stage != REST and stage not in self._handed_over}
        return {**shared, "total": sum(took.values())}
