"""Charts where a mesh has no UVs: seconds, count, stretch."""

from __future__ import annotations

import argparse
import statistics
import time
from typing import Any

import bpy

from ..addon.charts.uv_maps import base_triangles
from ..addon.cli.import_file import load
from ..core.charts.unwrap import unwrap

MODELS = ("stanford-bunny.obj", "rocker-arm.obj", "spot.obj")


def measure(chosen: argparse.Namespace) -> dict[str, Any]:
    """Unwrap each model `rounds` times; those that are not there are passed over, aloud."""
    result = {}
    for name in MODELS:
        path = chosen.models / name
        if not path.is_file():
            print(f"SKIPPED {name}: not in {chosen.models}")
            continue
        load(path)
        obj = next(each for each in bpy.data.objects if each.type == "MESH")
        base = base_triangles(bpy.context, obj)
        times = []
        for _ in range(chosen.rounds):
            start = time.perf_counter()
            charts = unwrap(obj.name, base.vertices, base.triangles, base.polygons, size=1024, padding=4)
            times.append(time.perf_counter() - start)
        result[name] = {
            "triangles": len(base.triangles),
            "seconds": times,
            "charts": charts.count,
            "stretch": [charts.stretch.l2, charts.stretch.p95, charts.stretch.area, charts.stretch.angle],
            "utilisation": charts.utilisation,
        }
        print(name, result[name], flush=True)
    return result


def page(result: dict[str, Any]) -> list[str]:
    """The section of the page."""
    lines = [
        "## Charts",
        "",
        "For 1024x1024 with 4 texels between charts. Stretch: 1 is none; L2 after Sander et al. 2001 and the same at "
        "the 95th percentile, then of areas and of angles. Goal: the bunny in 8 s.",
        "",
        "| mesh | triangles | median s | charts | L2 stretch | p95 | area | angle | image used |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for name, row in result.items():
        stretch = " | ".join(f"{each:.3f}" for each in row["stretch"])
        lines.append(
            f"| {name} | {row['triangles']:,} | {statistics.median(row['seconds']):.1f} | {row['charts']} | {stretch} "
            f"| {100.0 * row['utilisation']:.0f} % |"
        )
    return lines
