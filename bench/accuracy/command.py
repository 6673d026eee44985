"""The command of one section, which measures a part of it."""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from ..pages import MODELS, Measure, Write


def run_alone(section: str, names: Iterable[str], measure: Measure, page: Write, **options: tuple[Any, str]) -> Any:
    """Measure those of the names that the command line has, all by default; print the section and return the result.

    options: more of them, each with its default and what it is.
    """
    parser = argparse.ArgumentParser(f"python -m occlusion_bake.bench.accuracy.{section}")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"which: {', '.join(names)} (all)")
    parser.add_argument("--models", type=Path, default=MODELS, help="folder of .obj models")
    for name, (default, what) in options.items():
        parser.add_argument(f"--{name}", type=type(default), default=default, help=what)
    result = measure(parser.parse_args())
    print(*page(result), sep="\n")
    return result
