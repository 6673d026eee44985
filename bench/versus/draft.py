"""How long a first look takes: a light object, Draft, beside Cycles with one sample. The section `draft`."""

from __future__ import annotations

import argparse
import os
import statistics
import tempfile
from pathlib import Path
from typing import Any

import bpy

from ...addon.compare.cycles import CyclesSettings, bake_ao
from ...core.settings import QUALITIES
from ...tests.oracles.settings import flat_settings
from ..ours import bake_here
from ..pages import machine
from .store import Rows

SIZE, NAME = 512, "Ball"
SHARE, ALLOWANCE = 0.25, 0.15  # the goal: at most this share of Cycles' seconds, and so many seconds
LEAST_ROUNDS = 9  # they are short


def measure(chosen: argparse.Namespace, rows: Rows) -> None:
    """In turns, after one bake of each that loads libraries."""
    rows.add("about", lambda: {"machine": machine()})
    rows.add("seconds", lambda: _measure(max(chosen.rounds, LEAST_ROUNDS)))


def page(rows: dict[str, Any]) -> list[str]:
    """The section of the page."""
    found = rows["seconds"]
    ours, cycles = found["ours"], found["cycles"]
    goal = SHARE * cycles + ALLOWANCE
    return [
        "## A first look",
        "",
        f"A ball of {found['triangles']:,} triangles on a plane, {SIZE}x{SIZE}, Draft: {ours:.3f} s from the button to "
        f"the texture (median of {found['rounds']}), error {found['error']:.4f}. Cycles' operator with 1 sample: "
        f"{cycles:.3f} s. Goal: {SHARE:g} of that and {ALLOWANCE:g} s, {goal:.3f} s.",
        "",
        f"On {rows['about']['machine']}.",
    ]


def _measure(rounds: int) -> dict[str, Any]:
    triangles = _build()
    settings = flat_settings(width=SIZE, height=SIZE, error=QUALITIES["draft"])
    ours, cycles, errors = [], [], []
    with tempfile.TemporaryDirectory() as folder:
        for turn in range(rounds + 1):
            seconds, results, _ = bake_here([NAME], settings, Path(folder))
            shot = bake_ao(bpy.context, NAME, CyclesSettings((SIZE, SIZE), 1, None, os.cpu_count() or 1, turn))
            if turn:
                ours.append(seconds)
                cycles.append(shot.seconds)
                errors.append(results[0][1].maps["ao"].error)
    medians = {"ours": statistics.median(ours), "cycles": statistics.median(cycles)}
    return {**medians, "error": statistics.median(errors), "rounds": rounds, "triangles": triangles}


def _build() -> int:
    """A UV sphere of about a thousand triangles that rests on a plane; how many."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=32, ring_count=17, location=(0.0, 0.0, 1.0))
    mesh = bpy.context.object.data
    bpy.context.object.name = NAME
    bpy.ops.mesh.primitive_plane_add(size=8.0)
    mesh.calc_loop_triangles()
    return len(mesh.loop_triangles)
