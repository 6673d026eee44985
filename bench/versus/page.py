"""bench/RESULTS.md, from whatever was measured."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from ...core.base.version import version
from ...samples.bench_scenes import EVERY, OWN_SIZES
from ..cycles import DEFAULT_FEWEST, DEFAULT_SAMPLES, DEFAULT_THRESHOLD
from ..pages import apart, filled
from ..tables import table
from . import class_page
from .bakers import CYCLES, CYCLES_DEFAULT, OURS, OURS_ERROR, PEERS
from .class_figures import NONE
from .classes import AIM, BRACKET_SIZE, BRACKETED
from .curves import Ratio, geometric_mean, ratio_at
from .measure import LONG
from .plot import GOALS
from .record import Point, Record
from .script_baker import LIFT, MOST_TRIANGLES

MACHINE = "{machine}; Blender {blender}; Embree {embree} in ours, embreex {embreex}, Open3D {open3d}"
PICTURES = "../docs/pictures/versus"
DEFAULTS = {"samples": DEFAULT_SAMPLES, "threshold": DEFAULT_THRESHOLD, "fewest": DEFAULT_FEWEST}
CONSTANTS = {
    **DEFAULTS,
    "lift": LIFT,
    "millions": MOST_TRIANGLES // 1_000_000,
    "aim": AIM,
    "bracket_size": BRACKET_SIZE,
    "bracketed": ", ".join(f"`{scene}`" for scene in BRACKETED),
}


@dataclass(frozen=True)
class Cell:
    """A ratio and where it stands."""

    record: Record
    ours: str
    peer: str
    goal: str
    ratio: Ratio | None

    @property
    def words(self) -> str:
        """For a list of losses."""
        return f"`{self.record.scene}` at {self.record.size}, RMSE {self.goal}: {self.ours} against {self.peer}"


def lines_of(records: Sequence[Record], sections: Sequence[Sequence[str]], *, trial: bool = False) -> list[str]:
    """The whole page. sections: those that are no scenes. trial: of records that are kept apart, which have no
    pictures."""
    ao = [record for record in records if record.is_ao]
    cells = [cell for record in ao for cell in _cells(record)]
    sizes = sorted({record.size for record in ao if record.scene not in OWN_SIZES})
    return filled(
        __file__,
        version=version(),
        **CONSTANTS,
        about=[*_machines(records), _rounds(records), *(() if trial else _missing(ao))],
        classes=class_page.chapter(ao, trial=trial),
        summaries=apart(_summary(size, [cell for cell in cells if cell.record.size == size]) for size in sizes),
        losses=_losses(cells),
        scenes=apart(_scene(record, [cell for cell in cells if cell.record is record], trial) for record in ao),
        told=[_told(record, point) for record in ao for point in record.of(OURS_ERROR)],
        agreement=[_agreement(record) for record in ao if record.of(CYCLES)],
        reflections=class_page.reflections(records, trial=trial),
        sections=apart(sections),
    )


def _cells(record: Record) -> Iterator[Cell]:
    """At the goals; for Cycles at its defaults, which is one point, at the RMSE that it has."""
    for ours in OURS:
        for peer in (*PEERS, CYCLES_DEFAULT):
            curves = record.curve(ours), record.curve(peer)
            if all(curves):
                goals = {"its own": curves[1][0][1]} if peer == CYCLES_DEFAULT else GOALS
                yield from (Cell(record, ours, peer, name, ratio_at(goal, *curves)) for name, goal in goals.items())


def _machines(records: Sequence[Record]) -> list[str]:
    """What it was measured on and with, a line each where they differ."""
    found: dict[str, list[str]] = {}
    for record in records:
        found.setdefault(MACHINE.format(**record.about), []).append(record.name)
    codes = sorted(set().union(*(record.codes(OURS) for record in records)))
    state = f"- State of our code: {', '.join(codes)}{'.' if len(codes) == 1 else '; not the same in all points.'}"
    return [state] + [f"- {text}{'' if len(found) == 1 else ': ' + ', '.join(names)}" for text, names in found.items()]


def _rounds(records: Sequence[Record]) -> str:
    rounds = sorted({len(point.runs) for record in records for point in record.points if point.seconds <= LONG})
    return f"- Rounds: {' and '.join(map(str, rounds))}; one of what takes over {LONG:.0f} s."


def _missing(records: Sequence[Record]) -> Iterator[str]:
    """A line a size on scenes that are not there, and on those that have a size of their own."""
    alike = [name for name in EVERY if name not in OWN_SIZES]
    for size in sorted({record.size for record in records if record.scene in alike}):
        yield from _not_measured([(scene, size) for scene in alike], records)
    yield from _not_measured(OWN_SIZES.items(), records)


def _not_measured(wanted: Iterable[tuple[str, int]], records: Sequence[Record]) -> Iterator[str]:
    there = {(record.scene, record.size) for record in records}
    missing: dict[int, list[str]] = {}
    for scene, size in wanted:
        if (scene, size) not in there:
            missing.setdefault(size, []).append(f"`{scene}`")
    yield from (f"- Not measured at {size}x{size}: {', '.join(scenes)}." for size, scenes in missing.items())


def _summary(size: int, cells: Sequence[Cell]) -> list[str]:
    rows: dict[tuple[str, str, str], list[Cell]] = {}
    for cell in cells:
        rows.setdefault((cell.ours, cell.peer, cell.goal), []).append(cell)
    order = [(ours, peer, goal) for ours in OURS for peer in PEERS for goal in GOALS]
    means = [(rows[key][0], *_mean(rows[key])) for key in order if key in rows]
    return filled(Path(__file__).with_name("summary.md"), size=size, rows=means)


def _mean(cells: Sequence[Cell]) -> tuple[object, ...]:
    """How many, their mean, the worst and where it is, how many were carried on, how many are none."""
    there = [(cell.ratio, cell.record.scene) for cell in cells if cell.ratio is not None]
    missing = len(cells) - len(there)
    if not there:
        return 0, NONE, NONE, 0, missing
    mean = Ratio(geometric_mean([ratio.value for ratio, _ in there]), "")
    worst, scene = min(there, key=lambda each: each[0].value)
    return len(there), mean, f"{worst}, `{scene}`", sum(ratio.mark == "~" for ratio, _ in there), missing


def _losses(cells: Sequence[Cell]) -> list[str]:
    """Where the peer was as fast or faster, and where ours did not get there at all."""
    ratios = [(cell.ratio, cell.words) for cell in cells if cell.ratio is not None and cell.ratio.value <= 1.0]
    lost = sorted((ratio.value, f"- {words}: {ratio}") for ratio, words in ratios)
    missed = dict.fromkeys(f"- {cell.words}: ours did not get there" for cell in cells if cell.ratio is None)
    none = "None at these RMSEs: ours got to each of them, sooner than each peer."
    return [*(text for _, text in lost), *missed] or [none]


def _scene(record: Record, cells: Sequence[Cell], trial: bool) -> list[str]:
    rows: dict[tuple[str, str], list[object]] = {}
    for cell in cells:
        if cell.peer in PEERS:
            rows.setdefault((cell.ours, cell.peer), []).append(cell.ratio or NONE)
    picture = f"![RMSE against seconds]({PICTURES}/{record.name}.png)" if not trial else ""
    return filled(
        Path(__file__).with_name("scene.md"),
        record=record,
        about=record.about,
        ratios=table(["ours", "against", *GOALS], [(*key, *found) for key, found in rows.items()]),
        defaults=_defaults(record, [cell for cell in cells if cell.peer == CYCLES_DEFAULT]),
        skipped=[f"- Skipped: {name}: {why}." for name, why in record.skipped.items()],
        picture=picture,
    )


def _defaults(record: Record, cells: Sequence[Cell]) -> str:
    if not cells:
        return ""
    ((seconds, rmse),) = record.curve(CYCLES_DEFAULT)
    ratios = ", ".join(f"{cell.ratio or NONE} ({cell.ours})" for cell in cells)
    at_it = f"at that RMSE it takes as many times as long as ours: {ratios}."
    return f"Cycles at its defaults: {seconds:.1f} s, RMSE {rmse:.5f}; {at_it}"


def _told(record: Record, point: Point) -> tuple[Record, Point, str, str, float]:
    """What it was, and over what it told; both 99th percentiles, where it told one; rays a texel."""
    first, true = point.runs[0], point.corrected(record.noise)
    rays = (first.rays or 0) / record.about["texels"]
    told_p99 = NONE if first.estimated_p99 is None else f"{first.estimated_p99:.5f}"
    if not record.can_tell(point):
        return record, point, f"below {record.noise:.5f} | {NONE}", f"{told_p99} | {NONE}", rays
    shown = f"{true:.5f} | {true / first.estimated if first.estimated else float('nan'):.2f}"
    p99 = f"{first.p99 * true / point.rmse:.5f}" if point.rmse else "0"
    return record, point, shown, f"{told_p99} | {p99}", rays


def _agreement(record: Record) -> tuple[Record, Point, float]:
    largest = max(record.of(CYCLES), key=lambda point: int(point.setting))
    return record, largest, largest.corrected(record.noise)
