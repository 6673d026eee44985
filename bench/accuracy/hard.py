"""All hard cases with Cycles beside: docs/hard_cases.md and a picture each.

python -m occlusion_bake.bench.accuracy.hard [CASE...]   (a part of a name will do; the others' lines stay)
"""

from __future__ import annotations

import argparse
import json
import re
from dataclasses import replace
from typing import Any

import bpy
import numpy as np

from ...addon.cli.hard_exit import leave
from ...addon.compare.cycles import CyclesBake, CyclesSettings, bake_ao
from ...core.base.arrays import Floats
from ...core.base.version import version
from ...core.finish.baked import BakedMap
from ...core.finish.compare import comparison_image
from ...core.finish.image_file import write_image
from ...core.maps.occlusion import AMBIENT
from ...core.solve.goal import Goal
from ...tests.oracles.hard.beside import against, converged_twin, from_blender
from ...tests.oracles.hard.blender import open_scene
from ...tests.oracles.hard.case import Case, judge, settings_of
from ...tests.oracles.hard.catalogue import CASES
from ...tests.oracles.hard.tiles import in_one_image, together
from ..bake_here import bake_here
from ..pages import ROOT, filled, write_json
from ..tables import table
from .command import run_alone

RESULT = ROOT / "build" / "accuracy" / "hard.json"
PAGE = ROOT / "docs" / "hard_cases.md"
PICTURES = ROOT / "docs" / "pictures" / "truth" / "hard"
RAYS, MANY_RAYS, THREADS = 256, 4096, 2
COLUMNS = ("case", "what is right", "Cycles", "ours", "inside", "picture")


def measure(chosen: argparse.Namespace) -> dict[str, Any]:
    """Every case, or those of `chosen.names`: ours by its seeds, Cycles by one bake, a picture of both.

    What was measured before of the others goes with them.
    """
    rows = json.loads(RESULT.read_text(encoding="utf-8"))["cases"] if RESULT.exists() else {}
    for case in CASES:
        if any(word in case.name for word in chosen.names or [""]):
            rows[case.name] = _row(case)
            print(case.name, rows[case.name], flush=True)
    return {"cases": rows, "blender": bpy.app.version_string}


def _row(case: Case) -> dict[str, Any]:
    """Ours as the button bakes it, from Blender's file."""
    judged = judge(case)
    right = judged.right if case.twin is None else converged_twin(case, MANY_RAYS)
    name = open_scene(in_one_image(case.build(), case.tiles), displaced=case.displaced)
    cycles = bake_ao(bpy.context, bpy.data.objects[name], CyclesSettings(case.size, RAYS, case.distance, THREADS, 0))
    name = open_scene(case.build(), displaced=case.displaced)
    results = bake_here([name], replace(settings_of(case), goal=Goal(RAYS), maps=(AMBIENT,))).results
    baked = together([part for _, part in results], case.tiles)
    ours = baked.maps["ao"]
    PICTURES.mkdir(parents=True, exist_ok=True)
    write_image(PICTURES / f"{slug(case.name)}.png", _panels(ours, cycles), depth=8)
    return {
        "texels": int(np.count_nonzero(judged.view.covered)),
        "inside": baked.surface.interior,
        "complaints": [*judged.complaints, *from_blender(judged, ours, RAYS)],
        "bits": case.bits,
        "ours": against(right, ours.values, ours.covered, judged.view.covered, RAYS),
        "cycles": against(right, cycles.values, cycles.coverage, judged.view.covered, RAYS),
    }


def _panels(ours: BakedMap, cycles: CyclesBake) -> Floats:
    """Ours whole; Cycles and the difference where it baked, or ours alone."""
    alone = comparison_image(ours.values, ours.values, ours.covered)
    first = alone.shape[1] // 3
    both = ours.covered & cycles.coverage
    if not both.any():
        return alone[:, :first]
    panels = comparison_image(ours.values, cycles.values, both)
    panels[:, :first] = alone[:, :first]
    return panels


def slug(name: str) -> str:
    """A case's name as a file's."""
    return re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_")


def page(result: dict[str, Any]) -> list[str]:
    """The whole page."""
    rows = [_cells(case, result["cases"][case.name]) for case in CASES if case.name in result["cases"]]
    about = {"version": version(), "blender": result["blender"], "rays": RAYS}
    return filled(__file__, **about, cases=table(COLUMNS, rows))


def _cells(case: Case, row: dict[str, Any]) -> list[str]:
    cycles, ours = _figures(row["cycles"]), _figures(row["ours"])
    if row["cycles"]["missing"]:
        cycles += f"; {row['cycles']['missing']} of {row['texels']} texels left out"
    if case.cycles:
        cycles += f". {case.cycles}"
    if case.bits and not row["complaints"]:
        ours += "; same bits"
    ours = "; ".join([ours, *row["complaints"]])
    shown = f"[picture](pictures/truth/hard/{slug(case.name)}.png)"
    return [case.name, case.right, cycles, ours, f"{100.0 * row['inside']:.0f} %", shown]


def _figures(row: dict[str, Any]) -> str:
    if "bias" not in row:
        return "nothing baked"
    speckled = f", {row['speckles']} dark speckles" if row["speckles"] else ""
    return f"mean {row['mean']:.4f}, bias {row['bias']:+.4f}, RMSE {row['rmse']:.4f}{speckled}"


if __name__ == "__main__":
    found = run_alone("hard", (case.name for case in CASES), measure, page)
    write_json(RESULT, found)
    PAGE.write_text("\n".join(page(found)) + "\n", encoding="utf-8")
    leave(0)
