"""`make bench`: seconds against error of ours and of others, into bench/results/ and bench/RESULTS.md.

python -m occlusion_bake.bench.versus [SCENE|SECTION...] [--sizes N...] [--rounds N] [--models DIR] [--budget SECONDS]
    [--quick] [--fresh] [--write]
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from typing import Any

from ...addon.cli.hard_exit import run_and_exit
from ...samples.bench_scenes import MODELS, SCENES, names
from ..pages import ROOT, run_sections, write_json
from . import draft, measure, page, ro, texels, triangles
from .plot import draw
from .record import FOLDER, KEPT, records

QUICK_SCENES, QUICK_SIZE, QUICK_BUDGET = ("suzanne", "gaps"), 256, 30.0
SECTIONS: dict[str, Any] = {"draft": draft, "ro": ro, "texels": texels, "triangles": triangles}
RESULTS, QUICK_RESULTS = ROOT / "bench" / "RESULTS.md", FOLDER / "QUICK.md"


def main(arguments: Sequence[str]) -> int:
    """Measure what is not there yet of what was asked for, then write the page from whatever is there."""
    parser = argparse.ArgumentParser("python -m occlusion_bake.bench.versus", description="Seconds against error.")
    parser.add_argument("--sizes", type=int, nargs="+", default=[512, 1024], help="texels a side (512 1024)")
    patience = f"points expected to take {measure.PATIENCE:g} times as long are left out (150)"
    budget = f"seconds that a reference may take, its rays being halved until it fits; {patience}"
    parser.add_argument("--budget", type=float, default=150.0, help=budget)
    quick = f"{' and '.join(QUICK_SCENES)} at {QUICK_SIZE}, coarse, once, anew"
    parser.add_argument("--quick", action="store_true", help=quick)
    parser.add_argument("--fresh", action="store_true", help="measure again what is there")
    return run_sections(parser, _names, _measure, _write, arguments)


def _names(chosen: argparse.Namespace) -> list[str]:
    if chosen.quick:
        return [f"{scene}_{QUICK_SIZE}" for scene in QUICK_SCENES]
    return [*(f"{scene}_{size}" for size in chosen.sizes for scene in names(chosen.models)), *SECTIONS]


def _measure(name: str, chosen: argparse.Namespace) -> None:
    if chosen.quick:
        chosen.rounds, chosen.fresh, chosen.budget = 1, True, min(chosen.budget, QUICK_BUDGET)
    file = KEPT / f"{name}.json"
    if name not in SECTIONS:
        scene, _, size = name.rpartition("_")
        measure.measure(scene, int(size), chosen)
    elif chosen.fresh or not file.exists():
        write_json(file, SECTIONS[name].measure(chosen))


def _write(chosen: argparse.Namespace) -> None:
    """The page; pictures too, but of a quick run, which says too little."""
    order = [*SCENES, *MODELS]
    found = sorted(records(quick=chosen.quick), key=lambda record: (record.size, order.index(record.scene)))
    files = {name: KEPT / f"{name}.json" for name in SECTIONS if not chosen.quick}
    kept = {name: json.loads(file.read_text(encoding="utf-8")) for name, file in files.items() if file.exists()}
    if not found and not kept:
        print("nothing was measured, so nothing is written")
        return
    for record in found if not chosen.quick else ():
        print(f"wrote {draw(record)}")
    sections = [SECTIONS[name].page(result) for name, result in kept.items()]
    text = "\n".join(page.lines_of(found, sections, pictures=not chosen.quick)) + "\n"
    path = QUICK_RESULTS if chosen.quick else RESULTS
    path.write_text(text, encoding="utf-8")
    print(text if chosen.quick else "", f"wrote {path}", sep="\n")


if __name__ == "__main__":
    run_and_exit(main)
