"""`make bench`: seconds against error of ours and of others, into bench/results/ and bench/RESULTS.md.

python -m occlusion_bake.bench.versus [SCENE|SECTION...] [--classes CLASS...] [--maps MAP...] [--sizes N...]
    [--rounds N] [--models DIR] [--budget SECONDS] [--longest SECONDS] [--fresh] [--write]
    [--quick | --bakers WORD,... --errors E,...]

A check of one scene in minutes, which the page does not take in:

python -m occlusion_bake.bench.versus igea --sizes 1024 --bakers ours,cycles --errors 1/255
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

from ...addon.cli.hard_exit import run_and_exit
from ...core.rays.map_spec import AO
from ...samples.bench_scenes import EVERY
from ..pages import ROOT, run_sections, write_json
from . import check, draft, measure, page, ro, texels, triangles
from .bakers import WORDS
from .cases import MAPS, QUICK_SCENES, QUICK_SIZE, SIZES, Case, cases, is_meant, is_trial
from .choice import PATIENCE
from .classes import CLASSES
from .plot import draw
from .record import FOLDER, KEPT, Record, file_of, read, records

QUICK_BUDGET = 30.0
SECTIONS: dict[str, Any] = {"draft": draft, "ro": ro, "texels": texels, "triangles": triangles}
RESULTS, QUICK_RESULTS = ROOT / "bench" / "RESULTS.md", FOLDER / "QUICK.md"


def main(arguments: Sequence[str]) -> int:
    """Measure what is not there yet of what was asked for, then write the page from whatever is there."""
    return run_sections(_parser(), _names, _measure, _write, arguments, is_meant)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser("python -m occlusion_bake.bench.versus", description="Seconds against error.")
    kinds = [each.name for each in CLASSES]
    parser.add_argument("--classes", nargs="+", choices=kinds, default=[], metavar="CLASS", help=f"{', '.join(kinds)}")
    sizes = f"texels a side, of scenes that have no size of their own ({' '.join(map(str, SIZES))})"
    parser.add_argument("--sizes", type=int, nargs="+", help=sizes)
    parser.add_argument("--maps", nargs="+", choices=MAPS, default=[AO.name], help=f"{', '.join(MAPS)} (ao)")
    budget = "seconds that a reference may take, its rays being halved until it fits (150)"
    parser.add_argument("--budget", type=float, default=150.0, help=budget)
    patience = f"points expected to take more seconds are left out ({PATIENCE:g} budgets)"
    parser.add_argument("--longest", type=float, help=patience)
    quick = f"coarse, once, anew, at {QUICK_SIZE}, what is named, or {' and '.join(QUICK_SCENES)}"
    parser.add_argument("--quick", action="store_true", help=quick)
    words = f"a check of these alone, apart from the page: {','.join(WORDS)}"
    parser.add_argument("--bakers", type=_listed(WORDS.__getitem__, "baker"), metavar="WORD,...", help=words)
    errors = "a check to these errors, as 1/255, apart from the page"
    parser.add_argument("--errors", type=_listed(_error, "error"), metavar="E,...", help=errors)
    parser.add_argument("--fresh", action="store_true", help="measure again what is there")
    return parser


def _listed(meaning: Callable[[str], object], what: str) -> Callable[[str], list[str]]:
    """Words with commas between them, each of which has a meaning."""

    def words(given: str) -> list[str]:
        for word in given.split(","):
            try:
                meaning(word)
            except (KeyError, ValueError, ZeroDivisionError):
                raise argparse.ArgumentTypeError(f"{word}: no such {what}") from None
        return given.split(",")

    return words


def _error(word: str) -> None:
    if "/" not in word or not 0.0 < Fraction(word) < 1.0:
        raise ValueError


def _names(chosen: argparse.Namespace) -> list[str]:
    alone = is_trial(chosen) or chosen.classes or AO.name not in chosen.maps
    return [*(case.name for case in cases(chosen)), *(() if alone else SECTIONS)]


def _measure(name: str, chosen: argparse.Namespace) -> None:
    if chosen.quick:
        chosen.rounds, chosen.fresh, chosen.budget = 1, True, min(chosen.budget, QUICK_BUDGET)
    file = KEPT / f"{name}.json"
    if case := Case.named(name):
        measure.measure(case, chosen)
    elif chosen.fresh or not file.exists():
        write_json(file, SECTIONS[name].measure(chosen))


def _write(chosen: argparse.Namespace) -> None:
    """The page; of a trial what it was of, into a page of its own or on the screen alone."""
    if not is_trial(chosen):
        _write_page()
        return
    found = _of_trial(chosen)
    if not chosen.quick:
        print("\n".join(check.lines_of(found, chosen.errors or ())))
        return
    text = "\n".join(page.lines_of(found, [], trial=True)) + "\n" if found else "nothing was measured\n"
    QUICK_RESULTS.parent.mkdir(parents=True, exist_ok=True)
    QUICK_RESULTS.write_text(text, encoding="utf-8")
    print(text, f"wrote {QUICK_RESULTS}", sep="\n")


def _write_page() -> None:
    found = sorted(records(trial=False), key=lambda record: (record.size, EVERY.index(record.scene)))
    files = {name: KEPT / f"{name}.json" for name in SECTIONS}
    kept = {name: json.loads(file.read_text(encoding="utf-8")) for name, file in files.items() if file.exists()}
    if not found and not kept:
        print("nothing was measured, so nothing is written")
        return
    for record in found:
        if record.is_ao:
            print(f"wrote {draw(record)}")
    sections = [SECTIONS[name].page(result) for name, result in kept.items()]
    RESULTS.write_text("\n".join(page.lines_of(found, sections)) + "\n", encoding="utf-8")
    print(f"wrote {RESULTS}")


def _of_trial(chosen: argparse.Namespace) -> list[Record]:
    """What there is of what was asked for."""
    asked = [
        case
        for case in cases(chosen)
        if not chosen.sections or any(is_meant(case.name, word) for word in chosen.sections)
    ]
    files = [file_of(case, trial=True) for case in asked]
    return [record for record in map(read, filter(lambda file: file.exists(), files)) if record.points]


if __name__ == "__main__":
    run_and_exit(main)
