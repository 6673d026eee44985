"""Peak memory of whole bakes, Blender among it, each in a process of its own."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from ..addon.cli.hard_exit import leave
from ..core.rays.map_spec import AO, reflection
from ..core.settings import Settings
from ..tests.oracles.settings import flat_settings
from .ours import bake_here
from .pages import answer_of, peak_memory
from .versus.scenes import add_net


def measure(chosen: argparse.Namespace) -> dict[str, Any]:
    """Peak resident memory in GB: Blender alone with the scene, and at the end of the bake."""
    result = {}
    for name in _CASES:
        result[name] = answer_of("memory", name)
        print(name, result[name], flush=True)
    return result


def page(result: dict[str, Any]) -> list[str]:
    """The section of the page."""
    lines = [
        "## Peak memory",
        "",
        "Of the whole process, Blender with the scene in it among it.",
        "",
        "| case | before the bake | at its peak | goal |",
        "|---|---|---|---|",
    ]
    rows = ((_CASES[name], before, peak) for name, (before, peak) in result.items())
    return lines + [
        f"| {case.words} | {before:.2f} GB | {peak:.2f} GB | {case.goal:g} GB |" for case, before, peak in rows
    ]


def _grid(name: str, side: int, size: float) -> bpy.types.Object:
    """A wavy sheet of 2 (side - 1)² triangles with UVs."""
    x, y = np.meshgrid(*[np.linspace(0.0, 1.0, side)] * 2)
    points = np.stack([size * x, size * y, 0.02 * size * np.sin(40.0 * x) * np.cos(30.0 * y)], axis=-1)
    return add_net(bpy.context.scene, name, points)


def _dense() -> None:
    _grid("Sheet", 1001, 10.0)


def _instances() -> None:
    """A carrier of 10,000 vertices, on each of which a mesh of 10,000 triangles stands; a ground beneath."""
    _grid("Ground", 2, 100.0)
    carrier = _grid("Carrier", 100, 100.0)
    carrier.instance_type = "VERTS"
    carrier.show_instancer_for_render = False
    child = _grid("Child", 72, 0.6)
    child.parent = carrier
    carrier.location.z = 1.0


def _sheet() -> None:
    _grid("Sheet", 101, 10.0)


@dataclass(frozen=True)
class _Case:
    words: str
    goal: float  # GB
    make: Callable[[], None]
    target: str
    settings: Settings


_BOTH = flat_settings((AO, reflection(10.0)), width=2048, height=2048, rays=4)
_CASES = {
    "dense": _Case("2048x2048, 2 million triangles, AO and RO 10", 2.5, _dense, "Sheet", _BOTH),
    "instances": _Case(
        *("2048x2048, 10,000 instances of 10,082 triangles, AO and RO 10", 1.0, _instances, "Ground", _BOTH)
    ),
    "large": _Case(
        *("8192x8192, all of it used, AO to an error of 1/255", 4.0, _sheet, "Sheet"),
        flat_settings(width=8192, height=8192, error=1 / 255),
    ),
}


def _child(name: str) -> None:
    case = _CASES[name]
    bpy.ops.wm.read_factory_settings(use_empty=True)
    case.make()
    before = peak_memory()
    bake_here([case.target], case.settings)
    print(json.dumps([before, peak_memory()]))


if __name__ == "__main__":
    _child(sys.argv[1])
    leave(0)
