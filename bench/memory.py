"""Peak memory of whole bakes, Blender among it, each in a process of its own."""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import bpy
import numpy as np

from ..addon.leave import leave
from ..core.bake import Settings
from ..core.estimators import AO, reflection
from .ours import bake_here
from .pages import peak_memory
from .versus.scenes import add_net


def measure(chosen: argparse.Namespace) -> dict[str, Any]:
    """Peak resident memory in GB: Blender alone with the scene, and at the end of the bake."""
    result = {}
    for name in _CASES:
        command = [sys.executable, "-m", "occlusion_bake.bench.memory", name]
        answer = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        result[name] = json.loads(answer.splitlines()[-1])
        print(name, result[name], flush=True)
    return result


def page(result: dict[str, Any]) -> list[str]:
    """The section of the page."""
    lines = [
        "## Peak memory",
        "",
        "Of the whole process, Blender with the scene in it among it. Goals: 2.5 GB and 1 GB.",
        "",
        "| case | before the bake | at its peak |",
        "|---|---|---|",
    ]
    return lines + [f"| {_CASES[name][0]} | {row[0]:.2f} GB | {row[1]:.2f} GB |" for name, row in result.items()]


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


_CASES: dict[str, tuple[str, Callable[[], None], str]] = {
    "dense": ("2048x2048, 2 million triangles, AO and RO 10", _dense, "Sheet"),
    "instances": ("2048x2048, 10,000 instances of 10,082 triangles, AO and RO 10", _instances, "Ground"),
}


def _child(name: str) -> None:
    _, make, target = _CASES[name]
    bpy.ops.wm.read_factory_settings(use_empty=True)
    make()
    before = peak_memory()
    bake_here([target], Settings((AO, reflection(10.0)), 2048, 2048, 4))
    print(json.dumps([before, peak_memory()]))


if __name__ == "__main__":
    _child(sys.argv[1])
    leave(0)
