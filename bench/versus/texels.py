"""How time grows with the number of texels, to the same error. The section `texels`."""

from __future__ import annotations

import argparse
import statistics
import tempfile
from pathlib import Path
from typing import Any

from ...tests.oracles.settings import flat_settings
from ..ours import bake_here
from ..pages import machine
from .store import Rows
from .subject import Subject, prepare

SCENE = "suzanne"
ERROR = 1.0 / 255.0
SIZES = (512, 1024, 2048, 4096)
GOAL = 16.0  # times as long from 512 to 4096 at most; there are 64 times as many texels


def measure(chosen: argparse.Namespace, rows: Rows) -> None:
    """Every size, in one process."""
    rows.add("about", lambda: {"machine": machine()})
    if any(str(size) not in rows.values for size in SIZES):
        subject = prepare(SCENE, SIZES[0], chosen.models)
        for size in SIZES:
            rows.add(str(size), lambda size=size: _bake(subject, size, chosen.rounds))


def page(rows: dict[str, Any]) -> list[str]:
    """The section of the page."""
    lines = [
        "## Texels",
        "",
        f"`{SCENE}`, to an error of 1/255, from the button to the texture. Goal: from {SIZES[0]} to {SIZES[-1]} at "
        f"most {GOAL:g} times as long, for 64 times the texels.",
        "",
        f"| size | s | rays a texel | estimated RMSE | times as long as {SIZES[0]} |",
        "|---|---|---|---|---|",
    ]
    first = rows.get(str(SIZES[0]))
    for size in SIZES:
        if row := rows.get(str(size)):
            ratio = f"{row['seconds'] / first['seconds']:.1f}" if first else "–"
            lines.append(f"| {size} | {row['seconds']:.2f} | {row['rays']:.1f} | {row['error']:.5f} | {ratio} |")
    return [*lines, "", f"On {rows['about']['machine']}."]


def _bake(subject: Subject, size: int, rounds: int) -> dict[str, float]:
    settings = flat_settings(width=size, height=size, error=ERROR, margin=0)
    times = []
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(rounds):
            seconds, results, _ = bake_here([subject.name], settings, Path(folder))
            times.append(seconds)
    baked = results[0][1]
    return {
        "seconds": statistics.median(times),
        "rays": baked.rays / baked.texels,
        "error": baked.maps["ao"].error,
    }
