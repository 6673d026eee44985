"""The measurement of one scene, in rounds in which the bakers take turns."""

from __future__ import annotations

import argparse
import hashlib
from collections.abc import Iterator
from datetime import date
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from itertools import zip_longest
from typing import Any

import bpy
import numpy as np

from ...core.finish.compare import compare
from ..pages import ROOT, machine
from ..subject import Subject, prepare
from .bakers import OURS, Baker, bakers, refusal
from .record import FOLDER, Point, Record, Run, read
from .reference import Reference, reference

LONG = 60.0  # seconds: a point that takes longer is measured in the first round alone
MUST_AGREE = ("machine", "blender", "embree", "embreex", "triangles", "texels")
PATIENCE = 4.0  # points that are expected to take so many times the budget are left out
_SOURCES = ("core/**/*.py", "core/kernel/src/*", "core/kernel/include/*")


def measure(scene: str, size: int, chosen: argparse.Namespace) -> None:
    """Measure what is not there yet of a scene at a size, and keep it."""
    record = Record(scene, size)
    if record.file.exists() and not chosen.fresh:
        record = read(record.file)
    subject = prepare(scene, size, chosen.models)
    against = reference(subject, chosen.budget, FOLDER / f"{record.name}_reference.npz", chosen.fresh)
    about = _about(subject, against, chosen.quick)
    _drop_what_differs(record, about, against)
    record.about, record.noise, record.skipped = about, against.noise, {}
    wanted = [baker for baker in bakers(chosen.quick) if not _is_refused(baker, subject, record)]
    record.keep()
    for number in range(chosen.rounds):
        for baker, setting in _turns(wanted):
            point = record.point(baker.name, setting)
            if _is_due(point, number) and _is_affordable(baker, setting, record, chosen.budget):
                _bake(baker, subject, point, against, record)


def _about(subject: Subject, against: Reference, quick: bool) -> dict[str, Any]:
    return {
        "quick": quick,
        "object": subject.name,
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
    record.skip(f"{baker.name}, {setting}", f"it would take some {expected:.0f} s")
    return False


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
