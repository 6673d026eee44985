"""`make bench`: seconds against error of ours and of others, into bench/results/ and bench/RESULTS.md.

python -m occlusion_bake.bench.versus [SCENE|SECTION...] [--size N] [--headline N] [--rounds N] [--models DIR]
    [--budget SECONDS] [--quick] [--fresh] [--write]
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from ...addon.cli.hard_exit import run_and_exit
from ...core.base.errors import InputError
from ..pages import MODELS, ROOT
from . import draft, measure, page, reflections, texels, triangles
from .plots import draw
from .scenes import MODELS as MODEL_FILES
from .scenes import SCENES, names
from .store import FOLDER, Rows, records
from .tables import write_table

HEADLINE = "suzanne"  # measured at --headline, too
QUICK_SCENES, QUICK_SIZE, QUICK_ROUNDS, QUICK_BUDGET = ("suzanne", "gaps"), 256, 1, 30.0
SECTIONS = {"draft": draft, "ro": reflections, "texels": texels, "triangles": triangles}
RESULTS, QUICK_RESULTS = ROOT / "bench" / "RESULTS.md", FOLDER / "QUICK.md"


def main(arguments: Sequence[str]) -> int:
    """Measure what was asked for, each in a process of its own, then write the page from whatever is there."""
    chosen = _parser().parse_args(arguments)
    if chosen.quick:
        chosen.size, chosen.headline, chosen.rounds, chosen.fresh = QUICK_SIZE, 0, QUICK_ROUNDS, True
        chosen.budget = min(chosen.budget, QUICK_BUDGET)
    known = [*SCENES, *MODEL_FILES, *SECTIONS]
    if unknown := [name for name in chosen.names if name not in known]:
        raise InputError(f"{unknown[0]}: no such scene or section; choose from {', '.join(known)}")
    if chosen.here:
        _measure_here(chosen.names[0], chosen)
        return 0
    failed = [] if chosen.write else [job for job in _jobs(chosen) if not _in_child(*job, chosen)]
    _write(chosen.quick)
    for name, size in failed:
        print(f"FAILED {name} at {size}: what was measured of it before is on the page", file=sys.stderr)
    return 1 if failed else 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser("python -m occlusion_bake.bench.versus", description="Seconds against error.")
    every = ", ".join([*SCENES, *MODEL_FILES, *SECTIONS])
    parser.add_argument("names", nargs="*", metavar="SCENE|SECTION", help=f"which: {every} (all)")
    parser.add_argument("--size", type=int, default=512, help="texels a side (512)")
    parser.add_argument("--headline", type=int, default=1024, help=f"and of {HEADLINE}; 0: not (1024)")
    parser.add_argument("--rounds", type=int, default=3, help="runs of each point of at most a minute (3)")
    parser.add_argument("--models", type=Path, default=MODELS, help="folder of .obj models")
    parser.add_argument(
        "--budget",
        type=float,
        default=150.0,
        help="seconds that a reference may take, its rays being halved until it fits; points expected to take "
        f"{measure.PATIENCE:g} times as long are left out (150)",
    )
    parser.add_argument(
        "--quick", action="store_true", help=f"{' and '.join(QUICK_SCENES)} at {QUICK_SIZE}, coarse, anew"
    )
    parser.add_argument("--fresh", action="store_true", help="measure again what is there")
    parser.add_argument("--write", action="store_true", help="write the page alone, from the results that are there")
    parser.add_argument("--here", action="store_true", help=argparse.SUPPRESS)
    return parser


def _jobs(chosen: argparse.Namespace) -> list[tuple[str, int]]:
    """Names and sizes. The headline comes right after its scene."""
    default = QUICK_SCENES if chosen.quick else (*names(chosen.models), *SECTIONS)
    jobs = []
    for name in chosen.names or default:
        jobs.append((name, chosen.size))
        if name == HEADLINE and chosen.headline not in (0, chosen.size):
            jobs.append((name, chosen.headline))
    return jobs


def _in_child(name: str, size: int, chosen: argparse.Namespace) -> bool:
    """Measure in a fresh process. Returns whether it ended well."""
    print(f"== {name}, {size}x{size}" if name not in SECTIONS else f"== {name}", flush=True)
    options = ["--size", size, "--rounds", chosen.rounds, "--models", chosen.models, "--budget", chosen.budget]
    flags = [flag for flag, on in (("--quick", chosen.quick), ("--fresh", chosen.fresh)) if on]
    command = [sys.executable, "-m", "occlusion_bake.bench.versus", name, *map(str, options), *flags, "--here"]
    return subprocess.run(command, check=False).returncode == 0


def _measure_here(name: str, chosen: argparse.Namespace) -> None:
    if name in SECTIONS:
        SECTIONS[name].measure(chosen, Rows(name, chosen.fresh))
    else:
        measure.measure(name, chosen.size, chosen)


def _write(quick: bool) -> None:
    """The page; tables and pictures too, but of a quick run, which says too little."""
    found = sorted(records(quick=quick), key=lambda record: (record.size, _place(record.scene)))
    kept = {name: Rows(name).values for name in SECTIONS}
    sections = [] if quick else [SECTIONS[name].page(rows) for name, rows in kept.items() if rows]
    if not found and not sections:
        print("nothing was measured, so nothing is written")
        return
    for record in found if not quick else ():
        print(f"wrote {write_table(record)} and {draw(record)}")
    path = QUICK_RESULTS if quick else RESULTS
    text = "\n".join(page.lines_of(found, sections, pictures=not quick)) + "\n"
    path.write_text(text, encoding="utf-8")
    print(text if quick else "", f"wrote {path}", sep="\n")


def _place(scene: str) -> int:
    return [*SCENES, *MODEL_FILES].index(scene)


if __name__ == "__main__":
    run_and_exit(main)
