"""Seconds from the button to the texture, against Cycles with as many samples, on the same texels and threads."""

from __future__ import annotations

import argparse
import os
import statistics
from pathlib import Path
from typing import Any

import bpy

from ...core.rays.embree import OVERRIDE, candidates
from ...samples.scenes import build
from ...tests.oracles.settings import flat_settings
from ..bake_here import bake_here
from ..cycles import bake_cycles
from ..pages import filled
from ..sweep import in_child, in_turns

SIZE, RAYS, OBJECT = 1024, 256, "Suzanne"
NAMES = {"ours": "Occlusion Bake", "ours_avx2": "Occlusion Bake, Blender's Embree", "cycles": "Cycles"}


def measure(chosen: argparse.Namespace) -> dict[str, Any]:
    """In turns: ours with the widest Embree, ours with Blender's own (AVX2 at most), Cycles."""
    blenders = next((path for path in candidates() if "bpy" in Path(path).parts), "")
    narrow = {**os.environ, **({OVERRIDE: blenders} if blenders else {})}
    # In a child all is loaded as for an artist's first press.
    cases = {"ours": lambda _: in_child(ours), "ours_avx2": lambda _: in_child(ours, environment=narrow)}
    found = in_turns({**cases, "cycles": _cycles}, chosen.rounds)
    runs = {name: [seconds for seconds, _ in each] for name, each in found.items()}
    embree = {name: each[-1][1] for name, each in found.items() if each[-1][1]}
    return {"runs": runs, "embree": embree, "blender": bpy.app.version_string, "threads": os.cpu_count()}


def page(result: dict[str, Any]) -> list[str]:
    """The section of the page."""
    rows = []
    for name, times in result["runs"].items():
        median, cycles = statistics.median(times), statistics.median(result["runs"]["cycles"])
        runs = ", ".join(f"{each:.2f}" for each in times)
        rows.append({"name": NAMES[name], "median": median, "runs": runs, "times": cycles / median})
    libraries = [f"{NAMES[name]}: Embree {_short(text)}." for name, text in result["embree"].items()]
    return filled(__file__, object=OBJECT, size=SIZE, rays=RAYS, rows=rows, libraries=libraries, **result)


def _short(description: str) -> str:
    """Without the folder, which says nothing elsewhere."""
    front, _, path = description.rpartition(", ")
    return f"{front}, {Path(path).name}"


def _cycles(_: int) -> list[Any]:
    build("suzanne")
    return [bake_cycles(OBJECT, SIZE, RAYS, seed=0).seconds, ""]


def ours() -> list[object]:
    """The seconds of a first bake, and its Embree."""
    build("suzanne")
    made = bake_here([OBJECT], flat_settings(width=SIZE, height=SIZE, rays=RAYS), with_files=True)
    return [made.seconds, made.embree]
