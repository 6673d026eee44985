"""`make study`: how the estimators converge, measured, drawn and written down in README.md beside this file.

python -m occlusion_bake.bench.study [convergence|running|light|pictures|page ...] [--folder DIR]
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path

from ...addon.cli.hard_exit import run_and_exit
from ...core.base.errors import InputError
from . import convergence, curves, light, page, pictures, running


def main(arguments: Sequence[str]) -> int:
    """The parts asked for, all by default."""
    parser = argparse.ArgumentParser("python -m occlusion_bake.bench.study", description="Measure the estimators.")
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"which: {', '.join(PARTS)} (all)")
    parser.add_argument("--folder", type=Path, default=Path(__file__).parent, help="for the results (beside the code)")
    chosen = parser.parse_args(arguments)
    unknown = [name for name in chosen.parts if name not in PARTS]
    if unknown:
        parser.error(f"{unknown[0]}: no such part; choose from {', '.join(PARTS)}")
    chosen.folder.mkdir(parents=True, exist_ok=True)
    for name in chosen.parts or PARTS:
        print(f"== {name}", flush=True)
        PARTS[name](chosen.folder)
    return 0


def _convergence(folder: Path) -> None:
    convergence.write(convergence.measure(lambda line: print(line, flush=True)), folder / "study.csv")
    curves.draw(convergence.read(folder / "study.csv"), folder)


def _running(folder: Path) -> None:
    running.draw(folder)


def _light(folder: Path) -> None:
    light.draw(folder)


def _pictures(folder: Path) -> None:
    pictures.draw_open(folder)
    pictures.draw_reflections(folder)


def _page(folder: Path) -> None:
    table = folder / "study.csv"
    if not table.exists():
        raise InputError(f"{table}: not there; run the part convergence first")
    text = page.page(convergence.read(table))
    (folder / "README.md").write_text(text, encoding="utf-8")


PARTS: dict[str, Callable[[Path], None]] = {
    "convergence": _convergence,
    "running": _running,
    "light": _light,
    "pictures": _pictures,
    "page": _page,
}

if __name__ == "__main__":
    run_and_exit(main)
