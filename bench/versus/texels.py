"""How time grows with the number of texels, to the same error. The section `texels`."""

from __future__ import annotations

import argparse
from dataclasses import replace
from functools import partial
from typing import Any

from ..pages import filled, machine
from ..subject import Subject, prepare
from ..sweep import in_turns, medians

SCENE = "suzanne"
SIZES = (512, 1024, 2048, 4096)
GOAL = 16.0  # times as long from 512 to 4096 at most; there are 64 times as many texels


def measure(chosen: argparse.Namespace) -> dict[str, Any]:
    """Every size, in one process."""
    subject = prepare(SCENE, SIZES[0], chosen.models)
    runs = in_turns({str(size): partial(_bake, replace(subject, size=size)) for size in SIZES}, chosen.rounds)
    return {"about": {"machine": machine()}, **{size: medians(each) for size, each in runs.items()}}


def page(result: dict[str, Any]) -> list[str]:
    """The section of the page."""
    found = [(size, result[str(size)]) for size in SIZES]
    rows = [{**each, "size": size, "times": each["seconds"] / found[0][1]["seconds"]} for size, each in found]
    return filled(__file__, scene=SCENE, sizes=SIZES, goal=GOAL, rows=rows, **result["about"])


def _bake(subject: Subject, _: int) -> dict[str, float]:
    made = subject.bake(with_files=True, error=1 / 255)
    baked = made.baked
    return {"seconds": made.seconds, "rays": baked.rays / baked.texels, "error": baked.maps["ao"].error}
