"""Pages of the documentation that are written from measurements, a section at a time.

Each section runs in a process of its own and keeps its result in build/, so that a long run may be taken up again.
Sections of which there is no result stay as the page has them.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
MODELS = ROOT / "models"  # .obj files to measure with, where there are any

Measure = Callable[[argparse.Namespace], Any]
Write = Callable[[Any], list[str]]


@dataclass(frozen=True)
class Page:
    """module: what `python -m` runs. path: the page, from the root. sections: how to measure and how to write each."""

    module: str
    path: str
    title: str
    about: str
    sections: Mapping[str, tuple[Measure, Write]]

    @property
    def results(self) -> Path:
        """The folder of the sections' results."""
        return ROOT / "build" / Path(self.path).stem

    def run(self, arguments: Sequence[str]) -> int:
        """The command: measure the sections asked for, all by default, then write the page."""
        chosen = self._parser().parse_args(arguments)
        if unknown := [name for name in chosen.sections if name not in self.sections]:
            print(f"{unknown[0]}: no such section; choose from {', '.join(self.sections)}", file=sys.stderr)
            return 2
        self.results.mkdir(parents=True, exist_ok=True)
        if chosen.here:
            for name in chosen.sections:
                self._measure(name, chosen)
            return 0
        if not chosen.write:
            for name in chosen.sections or self.sections:
                print(f"== {name}", flush=True)
                command = [sys.executable, "-m", self.module, name, *arguments_of(chosen), "--here"]
                subprocess.run(command, check=True)
        self._write()
        return 0

    def _parser(self) -> argparse.ArgumentParser:
        parser = argparse.ArgumentParser(f"python -m {self.module}", description=f"Measure and write {self.path}.")
        parser.add_argument("sections", nargs="*", metavar="SECTION", help=f"which: {', '.join(self.sections)} (all)")
        parser.add_argument("--rounds", type=int, default=3, help="alternating runs of each side (3)")
        parser.add_argument("--models", type=Path, default=MODELS, help="folder of .obj models")
        parser.add_argument(
            "--write", action="store_true", help="write the page alone, from the results that are there"
        )
        parser.add_argument("--here", action="store_true", help=argparse.SUPPRESS)
        return parser

    def _measure(self, name: str, chosen: argparse.Namespace) -> None:
        result = {"measured": date.today().isoformat(), "machine": machine(), "result": self.sections[name][0](chosen)}
        (self.results / f"{name}.json").write_text(json.dumps(result, indent=1), encoding="utf-8")

    def _write(self) -> None:
        page = ROOT / self.path
        chapters = _chapters(page.read_text(encoding="utf-8").splitlines()) if page.exists() else {}
        for name, (_, write) in self.sections.items():
            file = self.results / f"{name}.json"
            if not file.exists():
                print(f"{name}: not measured, so the page keeps what it has of it")
                continue
            kept = json.loads(file.read_text(encoding="utf-8"))
            lines = [*write(kept["result"]), "", f"Measured {kept['measured']} on {kept['machine']}."]
            chapters.update(_chapters(lines))
        page.parent.mkdir(exist_ok=True)
        parts = [[f"# {self.title}", "", self.about], *chapters.values()]
        page.write_text("\n\n".join("\n".join(part).strip("\n") for part in parts) + "\n", encoding="utf-8")
        print(f"wrote {page}")


def _chapters(lines: Sequence[str]) -> dict[str, list[str]]:
    """A page's lines by the headings of the second level; what stands before the first is left out."""
    chapters: dict[str, list[str]] = {}
    for line in lines:
        if line.startswith("## "):
            chapters[line] = []
        if chapters:
            chapters[list(chapters)[-1]].append(line)
    return chapters


def arguments_of(chosen: argparse.Namespace) -> list[str]:
    """The options again, for the process of one section."""
    return ["--rounds", str(chosen.rounds), "--models", str(chosen.models)]


def answer_of(module: str, *arguments: object, environment: Mapping[str, str] | None = None) -> Any:
    """What `python -m occlusion_bake.bench.MODULE` says in the last line that it prints, JSON, in a fresh process."""
    command = [sys.executable, "-m", f"occlusion_bake.bench.{module}", *map(str, arguments)]
    answer = subprocess.run(command, env=environment, check=True, capture_output=True, text=True).stdout
    return json.loads(answer.splitlines()[-1])


def peak_memory() -> float:
    """The most that this process has held, GB. Not ru_maxrss, which a process takes over from the one that started
    it."""
    lines = Path("/proc/self/status").read_text(encoding="utf-8").splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM")) / 1048576.0


def machine() -> str:
    """Processor, cores, and the vector width that decides."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        text = ""
    model = next((line.split(":", 1)[1].strip() for line in text.splitlines() if line.startswith("model name")), "?")
    wide = "AVX-512" if "avx512f" in text else "AVX2" if "avx2" in text else "SSE"
    return f"{model}, {os.cpu_count()} cores, {wide}, Python {sys.version_info[0]}.{sys.version_info[1]}"
