"""How the time of a ray and the memory grow with the number of triangles. The section `triangles`."""

from __future__ import annotations

import argparse
import json
import statistics
import sys
from typing import Any

import bpy

from ...addon.cli.hard_exit import leave
from ...tests.oracles.settings import flat_settings
from ..ours import bake_here
from ..pages import answer_of, machine, peak_memory
from .scenes import add_net, sculpted
from .store import Rows

SIDES = {"10 k": 72, "100 k": 225, "1 M": 708, "10 M": 2237}  # points of the net along a side
SIZE, RAYS = 512, 64
GOAL = 4.0  # times as long a ray of the largest as one of the smallest, at most


def measure(chosen: argparse.Namespace, rows: Rows) -> None:
    """Every number of triangles, each in a process of its own."""
    rows.add("about", lambda: {"machine": machine()})
    for name, side in SIDES.items():
        rows.add(name, lambda side=side: _in_child(side, chosen.rounds))


def page(rows: dict[str, Any]) -> list[str]:
    """The section of the page."""
    lines = [
        "## Triangles",
        "",
        f"The sculpt of the scene `sculpt` from nets of more and more points, {SIZE}x{SIZE}, {RAYS} rays, plain: the "
        "trace stage over its rays. Goal: a ray among 10 million triangles takes at most "
        f"{GOAL:g} times as long as among 10 thousand. Memory: of the whole process, Blender with the scene among it.",
        "",
        "| triangles | ns a ray | times as long as 10 k | s in all | memory before the bake | at its peak |",
        "|---|---|---|---|---|---|",
    ]
    first = rows.get(next(iter(SIDES)))
    for name in SIDES:
        if row := rows.get(name):
            ratio = f"{row['ray'] / first['ray']:.2f}" if first else "–"
            lines.append(
                f"| {row['triangles']:,} | {1e9 * row['ray']:.1f} | {ratio} | {row['seconds']:.2f} "
                f"| {row['before']:.2f} GB | {row['peak']:.2f} GB |"
            )
    return [*lines, "", f"On {rows['about']['machine']}."]


def _in_child(side: int, rounds: int) -> Any:
    return answer_of("versus.triangles", side, rounds)


def _child(side: int, rounds: int) -> None:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    add_net(bpy.context.scene, "Sculpt", sculpted(side))
    before, rays, totals = peak_memory(), [], []
    settings = flat_settings(width=SIZE, height=SIZE, rays=RAYS, filtered=False, margin=0)
    for _ in range(rounds):
        seconds, results, _ = bake_here(["Sculpt"], settings)
        baked = results[0][1]
        rays.append(baked.seconds["trace"] / (RAYS * baked.texels))
        totals.append(seconds)
    found = {"triangles": 2 * (side - 1) ** 2, "ray": statistics.median(rays), "seconds": statistics.median(totals)}
    print(json.dumps({**found, "before": before, "peak": peak_memory()}))


if __name__ == "__main__":
    _child(*map(int, sys.argv[1:]))
    leave(0)
