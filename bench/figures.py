"""`make figures`: measure what the project promises and write docs/figures.md.

python -m occlusion_bake.bench.figures [SECTION...] [--rounds N] [--models DIR]

Each section runs alone and keeps its result in build/figures/, so that a long run may be taken up again; the page is
written from whatever is there.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from datetime import date
from pathlib import Path
from typing import Any

from ..addon.leave import leave
from ..core.version import version
from . import agreement, charting, memory, share, speed

ROOT = Path(__file__).resolve().parent.parent
RESULTS = ROOT / "build" / "figures"
PAGE = ROOT / "docs" / "figures.md"

SECTIONS: dict[str, tuple[Callable[[argparse.Namespace], Any], Callable[[Any], list[str]]]] = {
    "speed": (speed.measure, speed.page),
    "agreement": (agreement.measure, agreement.page),
    "share": (share.measure, share.page),
    "memory": (memory.measure, memory.page),
    "charts": (charting.measure, charting.page),
}


def main(arguments: Sequence[str]) -> int:
    """Measure the sections asked for, all by default, each in a process of its own; then write the page."""
    parser = argparse.ArgumentParser("python -m occlusion_bake.bench.figures", description="Measure the figures.")
    parser.add_argument("sections", nargs="*", metavar="SECTION", help=f"which: {', '.join(SECTIONS)} (all)")
    parser.add_argument("--rounds", type=int, default=3, help="alternating runs of each side (3)")
    parser.add_argument("--models", type=Path, default=ROOT.parent / "shared" / "models", help="folder of .obj models")
    parser.add_argument("--here", action="store_true", help=argparse.SUPPRESS)
    chosen = parser.parse_args(arguments)
    RESULTS.mkdir(parents=True, exist_ok=True)
    for name in chosen.sections or SECTIONS:
        if chosen.here:
            result = {"measured": date.today().isoformat(), "machine": _machine(), "result": SECTIONS[name][0](chosen)}
            (RESULTS / f"{name}.json").write_text(json.dumps(result, indent=1), encoding="utf-8")
        else:
            print(f"== {name}", flush=True)
            options = ["--rounds", str(chosen.rounds), "--models", str(chosen.models), "--here"]
            subprocess.run([sys.executable, "-m", "occlusion_bake.bench.figures", name, *options], check=True)
    if not chosen.here:
        _write_page()
    return 0


def _machine() -> str:
    """Processor, cores, and the vector width that decides."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        text = ""
    model = next((line.split(":", 1)[1].strip() for line in text.splitlines() if line.startswith("model name")), "?")
    wide = "AVX-512" if "avx512f" in text else "AVX2" if "avx2" in text else "SSE"
    return f"{model}, {os.cpu_count()} cores, {wide}, Python {sys.version_info[0]}.{sys.version_info[1]}"


def _write_page() -> None:
    lines = [
        "# Figures",
        "",
        f"Occlusion Bake {version()}. Written by `make figures`; one section alone: `.venv/bin/python -m "
        "occlusion_bake.bench.figures SECTION`. Times are wall-clock medians of alternating runs.",
    ]
    for name, (_, page) in SECTIONS.items():
        file = RESULTS / f"{name}.json"
        if file.exists():
            kept = json.loads(file.read_text(encoding="utf-8"))
            lines += ["", *page(kept["result"]), "", f"Measured {kept['measured']} on {kept['machine']}."]
    PAGE.parent.mkdir(exist_ok=True)
    PAGE.write_text("\n".join(lines) + "\n", encoding="utf-8")
    print(f"wrote {PAGE}")


if __name__ == "__main__":
    leave(main(sys.argv[1:]))
