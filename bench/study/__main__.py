"""`make study`: how the estimators converge, measured, drawn and written down in README.md beside this file.

python -m occlusion_bake.bench.study [convergence|running|light|pictures|page ...] [--folder DIR]
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path

from ...addon.cli.hard_exit import run_and_exit
from . import curves, light, page, pictures, running

PARTS: dict[str, Callable[[Path], None]] = {
    "convergence": curves.draw,
    "running": running.draw,
    "light": light.draw,
    "pictures": pictures.draw,
    "page": page.write,
}


def main(arguments: Sequence[str]) -> int:
    """The parts asked for, all by default."""
    parser = argparse.ArgumentParser("python -m occlusion_bake.bench.study", description="Measure the estimators.")
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"which: {', '.join(PARTS)} (all)")
    parser.add_argument("--folder", type=Path, default=Path(__file__).parent, help="for the results (beside the code)")
    chosen = parser.parse_args(arguments)
    for unknown in (name for name in chosen.parts if name not in PARTS):
        parser.error(f"{unknown}: no such part; choose from {', '.join(PARTS)}")
    chosen.folder.mkdir(parents=True, exist_ok=True)
    for name in chosen.parts or PARTS:
        print(f"== {name}", flush=True)
        PARTS[name](chosen.folder)
    return 0


if __name__ == "__main__":
    run_and_exit(main)
