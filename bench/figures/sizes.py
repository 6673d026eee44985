"""Seconds by the size of the image, at one error: what texels cost that are finer than what changes."""

from __future__ import annotations

import argparse
import statistics
from typing import Any

from ...core.rays.map_spec import AO
from ..pages import filled
from ..subject import Subject, prepare
from ..tables import table

SCENES = ("suzanne", "spot", "gaps", "bunny", "foliage")
SIZES = (512, 1024, 2048, 4096, 8192)
DEARER = ("foliage",)  # of which the largest image takes minutes, and is left out
ERROR = 1.0 / 255.0


def measure(chosen: argparse.Namespace) -> list[dict[str, Any]]:
    """Sizes in turns, a scene after another."""
    found = []
    for scene in SCENES:
        subjects = [prepare(scene, size, chosen.models) for size in SIZES if size < SIZES[-1] or scene not in DEARER]
        rounds = [[_bake(subject) for subject in subjects] for _ in range(chosen.rounds)]
        found += [_median([each[i] for each in rounds]) for i in range(len(subjects))]
        for each, subject in zip(found[-len(subjects) :], subjects, strict=True):
            each.update(scene=scene, size=subject.size)
    return found


def page(result: list[dict[str, Any]]) -> list[str]:
    """The section of the page."""
    heads = ["scene", *(f"{size}²" for size in SIZES), *(f"{size}² / 512²" for size in SIZES[-2:]), "rays a texel"]
    scenes = dict.fromkeys(each["scene"] for each in result)
    rows = [_row(scene, {each["size"]: each for each in result if each["scene"] == scene}) for scene in scenes]
    told = [each["told"] for each in result]
    return filled(__file__, rows=table(heads, rows), least=min(told), most=max(told), error=ERROR)


def _row(scene: str, by_size: dict[int, dict[str, Any]]) -> tuple[str, ...]:
    seconds = {size: each["seconds"] for size, each in by_size.items()}
    times = [f"{seconds[size]:.2f}" if size in seconds else "" for size in SIZES]
    ratios = [f"{seconds[size] / seconds[SIZES[0]]:.1f}" if size in seconds else "" for size in SIZES[-2:]]
    return scene, *times, *ratios, ", ".join(f"{each['rays']:.1f}" for each in by_size.values())


def _bake(subject: Subject) -> dict[str, float]:
    made = subject.bake(error=ERROR, with_files=True)
    ao = made.baked.maps[AO.name]
    return {"seconds": made.seconds, "rays": ao.rays / made.baked.texels, "told": ao.error}


def _median(runs: list[dict[str, float]]) -> dict[str, Any]:
    return {name: statistics.median(each[name] for each in runs) for name in runs[0]}
