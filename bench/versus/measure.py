"""The measurement of one scene, in rounds in which the bakers take turns."""

from __future__ import annotations

import argparse
import hashlib
import math
from collections.abc import Iterator, Sequence
from datetime import date
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from itertools import zip_longest
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...core.finish.compare import compare
from ..pages import ROOT, machine
from ..subject import Subject, prepare
from .bakers import OURS, Baker, refusal
from .cases import MAPS, Case, is_trial
from .choice import bakers_for, longest
from .record import FOLDER, Point, Record, Run, file_of, read
from .reference import Reference, reference

LONG = 60.0  # seconds: a point that takes longer is measured in the first round alone
MUST_AGREE = ("machine", "blender", "embree", "embreex", "triangles", "texels")
STALLED = 0.93  # more rays that leave so much of the error are of no use: half of them, if independent, leave 0.71
_SOURCES = ("core/**/*.py", "core/kernel/src/*", "core/kernel/include/*")


def measure(case: Case, chosen: argparse.Namespace) -> None:
    """Measure what is not there yet of a case, and keep it."""
    trial = is_trial(chosen)
    record, file = Record(case.scene, case.size, map=case.map), file_of(case, trial=trial)
    if file.exists() and not chosen.fresh:
        record = read(file)
    if trial:
        record.without_other_codes(OURS, source_hash())
    subject = prepare(case.scene, case.size, chosen.models)
    against = reference(subject, MAPS[case.map], chosen.budget, _reference_files(case, trial), chosen.fresh)
    about = _about(subject, against, trial)
    _drop_what_differs(record, about, against)
    record.about, record.noise, record.skipped = about, against.noise, {}
    wanted = [baker for baker in bakers_for(case, chosen) if not _is_refused(baker, subject, record)]
    record.keep()
    for number in range(chosen.rounds):
        for baker, setting in _turns(wanted):
            point = record.point(baker.name, setting)
            if _is_due(point, number) and _is_worth_it(baker, setting, record, chosen):
                _bake(baker, subject, point, against, record)


def _reference_files(case: Case, trial: bool) -> list[Path]:
    """Where its reference may be, and last where it goes: a trial's own must not become the page's."""
    kept = FOLDER / f"{case.name}_reference.npz"
    return [kept, FOLDER / "trials" / kept.name] if trial else [kept]


def _about(subject: Subject, against: Reference, trial: bool) -> dict[str, Any]:
    return {
        "quick": trial,
        "object": subject.label,
        "texels": int(np.count_nonzero(subject.covered)),
        "of_the_same_triangle": int(np.count_nonzero(subject.same)),
        "triangles": subject.triangles,
        "reference_rays": against.rays,
        "machine": machine(),
        "measured": date.today().isoformat(),
        "blender": bpy.app.version_string,
        "embree": subject.embree,
        **{package: _version(package) for package in ("embreex", "open3d")},
    }


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"


def _drop_what_differs(record: Record, about: dict[str, Any], against: Reference) -> None:
    """Take out what was measured before and cannot stand beside what is measured now."""
    other = [name for name in MUST_AGREE if record.about.get(name) != about[name]]
    if record.points and (other or record.noise != against.noise):
        print(
            f"{record.name}: it had another {other[0] if other else 'reference'}, so all is measured anew", flush=True
        )
        record.points.clear()
    if record.codes(OURS) - {source_hash()}:
        print(f"{record.name}: points of ours are kept from another state of the code; --fresh for new", flush=True)


@cache
def source_hash() -> str:
    """Eight hexadecimal digits that tell states of the core and its kernel apart: runs of many days make a page."""
    digest = hashlib.blake2b(digest_size=4)
    for file in sorted(file for pattern in _SOURCES for file in ROOT.glob(pattern)):
        digest.update(file.read_bytes())
    return digest.hexdigest()


def _is_refused(baker: Baker, subject: Subject, record: Record) -> bool:
    if why := refusal(baker, subject):
        record.skip(baker.name, why)
    return bool(why)


def _turns(wanted: list[Baker]) -> Iterator[tuple[Baker, str]]:
    """The coarsest settings of all, then the next: bakers alternate, and what is quick is there first."""
    for row in zip_longest(*([(baker, setting) for setting in baker.settings + baker.further] for baker in wanted)):
        yield from (turn for turn in row if turn is not None)


def _is_due(point: Point, number: int) -> bool:
    return len(point.runs) <= number and not (point.runs and point.seconds > LONG)


def _is_worth_it(baker: Baker, setting: str, record: Record, chosen: argparse.Namespace) -> bool:
    """Whether a point is still needed, and may take as long as its baker's finest so far lets expect."""
    before = [each for each in record.of(baker.name) if baker.cost(each.setting) < baker.cost(setting)]
    before.sort(key=lambda each: baker.cost(each.setting))
    if setting in baker.further and _is_at_its_end(baker, before, record.noise):
        return False
    if not before:
        return True
    expected = _expected(baker.cost(setting), [(baker.cost(each.setting), each.seconds) for each in before])
    if expected <= longest(baker, setting, chosen) or record.point(baker.name, setting).runs:
        return True
    record.skip(f"{baker.name}, {setting}", f"it would take some {expected:.0f} s")
    return False


def _expected(cost: float, before: Sequence[tuple[float, float]]) -> float:
    """Seconds of a setting by costs and seconds of coarser ones, along the line through the last two: what does not
    grow with the cost may be most of it, as of many objects. After the first the second is simply tried."""
    (first, seconds), *others = before[-2:]
    if not others:
        return seconds
    ((last, finest),) = others
    return finest + max(finest - seconds, 0.0) / (last - first) * (cost - last)


def _is_at_its_end(baker: Baker, before: Sequence[Point], noise: float) -> bool:
    """Whether points, coarse to fine, have come to the RMSE that is gone on to, or come no nearer to it."""
    errors = [each.corrected(noise) for each in before]
    return min(errors, default=math.inf) <= baker.until or (len(errors) > 2 and errors[-1] > STALLED * errors[-2])


def _bake(baker: Baker, subject: Subject, point: Point, against: Reference, record: Record) -> None:
    """Another run, compared and kept; its seed is its number."""
    made = baker.bake(subject, point.setting, len(point.runs))
    if not made.covered.any():
        record.skip(f"{point.baker}, {point.setting}", "it has no texel of the same triangle")
        return
    found = compare(made.values, against.values, made.covered)
    told = (made.error, made.p99, made.rays, source_hash())
    point.runs.append(Run(made.seconds, found.rmse, found.bias, found.p99, found.texels, *told))
    record.keep()
    print(f"{point.baker} {point.setting}, {len(point.runs)}: {made.seconds:.2f} s, RMSE {found.rmse:.5f}", flush=True)
