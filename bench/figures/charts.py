"""Charts where a mesh has no UVs: seconds, count, stretch."""

from __future__ import annotations

import argparse
import statistics
import time
from typing import Any

import bpy

from ...addon.charts.base_mesh import base_triangles
from ...core.charts.unwrap import unwrap
from ...samples.bench_scenes import MODELS, build
from ..pages import filled


def measure(chosen: argparse.Namespace) -> dict[str, Any]:
    """Those models that are there."""
    there = {name: file for name, file in MODELS.items() if (chosen.models / file).is_file()}
    return {file: _measure(build(name, chosen.models).targets[0], chosen.rounds) for name, file in there.items()}


def _measure(name: str, rounds: int) -> dict[str, Any]:
    base = base_triangles(bpy.context, bpy.data.objects[name])
    times = []
    for _ in range(rounds):
        start = time.perf_counter()
        charts = unwrap(name, base.vertices, base.triangles, base.polygons, size=1024, padding=4)
        times.append(time.perf_counter() - start)
    stretch = [charts.stretch.l2, charts.stretch.p95, charts.stretch.area, charts.stretch.angle]
    about = {"triangles": len(base.triangles), "charts": charts.count, "utilisation": charts.utilisation}
    return {**about, "seconds": times, "stretch": stretch}


def page(result: dict[str, Any]) -> list[str]:
    """The section of the page."""
    return filled(__file__, rows=[{**found, "mesh": file, **_told(found)} for file, found in result.items()])


def _told(found: dict[str, Any]) -> dict[str, float]:
    return {"median": statistics.median(found["seconds"]), "percent": 100.0 * found["utilisation"]}
