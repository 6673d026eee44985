"""All hard cases with Cycles beside: docs/hard_cases.md and a picture each.

python -m occlusion_bake.bench.truth.hard.measure [CASE...]   (a part of a name will do)
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import bpy
import numpy as np

from ....addon.cli.hard_exit import leave
from ....addon.compare.cycles import CyclesBake, CyclesSettings, bake_ao
from ....core.bake import bake
from ....core.base.arrays import Doubles, Floats
from ....core.base.version import version
from ....core.finish.baked import BakedMap
from ....core.finish.compare import comparison_image
from ....core.finish.image_file import write_image
from ....core.maps.occlusion import AMBIENT
from ....core.solve.solver import Goal
from ...ours import bake_here
from ...pages import ROOT
from .blender import open_scene
from .case import SIGMAS, TWIN_SEED, Bools, Case, Judged, judge, settings_of, speckles
from .catalogue import CASES

RESULT = ROOT / "build" / "accuracy" / "hard.json"
PAGE = ROOT / "docs" / "hard_cases.md"
PICTURES = ROOT / "docs" / "pictures" / "truth" / "hard"
RAYS, MANY_RAYS, THREADS = 256, 4096, 2


def measure(chosen: argparse.Namespace) -> dict[str, Any]:
    """Every case, or those of `chosen.cases`: ours by its seeds, Cycles by one bake, a picture of both."""
    wanted = getattr(chosen, "cases", None) or [""]
    rows = {}
    for case in CASES:
        if any(word in case.name for word in wanted):
            rows[case.name] = _row(case)
            print(case.name, rows[case.name], flush=True)
    return {"cases": rows, "blender": bpy.app.version_string}


def _row(case: Case) -> dict[str, Any]:
    """Ours as the button bakes it, from Blender's file."""
    judged = judge(case)
    right = judged.right if case.twin is None else _converged(case)
    name = open_scene(case.build())
    cycles = bake_ao(bpy.context, name, CyclesSettings(case.size, RAYS, case.distance, THREADS, 0))
    baked = bake_here([name], replace(settings_of(case), goal=Goal(RAYS), maps=(AMBIENT,)))[1][0][1]
    ours = baked.maps["ao"]
    PICTURES.mkdir(parents=True, exist_ok=True)
    write_image(PICTURES / f"{slug(case.name)}.png", _panels(ours, cycles), depth=8)
    return {
        "texels": int(np.count_nonzero(judged.view.covered)),
        "inside": baked.surface.interior,
        "complaints": [*judged.complaints, *_from_blender(judged, ours)],
        "bits": case.bits,
        "ours": _against(right, ours.values, ours.covered, judged.view.covered),
        "cycles": _against(right, cycles.values, cycles.coverage, judged.view.covered),
        "cycles_of_ours": _against(ours.values, cycles.values, cycles.coverage, ours.covered),
    }


def _converged(case: Case) -> Doubles:
    """The clean twin with many rays, for the figures: the judgement's has as few as the case."""
    assert case.twin is not None
    settings = replace(settings_of(case, TWIN_SEED, case.twin_distance), goal=Goal(MANY_RAYS))
    (baked,) = bake(case.twin(), settings)
    return case.from_twin(baked.maps["ao"].values.astype(np.float64))


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


def _against(right: Any, values: Floats, covered: Bools, owned: Bools) -> dict[str, Any]:
    """Mean, bias and RMSE against what is right, where it is known; texels without a value; dark speckles."""
    known = covered & owned & np.isfinite(right)
    row: dict[str, Any] = {
        "missing": int(np.count_nonzero(owned & ~covered)),
        "speckles": int(np.count_nonzero(speckles(values.astype(np.float64), covered & owned, RAYS))),
    }
    if known.any():
        difference = values[known].astype(np.float64) - right[known]
        row["mean"] = float(values[known].mean(dtype=np.float64))
        row["bias"] = float(difference.mean())
        row["rmse"] = float(np.sqrt(np.mean(difference**2)))
    return row


