"""The measurement of one scene, in rounds in which the bakers take turns."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from datetime import date
from importlib.metadata import PackageNotFoundError, version
from itertools import zip_longest

import bpy
import numpy as np

from ...core.finish.compare import compare
from ..pages import machine
from .bakers import OURS, Baker, Shot, bakers, refusal
from .code import state_of_code
from .reference import Reference, reference
from .store import FOLDER, Point, Record, Run, record_of
from .subject import Subject, prepare

LONG = 60.0  # seconds: a point that takes longer is measured in the first round alone
MUST_AGREE = ("machine", "blender", "embree", "embreex", "triangles", "texels")
PATIENCE = 4.0  # points that are expected to take so many times the budget are left out


def measure(scene: str, size: int, chosen: argparse.Namespace) -> None:
    """Measure what is not there yet of a scene at a size, and keep it."""
    record = record_of(scene, size, chosen.fresh)
    subject = prepare(scene, size, chosen.models)
    against = reference(subject, chosen.budget, FOLDER / f"{record.name}_reference.npz", chosen.fresh)
    about = _about(subject, against, chosen)
    if other := _other(record, about, against):
        print(f"{record.name}: {other}, so all is measured anew", flush=True)
        record.points.clear()
    if record.codes(OURS) - {state_of_code()}:
        print(f"{record.name}: points of ours are kept from another state of the code; --fresh for new", flush=True)
    record.about, record.noise, record.skipped = about, against.noise, {}
    wanted = [baker for baker in bakers(chosen.quick) if not _refused(baker, subject, record)]
    record.keep()
    for number in range(chosen.rounds):
        for baker, setting in _turns(wanted):
            point = record.point(baker.name, setting)
            if _is_due(point, number) and _is_affordable(baker, setting, record, chosen.budget):
                _add(point, baker.bake(subject, setting, number), against, record)


def _about(subject: Subject, against: Reference, chosen: argparse.Namespace) -> dict[str, object]:
    return {
        "quick": chosen.quick,
        "object": subject.name,
        "texels": int(np.count_nonzero(subject.covered)),
        "of_the_same_triangle": int(np.count_nonzero(subject.same)),
        "triangles": subject.triangles,
        "reference_rays": against.rays,
        "machine": machine(),
        "measured": date.today().isoformat(),
        "blender": bpy.app.version_string,
        "embree": subject.embree,
        "embreex": _version("embreex"),
        "open3d": _version("open3d"),
    }


def _other(record: Record, about: dict[str, object], against: Reference) -> str:
    """Why what was measured before cannot stand beside what is measured now; empty where it can."""
    if not record.points:
        return ""
    if record.noise != against.noise:
        return "its reference is another one"
    changed = [name for name in MUST_AGREE if record.about.get(name) != about[name]]
    return f"it was measured with another {changed[0]}" if changed else ""


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"


def _refused(baker: Baker, subject: Subject, record: Record) -> bool:
    why = refusal(baker, subject)
    if why is None:
        return False
    print(f"SKIPPED {baker.name}: {why}", flush=True)
    record.skipped[baker.name] = why
    return True


def _turns(wanted: list[Baker]) -> Iterator[tuple[Baker, str]]:
    """The coarsest settings of all, then the next: bakers alternate, and what is quick is there first."""
    for row in zip_longest(*([(baker, setting) for setting in baker.settings] for baker in wanted)):
        yield from (turn for turn in row if turn is not None)


def _is_due(point: Point, number: int) -> bool:
    return len(point.runs) <= number and not (point.runs and point.seconds > LONG)


def _is_affordable(baker: Baker, setting: str, record: Record, budget: float) -> bool:
    """Whether a point may take as long as its baker's finest so far lets expect."""
    before = [each for each in record.of(baker.name) if baker.cost(each.setting) < baker.cost(setting)]
    if not before:
        return True
    finest = max(before, key=lambda each: baker.cost(each.setting))
    expected = finest.seconds * baker.cost(setting) / baker.cost(finest.setting)
    if expected <= PATIENCE * budget or record.point(baker.name, setting).runs:
        return True
    why = f"it would take some {expected:.0f} s"
    print(f"SKIPPED {baker.name} {setting}: {why}", flush=True)
    record.skipped[f"{baker.name}, {setting}"] = why
    record.keep()
    return False


def _add(point: Point, shot: Shot, against: Reference, record: Record) -> None:
    """Compare a bake and keep what it gave."""
    if not shot.covered.any():
        record.skipped[f"{point.baker}, {point.setting}"] = "it has no texel of the same triangle"
        print(f"SKIPPED {point.baker} {point.setting}: it has no texel of the same triangle", flush=True)
        return
    found = compare(shot.values, against.values, shot.covered)
    told = (shot.error, shot.p99, shot.rays, state_of_code())
    run = Run(shot.seconds, found.rmse, found.bias, found.p99, found.texels, *told)
    point.runs.append(run)
    record.keep()
    print(
        f"round {len(point.runs)}: {point.baker} {point.setting}: {run.seconds:.2f} s, "
        f"RMSE {point.corrected(record.noise):.5f}, bias {run.bias:+.5f}",
        flush=True,
    )
