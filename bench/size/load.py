"""Ten thousand small objects planned, baked in items, looked at again, merged. The section `load`."""

from __future__ import annotations

import argparse
import statistics
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from ...core.batch.files import json_of
from ..pages import filled
from ..sweep import in_child
from . import level
from .level import command, manifest_of, size_of

OBJECTS, TASK = 10_000, 100
BAKE = ("--size", 64, "--rays", 4, "--margin", 2)
FAR = ("--distance", level.STEP)
GOALS = {"plan": 60.0, "peak": 2.0, "overhead": 20.0, "second": 5.0, "merge": 30.0}  # s, GB, ms, %, s


def measure(_: argparse.Namespace) -> dict[str, Any]:
    """Without a limit to how far rays go, and with one."""
    with TemporaryDirectory() as place:
        file, folder = Path(place) / "level.blend", Path(place) / "baked"
        in_child(level.build, str(file), OBJECTS)
        kinds = {"everything": (), "near": FAR}
        return {kind: _measured(file, folder / kind, options) for kind, options in kinds.items()}


def page(result: dict[str, Any]) -> list[str]:
    """The section of the page."""
    both = {f"{kind}_{name}": value for kind, found in result.items() for name, value in found.items()}
    return filled(__file__, objects=OBJECTS, task=TASK, far=level.STEP, size=BAKE[1], **GOALS, **both)


def _measured(file: Path, folder: Path, options: Sequence[object]) -> dict[str, float]:
    planned = command("plan", file, *BAKE, *options, "--output", folder)
    manifest = folder / "manifest.json"
    starts = (0, OBJECTS // 2, OBJECTS - TASK)
    overheads = [_overhead(folder, start) for start in starts]
    stored = size_of(folder / "manifest") / OBJECTS
    first = command("--manifest", manifest)
    second = command("--manifest", manifest)
    merged = command("merge", manifest)
    whole = first.seconds * OBJECTS / (OBJECTS - len(starts) * TASK)  # as if nothing had been there
    return {
        "plan": planned.seconds,
        "peak": planned.peak,
        "overhead": statistics.fmean(overheads),
        "worst": max(overheads),
        "task_peak": first.peak,
        "first": whole,
        "second": second.seconds,
        "share": 100.0 * second.seconds / whole,
        "merge": merged.seconds,
        "stored": stored / 1e3,
    }


def _overhead(folder: Path, start: int) -> float:
    """Milliseconds of an item that are neither the command's start nor the item's own bake."""
    starting = command("merge", "--help").seconds
    task = command("--manifest", folder / "manifest.json", "--items", f"{start}-{start + TASK - 1}")
    items = manifest_of(folder)["items"][start : start + TASK]
    records = [json_of(folder / "manifest" / "items" / f"{item['stem']}.json") for item in items]
    seconds = [record["entry"]["seconds"] for record in records]
    baking: float = sum(each["total"] + each["write"] for each in seconds)
    return 1e3 * (task.seconds - starting - baking) / TASK