def _from_blender(judged: Judged, made: BakedMap) -> list[str]:
    """What the bake of Blender's file has other than the bakes of the arrays, beyond noise."""
    if not np.array_equal(made.covered, judged.view.covered):
        return [f"from Blender {np.count_nonzero(made.covered)} texels"]
    sure = judged.ours[made.covered]
    share = (sure * judged.rays + 1.0) / (judged.rays + 2.0)
    bound = SIGMAS * np.sqrt(share * (1.0 - share) * (1.0 / RAYS + 1.0 / judged.rays)) + 0.01
    beyond = np.count_nonzero(np.abs(made.values[made.covered] - sure) > bound)
    return [f"from Blender {beyond} texels differ"] if beyond else []


def slug(name: str) -> str:
    """A case's name as a file's."""
    return re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_")


def page(result: dict[str, Any]) -> list[str]:
    """The whole page."""
    lines = [
        "# Hard cases",
        "",
        f"Occlusion Bake {version()} beside Cycles (Blender {result['blender']}, {RAYS} samples). Written by "
        "`make accuracy VENV=.venv-3.13`; `make test` holds ours to it.",
        "",
        f"Values are visibility: 1 open, 0 closed. Both with {RAYS} rays, no filter; ours baked from Blender's file as "
        "the button does it. Bias and RMSE are against what is right, where that is known, noise included. What is "
        "right is exact, or a clean twin of the case; *same bits*: bakes of the case and of its twin were compared bit "
        "for bit. *Left out*: texels that the mesh covers in part and Cycles does not bake. *Inside*: the share of "
        "texels that start inside another mesh, as the bake reports it. In the pictures: ours, Cycles, the difference.",
        "",
        "| case | what is right | Cycles | ours | inside | picture |",
        "|---|---|---|---|---|---|",
    ]
    for case in CASES:
        if case.name in result["cases"]:
            lines.append(_line(case, result["cases"][case.name]))
    return lines


def _line(case: Case, row: dict[str, Any]) -> str:
    cycles, ours = _figures(row["cycles"]), _figures(row["ours"])
    if row["cycles"]["missing"]:
        cycles += f"; {row['cycles']['missing']} of {row['texels']} texels left out"
    if case.cycles:
        cycles += f". {case.cycles}"
    if case.bits and not row["complaints"]:
        ours += "; same bits"
    ours = "; ".join([ours, *row["complaints"]])
    inside = f"{100.0 * row['inside']:.0f} %"
    shown = f"[picture](pictures/truth/hard/{slug(case.name)}.png)"
    return f"| {case.name} | {case.right} | {cycles} | {ours} | {inside} | {shown} |"


def _figures(row: dict[str, Any]) -> str:
    if "bias" not in row:
        return "nothing baked"
    speckled = f", {row['speckles']} dark speckles" if row["speckles"] else ""
    return f"mean {row['mean']:.4f}, bias {row['bias']:+.4f}, RMSE {row['rmse']:.4f}{speckled}"


def main(arguments: Sequence[str]) -> int:
    """Measure, and write the page; with some cases alone, only their lines change."""
    parser = argparse.ArgumentParser("python -m occlusion_bake.bench.truth.hard.measure")
    parser.add_argument("cases", nargs="*", metavar="CASE", help="part of a case's name (all)")
    result = measure(parser.parse_args(arguments))
    if RESULT.exists():
        kept = json.loads(RESULT.read_text(encoding="utf-8"))["cases"]
        result["cases"] = {**kept, **result["cases"]}
    RESULT.parent.mkdir(parents=True, exist_ok=True)
    RESULT.write_text(json.dumps(result, indent=1), encoding="utf-8")
    PAGE.write_text("\n".join(page(result)) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    leave(main(sys.argv[1:]))
