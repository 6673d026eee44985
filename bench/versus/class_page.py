"""The page's tables by class, from figures."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from ...samples.bench_scenes import OWN_SIZES
from ..pages import apart, filled
from ..tables import table
from .bakers import CYCLES, OURS_RAYS
from .class_figures import NONE, Figures, aims, aims_beside_plain, by_scene, mean_of, worst_of
from .classes import AIM, CLASSES, SIZE
from .curves import Ratio
from .plot import GOALS
from .record import Record

COLUMNS = ("scene", "figure", *GOALS)
TOLD = "told / made"
Row = tuple[str, ...]
Cells = Mapping[str, Ratio | None]


def chapter(records: Sequence[Record], *, trial: bool = False) -> list[str]:
    """AO by class: what is aimed at, and the tables."""
    found = by_scene((record for record in records if record.is_ao), trial=trial)
    if not found:
        return []
    title, sizes = ("By class", "") if trial else (f"By class, {SIZE}x{SIZE}", _own_sizes())
    text = Path(__file__).with_name("classes.md")
    return filled(text, title=title, sizes=sizes, aim=AIM, aims=aims(found), classes=apart(_tables(found)))


def reflections(records: Sequence[Record], *, trial: bool = False) -> list[str]:
    """The same of each RO map that was measured, against ours plain."""
    maps = dict.fromkeys(record.map for record in records if not record.is_ao)
    chapters = []
    for name in sorted(maps, key=lambda each: int(each.rpartition("_")[2])):
        found = by_scene((record for record in records if record.map == name), trial=trial)
        title = name.replace("_", " ").upper()
        text = Path(__file__).with_name("reflections.md")
        lines = filled(text, title=title, aims=aims_beside_plain(found), classes=apart(_tables(found)))
        chapters += [lines] if found else []
    return apart(chapters).splitlines()


def _own_sizes() -> str:
    return f"Textures of {', of '.join(f'`{scene}` are {size}x{size}' for scene, size in OWN_SIZES.items())}."


def _tables(found: Mapping[str, Figures]) -> list[list[str]]:
    kinds = [(kind.title, [found[scene] for scene in kind.scenes if scene in found]) for kind in CLASSES]
    kinds = [(title, figures) for title, figures in kinds if figures]
    chapters = [_chapter(title, figures, each=True) for title, figures in kinds]
    return [*chapters, _chapter("All scenes", [each for _, figures in kinds for each in figures], each=False)]


def _chapter(title: str, figures: Sequence[Figures], *, each: bool) -> list[str]:
    """each: a row a scene, beside those of all."""
    rows = [
        *_ratio_rows(CYCLES, {one.scene: one.cycles for one in figures if one.cycles}, each),
        *_ratio_rows(OURS_RAYS, {one.scene: one.plain for one in figures if one.plain}, each),
        *_told_rows({one.scene: one.told for one in figures}, each),
    ]
    return [f"### {title}", "", *table(COLUMNS, rows)]


def _ratio_rows(peer: str, ratios: Mapping[str, Cells], each: bool) -> list[Row]:
    rows = [(f"`{scene}`", peer, *(str(cells[goal] or NONE) for goal in GOALS)) for scene, cells in ratios.items()]
    if not ratios:
        return []
    mean = ("geometric mean", peer, *_at_goals(ratios, lambda there: str(mean_of([ratio for ratio, _ in there]))))
    worst = ("worst", peer, *_at_goals(ratios, _worst))
    return [*(rows if each else []), mean, worst]


def _at_goals(ratios: Mapping[str, Cells], shown: Callable[[list[tuple[Ratio, str]]], str]) -> list[str]:
    """A cell a goal, of the ratios that there are, each with its scene."""
    cells = []
    for goal in GOALS:
        there = [(ratio, scene) for scene, of_scene in ratios.items() if (ratio := of_scene[goal]) is not None]
        cells.append(shown(there) if there else NONE)
    return cells


def _worst(there: list[tuple[Ratio, str]]) -> str:
    ratio, scene = worst_of(there)
    return f"{ratio}, `{scene}`"


def _told_rows(told: Mapping[str, Mapping[str, float]], each: bool) -> list[Row]:
    if each:
        return [(f"`{scene}`", TOLD, *_spans([of])) for scene, of in told.items()]
    return [("from, to", TOLD, *_spans(list(told.values())))]


def _spans(told: Sequence[Mapping[str, float]]) -> list[str]:
    return [_span([of[goal] for of in told if goal in of]) for goal in GOALS]


def _span(values: Sequence[float]) -> str:
    """From the least to the largest."""
    ends = dict.fromkeys((f"{min(values):.2f}", f"{max(values):.2f}")) if values else {NONE: None}
    return ", ".join(ends)
