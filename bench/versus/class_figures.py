"""What is told of each scene by class: beside Cycles, beside ours plain, and of the error that ours tells."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from .bakers import CYCLES, OURS_ERROR, OURS_RAYS
from .classes import AIM, CLASSES, MEAN, TOLD, SceneClass, size_of
from .curves import Ratio, geometric_mean, ratio_at
from .plot import GOALS
from .record import Record

NONE = "–"


@dataclass(frozen=True)
class Figures:
    """Of one record, by GOALS' names. cycles, plain: how many times as long as ours to an error these take; empty where
    they were not measured, None where ours did not get there. told: what ours tells of its error over what it makes,
    where the reference can tell."""

    scene: str
    cycles: Mapping[str, Ratio | None]
    plain: Mapping[str, Ratio | None]
    told: Mapping[str, float]


@dataclass(frozen=True)
class Aim:
    """What is aimed at, what was measured, and whether that meets it."""

    what: str
    measured: str
    met: str


@dataclass(frozen=True)
class At:
    """A figure and where it is."""

    value: float
    shown: str
    scene: str
    goal: str

    def __str__(self) -> str:
        return f"{self.shown}, `{self.scene}` at {self.goal}"


def figures_of(record: Record) -> Figures:
    """All of a record's."""
    return Figures(record.scene, _ratios(record, CYCLES), _ratios(record, OURS_RAYS), _told(record))


def by_scene(records: Iterable[Record], *, trial: bool = False) -> dict[str, Figures]:
    """Of each scene at its class' size; of trials at the largest that there is."""
    there = [record for record in records if trial or record.size == size_of(record.scene)]
    return {record.scene: figures_of(record) for record in sorted(there, key=lambda record: record.size)}


def aims(found: Mapping[str, Figures]) -> list[Aim]:
    """All, of AO."""
    return [*(_of_class(each, found) for each in CLASSES), _of_all(found), *aims_beside_plain(found)]


def aims_beside_plain(found: Mapping[str, Figures]) -> list[Aim]:
    """Those that need no peer."""
    ratios = [At(ratio.value, str(ratio), *where) for ratio, *where in _each(found, "plain") if ratio is not None]
    unreached = [where for ratio, *where in _each(found, "plain") if ratio is None]
    told = sorted(
        (At(value, f"{value:.2f}", each.scene, goal) for each in found.values() for goal, value in each.told.items()),
        key=lambda at: at.value,
    )
    return [_never_slower(ratios, len(unreached)), _truly_told(told)]


def worst_of(ratios: Sequence[tuple[Ratio, str]]) -> tuple[Ratio, str]:
    """The least, and its scene."""
    return min(ratios, key=lambda each: each[0].value)


def mean_of(ratios: Sequence[Ratio]) -> Ratio:
    """Their geometric mean."""
    return Ratio(geometric_mean([each.value for each in ratios]), "")


def _ratios(record: Record, peer: str) -> dict[str, Ratio | None]:
    curves = record.curve(OURS_ERROR), record.curve(peer)
    return {name: ratio_at(goal, *curves) for name, goal in GOALS.items()} if all(curves) else {}


def _told(record: Record) -> dict[str, float]:
    told = {point.setting: record.told_over_made(point) for point in record.of(OURS_ERROR) if point.setting in GOALS}
    return {goal: over for goal, over in told.items() if over is not None}


def _each(found: Mapping[str, Figures], peer: str) -> Iterator[tuple[Ratio | None, str, str]]:
    for each in found.values():
        yield from ((ratio, each.scene, goal) for goal, ratio in getattr(each, peer).items())


def _of_class(kind: SceneClass, found: Mapping[str, Figures]) -> Aim:
    at_aim = {scene: found[scene].cycles.get(AIM) for scene in kind.scenes if scene in found and found[scene].cycles}
    ratios = [(ratio, scene) for scene, ratio in at_aim.items() if ratio is not None]
    what = f"{kind.title}: each at least {kind.least:g} times Cycles"
    unreached = [scene for scene, ratio in at_aim.items() if ratio is None]
    measured = [f"worst {worst}, `{scene}`" for worst, scene in ([worst_of(ratios)] if ratios else [])]
    measured += [f"not reached: {', '.join(f'`{scene}`' for scene in unreached)}"] if unreached else []
    missed = bool(unreached) or any(ratio.value < kind.least for ratio, _ in ratios)
    return Aim(what, "; ".join(measured) or NONE, _verdict(missed, [s for s in kind.scenes if s not in at_aim]))


def _of_all(found: Mapping[str, Figures]) -> Aim:
    at_aim = {each.scene: each.cycles[AIM] for each in found.values() if each.cycles}
    ratios = [ratio for ratio in at_aim.values() if ratio is not None]
    every = [scene for kind in CLASSES for scene in kind.scenes]
    what = f"All scenes: in the geometric mean at least {MEAN:g} times Cycles"
    if not ratios:
        return Aim(what, NONE, _verdict(False, every))
    mean = mean_of(ratios)
    measured = f"{mean}, {len(ratios)} scenes"
    return Aim(what, measured, _verdict(mean.value < MEAN, [scene for scene in every if at_aim.get(scene) is None]))


def _never_slower(ratios: Sequence[At], unreached: int) -> Aim:
    slower = [at for at in ratios if at.value < 1.0]
    worst = f"worst {min(ratios, key=lambda at: at.value)}; " if ratios else ""
    measured = f"{worst}{len(slower)} of {len(ratios)} slower"
    measured += f", {unreached} not reached" if unreached else ""
    return Aim(
        "Never slower than ours plain", measured, _verdict(bool(slower) or unreached > 0, [] if ratios else ["any"])
    )


def _truly_told(told: Sequence[At]) -> Aim:
    low, high = TOLD
    what = f"Error told over error made: {low:g} to {high:g}"
    if not told:
        return Aim(what, NONE, _verdict(False, ["any"]))
    outside = sum(not low <= at.value <= high for at in told)
    return Aim(what, f"{told[0]}, to {told[-1]}; {outside} of {len(told)} outside", _verdict(outside > 0, []))


def _verdict(missed: bool, not_measured: Sequence[str]) -> str:
    """Whether an aim is met."""
    if missed:
        return "no"
    return "not all measured" if not_measured else "yes"
