"""What was measured of one scene, kept after every point, so that a run can be split and taken up again, in another
checkout, too."""

from __future__ import annotations

import json
import math
import statistics
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from ...core.rays.map_spec import AO
from ..pages import ROOT, write_json
from .cases import Case

KEPT = ROOT / "bench" / "results"  # the measurements
FOLDER = ROOT / "build" / "versus"  # what can be made again: references, trials


@dataclass(frozen=True)
class Run:
    """One bake. rmse: as measured, the reference's noise in it. bias: mean of the differences. p99: the 99th percentile
    of their size. texels: how many were compared. estimated, estimated_p99: what the baker itself says of them."""

    seconds: float
    rmse: float
    bias: float
    p99: float
    texels: int
    estimated: float | None = None
    estimated_p99: float | None = None
    rays: int | None = None  # of all texels, where the baker tells; without those that measured its error
    code: str = ""  # state of our code, as measure.source_hash has it


@dataclass
class Point:
    """One baker at one setting, a run a round."""

    baker: str
    setting: str
    runs: list[Run] = field(default_factory=list)

    @property
    def seconds(self) -> float:
        return statistics.median(run.seconds for run in self.runs)

    @property
    def bias(self) -> float:
        return statistics.fmean(run.bias for run in self.runs)

    @property
    def rmse(self) -> float:
        """Of all runs together, the reference's noise still in it."""
        return math.sqrt(statistics.fmean(run.rmse**2 for run in self.runs))

    @property
    def told(self) -> float | None:
        """The RMSE that the baker itself tells, of all runs together; None where it tells none."""
        told = [run.estimated for run in self.runs if run.estimated is not None]
        return math.sqrt(statistics.fmean(each**2 for each in told)) if told else None

    def corrected(self, noise: float) -> float:
        """The RMSE without the reference's noise."""
        return without_noise(self.rmse, noise)


@dataclass
class Record:
    """A map of a scene at a size. about: what was baked and with what, for the page. noise: of the reference. skipped:
    why, by baker or by baker and setting."""

    scene: str
    size: int
    about: dict[str, Any] = field(default_factory=dict)
    noise: float = 0.0
    skipped: dict[str, str] = field(default_factory=dict)
    points: list[Point] = field(default_factory=list)
    map: str = AO.name

    @property
    def case(self) -> Case:
        """What it is of."""
        return Case(self.scene, self.size, self.map)

    @property
    def name(self) -> str:
        """As files call it."""
        return self.case.name

    @property
    def file(self) -> Path:
        """Where it is kept; `quick` in `about` is so of whatever is only tried."""
        return file_of(self.case, trial=bool(self.about.get("quick")))

    def point(self, baker: str, setting: str) -> Point:
        """The point of a baker at a setting, new where it was not measured yet."""
        for each in self.points:
            if (each.baker, each.setting) == (baker, setting):
                return each
        self.points.append(Point(baker, setting))
        return self.points[-1]

    @property
    def is_ao(self) -> bool:
        return self.map == AO.name

    def can_tell(self, point: Point) -> bool:
        """Whether the reference is good enough for how far off a point is."""
        return point.corrected(self.noise) >= 0.5 * self.noise

    def told_over_made(self, point: Point) -> float | None:
        """What a point of ours tells of its error over what it makes; None where it tells none, or none can be told."""
        if point.told is None or not self.can_tell(point):
            return None
        return point.told / point.corrected(self.noise)

    def of(self, baker: str) -> list[Point]:
        """A baker's points that were measured."""
        return [each for each in self.points if each.baker == baker and each.runs]

    def curve(self, baker: str) -> list[tuple[float, float]]:
        """Their seconds and RMSE without the reference's noise, as they were measured."""
        return [(each.seconds, each.corrected(self.noise)) for each in self.of(baker)]

    def without_other_codes(self, bakers: Sequence[str], code: str) -> None:
        """Take out what these bakers made in another state of our code."""
        for point in self.points:
            if point.baker in bakers:
                point.runs = [run for run in point.runs if run.code == code]

    def codes(self, bakers: Sequence[str]) -> set[str]:
        """The states of our code that these bakers were measured with."""
        return {run.code for baker in bakers for point in self.of(baker) for run in point.runs}

    def keep(self) -> None:
        """Write it, whole."""
        write_json(self.file, {**asdict(self), "points": [asdict(each) for each in self.points if each.runs]})

    def skip(self, what: str, why: str) -> None:
        """Keep, and say, that something is not measured."""
        print(f"SKIPPED {what}: {why}", flush=True)
        self.skipped[what] = why
        self.keep()


def without_noise(rmse: float, noise: float) -> float:
    """An RMSE without the reference's noise, which is independent of the bake's; at least a quarter of it, since below
    that there is nothing to tell."""
    return math.sqrt(max(rmse**2 - noise**2, (0.25 * noise) ** 2))


def file_of(case: Case, *, trial: bool) -> Path:
    """Where the record of a case is kept."""
    return (FOLDER if trial else KEPT) / f"{case.name}.json"


def read(file: Path) -> Record:
    """A record from its file."""
    kept = json.loads(file.read_text(encoding="utf-8"))
    points = [Point(each["baker"], each["setting"], [Run(**run) for run in each["runs"]]) for each in kept["points"]]
    return Record(**{**kept, "points": points})


def records(*, trial: bool) -> list[Record]:
    """All that is there, of trials or of the others, by file name."""
    files = sorted((FOLDER if trial else KEPT).glob("*_*[0-9].json"))
    return [record for record in map(read, files) if record.points]
