"""What one object costs at 2048², by kind, and a hundred thousand such. The section `objects`."""

from __future__ import annotations

import argparse
import os
import statistics
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from ...core.finish.map_files import Folder
from ...core.maps.bent_normals import BentNormalMap, Space
from ...core.options.values import told_by_images
from ...core.rays.map_spec import AO, reflection
from ...core.settings import QUALITIES
from ...samples.bench_scenes import build
from ...tests.oracles.settings import flat_settings
from ..bake_here import bake_here
from ..pages import filled
from ..sweep import in_child
from .level import size_of

KINDS = ("suzanne", "part", "spot", "bunny", "rocker", "igea", "character")
SIZE, LEVEL = 2048, 100_000
BLENDER_STARTS = 5.0  # seconds; from a slow disk more
WAYS: dict[str, dict[str, Any]] = {
    "draft": {"error": QUALITIES["draft"]},
    "ao": {},
    "three": {"maps": (AO, reflection(10.0)), "bent": BentNormalMap(Space.OBJECT)},
}
CHUNKS = (1, 10, 50, 100, 500)  # items a task


def measure(chosen: argparse.Namespace) -> dict[str, Any]:
    """Every kind in a process of its own, the second bake of each way."""
    rows = [{"name": name, **in_child(costs_of, name, str(chosen.models))} for name in KINDS]
    return {"cores": os.cpu_count(), "rows": rows}


def costs_of(name: str, models: str) -> dict[str, float]:
    """Seconds, and bytes of the files: of each way to bake."""
    target = build(name, Path(models)).targets[0]
    found: dict[str, float] = {}
    for way, options in WAYS.items():
        settings = flat_settings(width=SIZE, height=SIZE, **{"error": QUALITIES["good"], **options})
        for _ in range(2):
            made = bake_here([target], settings, with_files=True)
        with TemporaryDirectory() as place:
            Folder(Path(place)).write(made.baked, told_by_images(settings), "made")
            found |= {f"{way}_seconds": made.seconds, f"{way}_bytes": float(size_of(Path(place)))}
    return found


def page(result: dict[str, Any]) -> list[str]:
    """The section of the page."""
    rows = [{**each, **{f"{way}_mb": each[f"{way}_bytes"] / 1e6 for way in WAYS}} for each in result["rows"]]
    mean = {name: statistics.fmean(each[name] for each in rows) for name in rows[0] if name != "name"}
    seconds = mean["three_seconds"]
    chunks = [
        {
            "items": items,
            "tasks": LEVEL // items,
            "minutes": (BLENDER_STARTS + items * seconds) / 60.0,
            "share": 100.0 * BLENDER_STARTS / (BLENDER_STARTS + items * seconds),
        }
        for items in CHUNKS
    ]
    costs = {f"{way}_hours": mean[f"{way}_seconds"] * LEVEL * result["cores"] / 3600.0 for way in WAYS}
    costs |= {f"{way}_tb": mean[f"{way}_bytes"] * LEVEL / 1e12 for way in WAYS}
    lost = BLENDER_STARTS + 0.5 * seconds
    told = {
        "cores": result["cores"],
        "size": SIZE,
        "level": LEVEL,
        "start": BLENDER_STARTS,
        "lost": lost,
        "per_hour": lost / 36.0,
    }
    return filled(__file__, rows=rows, chunks=chunks, **told, **costs)
