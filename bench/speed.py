"""Seconds from the button to the texture, against Cycles with as many samples, on the same texels and threads."""

from __future__ import annotations

import argparse
import json
import os
import statistics
import tempfile
from pathlib import Path
from typing import Any

import bpy

from ..addon.cli.hard_exit import leave
from ..addon.compare.cycles import CyclesSettings, bake_ao
from ..core.rays.embree import OVERRIDE, candidates
from ..samples.scenes import build
from ..tests.oracles.settings import flat_settings
from .ours import bake_here
from .pages import answer_of

SIZE, RAYS = 1024, 256
OBJECT = "Suzanne"


def measure(chosen: argparse.Namespace) -> dict[str, Any]:
    """Alternate: ours with the widest Embree, ours with Blender's own (AVX2 at most), Cycles."""
    runs: dict[str, list[float]] = {"ours": [], "ours_avx2": [], "cycles": []}
    notes: dict[str, str] = {}
    for turn in range(chosen.rounds):
        for name, library in (("ours", ""), ("ours_avx2", _blender_embree())):
            seconds, notes[name] = _ours_in_child(library)
            runs[name].append(seconds)
        runs["cycles"].append(_cycles())
        print(turn, {name: round(times[-1], 2) for name, times in runs.items()}, flush=True)
    return {"runs": runs, "embree": notes, "blender": bpy.app.version_string, "threads": os.cpu_count()}


def page(result: dict[str, Any]) -> list[str]:
    """The section of the page."""
    lines = [
        "## Speed at equal samples",
        "",
        f"AO of {OBJECT} (sample `suzanne`), {SIZE}x{SIZE}, {RAYS} rays or samples a texel, {result['threads']} "
        f"threads, no filter, Blender {result['blender']}. Ours: reading the scene, texels, tree, rays, margin and a "
        "16-bit PNG; the first bake after the file was opened, with nothing warm. Cycles: its bake operator alone, "
        "adaptive sampling off.",
        "",
        "| | median s | runs | times as fast as Cycles |",
        "|---|---|---|---|",
    ]
    names = {"ours": "Occlusion Bake", "ours_avx2": "Occlusion Bake, Blender's Embree", "cycles": "Cycles"}
    for name, times in result["runs"].items():
        done = [turn for turn, each in enumerate(times) if each is not None]  # a row may have sat out a round
        median, cycles = (statistics.median(each[turn] for turn in done) for each in (times, result["runs"]["cycles"]))
        runs = ", ".join(f"{times[turn]:.2f}" for turn in done)
        lines.append(f"| {names[name]} | {median:.2f} | {runs} | {cycles / median:.1f} |")
    lines += ["", *(f"{names[name]}: Embree {_short(text)}." for name, text in result["embree"].items())]
    return lines


def _short(description: str) -> str:
    """Without the folder, which says nothing elsewhere."""
    front, _, path = description.rpartition(", ")
    return f"{front}, {Path(path).name}"


def _blender_embree() -> str:
    return next((path for path in candidates() if "bpy" in Path(path).parts), "")


def _cycles() -> float:
    build("suzanne")
    return bake_ao(bpy.context, OBJECT, CyclesSettings((SIZE, SIZE), RAYS, None, os.cpu_count() or 1, 0)).seconds


def _ours_in_child(library: str) -> tuple[float, str]:
    """A fresh process: the tree, the tables and the libraries are loaded as for an artist's first press."""
    environment = {**os.environ, **({OVERRIDE: library} if library else {})}
    seconds, embree = answer_of("speed", environment=environment)
    return float(seconds), str(embree)


def _child() -> None:
    build("suzanne")
    with tempfile.TemporaryDirectory() as folder:
        seconds, _, embree = bake_here([OBJECT], flat_settings(width=SIZE, height=SIZE, rays=RAYS), Path(folder))
    print(json.dumps([seconds, embree]))


if __name__ == "__main__":
    _child()
    leave(0)
