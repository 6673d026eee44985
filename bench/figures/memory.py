"""Peak memory of whole bakes, Blender among it, each in a process of its own."""

from __future__ import annotations

import argparse
from typing import Any

from ...core.rays.map_spec import AO, reflection
from ...samples.bench_scenes import add_sheet, add_sheets_on_vertices, empty_scene
from ...tests.oracles.settings import flat_settings
from ..bake_here import bake_here
from ..pages import filled
from ..sweep import in_child, peak_memory

CASES = {  # what it is, and the goal, GB
    "dense": ("2048x2048, 2 million triangles, AO and RO 10", 2.5),
    "instances": ("2048x2048, 10,000 instances of 10,082 triangles, AO and RO 10", 1.0),
    "large": ("8192x8192, all of it used, AO to an error of 1/255", 4.0),
}


def measure(chosen: argparse.Namespace) -> dict[str, Any]:
    """Peak resident memory in GB: Blender alone with the scene, and at the end of the bake."""
    return {name: in_child(peaks, name) for name in CASES}


def page(result: dict[str, Any]) -> list[str]:
    """The section of the page."""
    return filled(__file__, rows=[(*CASES[name], before, peak) for name, (before, peak) in result.items()])


def peaks(name: str) -> list[float]:
    """Before the bake and after it."""
    scene = empty_scene()
    if name == "instances":
        target = add_sheets_on_vertices(scene)
    else:
        target = add_sheet(scene, "Sheet", 1001 if name == "dense" else 101, 10.0)
    settings = flat_settings((AO, reflection(10.0)), width=2048, height=2048, rays=4)
    if name == "large":
        settings = flat_settings(width=8192, height=8192, error=1 / 255)
    before = peak_memory()
    bake_here([target.name], settings)
    return [before, peak_memory()]
