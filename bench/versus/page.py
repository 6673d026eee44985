"""bench/RESULTS.md, from whatever was measured."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from ...core.base.version import version
from .bakers import CYCLES, CYCLES_DEFAULT, OURS, OURS_ERROR, PEERS
from .curves import Ratio, geometric_mean, ratio_at
from .measure import LONG
from .plots import GOALS
from .scenes import MODELS, SCENES
from .store import Point, Record
from .words import ABOUT, HOW, LIMITS, NOT_EQUAL, RULES

PICTURES = "../docs/pictures/versus"
NONE = "–"


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


def lines_of(records: Sequence[Record], sections: Sequence[Sequence[str]], pictures: bool = True) -> list[str]:
    """The whole page. sections: those that are no scenes."""
    cells = list(_cells(records))
    about = [*_machines(records), *_short_of_all(records)]
    lines = [f"# Speed against error\n\nOcclusion Bake {version()}. {ABOUT}", "", *about, "", HOW]
    for size in sorted({record.size for record in records}):
        lines += ["", *_summary(size, [cell for cell in cells if cell.record.size == size])]
    lines += ["", *_losses(cells), "", "## Scenes", "", RULES]
    for record in records:
        lines += ["", *_scene(record, [cell for cell in cells if cell.record is record], pictures)]
    lines += ["", *_told(records), "", *_agreement(records)]
    for section in sections:
        lines += ["", *section]
    return [*lines, "", LIMITS, NOT_EQUAL]


def _cells(records: Sequence[Record]) -> Iterator[Cell]:
    for record in records:
        for ours in OURS:
            for peer in (*PEERS, CYCLES_DEFAULT):
                if record.of(ours) and record.of(peer):
                    yield from _row(record, ours, peer)


def _row(record: Record, ours: str, peer: str) -> Iterator[Cell]:
    """At the goals; for Cycles at its defaults, which is one point, at the RMSE that it has."""
    curves = record.curve(ours), record.curve(peer)
    goals = {"its own": curves[1][0][1]} if peer == CYCLES_DEFAULT else GOALS
    for name, goal in goals.items():
        yield Cell(record, ours, peer, name, ratio_at(goal, *curves))


def _machines(records: Sequence[Record]) -> list[str]:
    """What it was measured on and with, a line each where they differ."""
    found: dict[str, list[str]] = {}
    for record in records:
        about = record.about
        text = (
            f"{about['machine']}; Blender {about['blender']}; Embree {about['embree']} in ours, embreex "
            f"{about['embreex']}, Open3D {about['open3d']}"
        )
        found.setdefault(text, []).append(record.name)
    codes = sorted(set().union(*(record.codes(OURS) for record in records)))
    everything = len(found) == 1
    state = f"- State of our code: {', '.join(codes)}{'.' if len(codes) == 1 else '; not the same in all points.'}"
    return [state] + [f"- {text}{'' if everything else ': ' + ', '.join(names)}" for text, names in found.items()]


def _short_of_all(records: Sequence[Record]) -> list[str]:
    """How many rounds there were, and what was not measured at all."""
    rounds = sorted({len(point.runs) for record in records for point in record.points if point.seconds <= LONG})
    lines = [f"- Rounds: {' and '.join(map(str, rounds))}; one of what takes over {LONG:.0f} s."]
    for size in sorted({record.size for record in records}):
        there = {record.scene for record in records if record.size == size}
        if missing := [f"`{name}`" for name in (*SCENES, *MODELS) if name not in there]:
            lines.append(f"- Not measured at {size}x{size}: {', '.join(missing)}.")
    return lines


def _summary(size: int, cells: Sequence[Cell]) -> list[str]:
    lines = [
        f"## Times as long as ours at equal RMSE, {size}x{size}",
        "",
        "Geometric means over the scenes, and the worst of them. ~: ratios among them that were carried on beyond "
        f"measured points. {NONE}: scenes where ours did not get there.",
        "",
        f"| ours | against | RMSE | scenes | geometric mean | worst | of them ~ | {NONE} |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for ours in OURS:
        for peer in PEERS:
            for goal in GOALS:
                here = [cell for cell in cells if (cell.ours, cell.peer, cell.goal) == (ours, peer, goal)]
                if here:
                    lines.append(f"| {ours} | {peer} | {goal} | {_mean(here)} |")
    return lines


def _mean(cells: Sequence[Cell]) -> str:
    there = [(cell.ratio, cell) for cell in cells if cell.ratio is not None]
    missing = len(cells) - len(there)
    if not there:
        return f"0 | {NONE} | {NONE} | 0 | {missing}"
    mean = Ratio(geometric_mean([ratio.value for ratio, _ in there]), "")
    worst, where = min(there, key=lambda each: each[0].value)
    carried = sum(ratio.mark == "~" for ratio, _ in there)
    return f"{len(there)} | {mean} | {worst}, `{where.record.scene}` | {carried} | {missing}"


def _losses(cells: Sequence[Cell]) -> list[str]:
    """Where the peer was as fast or faster, and where ours did not get there at all."""
    ratios = [(cell.ratio, cell.words) for cell in cells if cell.ratio is not None and cell.ratio.value <= 1.0]
    lost = sorted((ratio.value, f"- {words}: {ratio}") for ratio, words in ratios)
    missed = [f"- {cell.words}: ours did not get there" for cell in cells if cell.ratio is None]
    lines = ["## Losses", ""]
    if not lost and not missed:
        return [*lines, "None at these RMSEs: ours got to each of them, sooner than each peer."]
    return [*lines, *(text for _, text in lost), *dict.fromkeys(missed)]


def _scene(record: Record, cells: Sequence[Cell], pictures: bool) -> list[str]:
    about = record.about
    lines = [
        f"### {record.scene}, {record.size}x{record.size}",
        "",
        f"{about['object']}, {about['texels']:,} texels; {about['triangles']:,} triangles occlude, instances counted "
        f"each. Reference: {about['reference_rays']} rays, noise {record.noise:.5f}. Measured {about['measured']}.",
        "",
        "| ours | against | " + " | ".join(GOALS) + " |",
        "|---|---|" + "---|" * len(GOALS),
    ]
    for ours in OURS:
        for peer in PEERS:
            row = {cell.goal: cell.ratio for cell in cells if (cell.ours, cell.peer) == (ours, peer)}
            if row:
                shown = " | ".join(str(row[goal] or NONE) for goal in GOALS)
                lines.append(f"| {ours} | {peer} | {shown} |")
    lines += _defaults(record, cells)
    lines += ["", *(f"- Skipped: {name}: {why}." for name, why in record.skipped.items())] if record.skipped else []
    return [*lines, "", f"![RMSE against seconds]({PICTURES}/{record.name}.png)"] if pictures else lines


def _defaults(record: Record, cells: Sequence[Cell]) -> list[str]:
    points = record.of(CYCLES_DEFAULT)
    if not points:
        return []
    ratios = [f"{cell.ratio or NONE} ({cell.ours})" for cell in cells if cell.peer == CYCLES_DEFAULT]
    return [
        "",
        f"Cycles at its defaults: {points[0].seconds:.1f} s, RMSE {points[0].corrected(record.noise):.5f}; at that "
        f"RMSE it takes as many times as long as ours: {', '.join(ratios)}.",
    ]


def _told(records: Sequence[Record]) -> list[str]:
    lines = [
        "## The error that ours tells",
        "",
        "What each bake to an error said of itself beside what it was, RMSE and 99th percentile of the first round. "
        "The reference's noise is taken out of the true RMSE, and the true percentile is narrowed as much. Rays: "
        "without those that measured the error.",
        "",
        "| scene | size | asked for | told RMSE | true | true / told | told p99 | true | s | rays a texel |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for record in records:
        lines += [_told_row(record, point) for point in record.of(OURS_ERROR)]
    return lines


def _told_row(record: Record, point: Point) -> str:
    first, true = point.runs[0], point.corrected(record.noise)
    told, p99 = first.estimated or 0.0, first.estimated_p99 or 0.0
    shown = f"{true:.5f} | {true / told if told else float('nan'):.2f}"
    true_p99 = f"{first.p99 * true / point.rmse:.5f}" if point.rmse else "0"
    if true < 0.5 * record.noise:  # nothing that this reference could tell
        shown, true_p99 = f"below {record.noise:.5f} | {NONE}", NONE
    return (
        f"| {record.scene} | {record.size} | {point.setting} | {told:.5f} | {shown} | {p99:.5f} | {true_p99} "
        f"| {point.seconds:.2f} | {(first.rays or 0) / record.about['texels']:.1f} |"
    )


def _agreement(records: Sequence[Record]) -> list[str]:
    lines = [
        "## Does the reference agree with Cycles?",
        "",
        "The largest Cycles bake against it, over the texels that both give to the same triangle. What is left as RMSE "
        "is Cycles' noise and whatever else tells the two apart; the bias is free of noise.",
        "",
        "| scene | size | samples | texels compared, of | bias | RMSE |",
        "|---|---|---|---|---|---|",
    ]
    for record in records:
        points = record.of(CYCLES)
        if points:
            largest = max(points, key=lambda point: int(point.setting))
            lines.append(
                f"| {record.scene} | {record.size} | {largest.setting} | {largest.runs[0].texels:,} of "
                f"{record.about['texels']:,} | {largest.bias:+.5f} | {largest.corrected(record.noise):.5f} |"
            )
    return lines
