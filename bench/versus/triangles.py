"""How the time of a ray and the memory grow with the number of triangles. The section `triangles`."""

from __future__ import annotations

import argparse
from typing import Any

from ...samples.bench_scenes import add_net, empty_scene, sculpted
from ...tests.oracles.settings import flat_settings
from ..bake_here import bake_here
from ..pages import filled, machine
from ..sweep import in_child, in_turns, medians, peak_memory

SIDES = {"10 k": 72, "100 k": 225, "1 M": 708, "10 M": 2237}  # points of the net along a side
SIZE, RAYS = 512, 64
GOAL = 4.0  # times as long a ray of the largest as one of the smallest, at most


def measure(chosen: argparse.Namespace) -> dict[str, Any]:
    """Every number of triangles, each in a process of its own."""
    found = {name: in_child(bakes_of, side, chosen.rounds) for name, side in SIDES.items()}
    return {"about": {"machine": machine()}, **found}


def page(result: dict[str, Any]) -> list[str]:
    """The section of the page."""
    found = [result[name] for name in SIDES]
    rows = [{**each, "ns": 1e9 * each["ray"], "times": each["ray"] / found[0]["ray"]} for each in found]
    return filled(__file__, size=SIZE, rays=RAYS, goal=GOAL, rows=rows, **result["about"])


def bakes_of(side: int, rounds: int) -> dict[str, float]:
    """Of a net: seconds of a ray and of a bake, and the memory in GB."""
    add_net(empty_scene(), "Sculpt", sculpted(side))
    before = peak_memory()
    runs = in_turns({"sculpt": _bake}, rounds)["sculpt"]
    return {"triangles": 2 * (side - 1) ** 2, **medians(runs), "before": before, "peak": peak_memory()}


def _bake(_: int) -> dict[str, float]:
    made = bake_here(["Sculpt"], flat_settings(width=SIZE, height=SIZE, rays=RAYS, filtered=False, margin=0))
    return {"ray": made.baked.seconds["trace"] / (RAYS * made.baked.texels), "seconds": made.seconds}
