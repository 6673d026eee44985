"""Pages of the documentation that are written from measurements, a section at a time.

Their words stand in Markdown files beside the code that measures. What a section gives is kept, so that a long run may
be taken up again; sections of which there is no result stay as the page has them.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any

from ..core.base.atomic_file import replacing
from ..core.base.version import version

ROOT = Path(__file__).resolve().parent.parent
_BENCH = __name__.rpartition(".")[0]
MODELS = ROOT / "models"  # .obj files to measure with, where there are any

Measure = Callable[[argparse.Namespace], Any]
Write = Callable[[Any], list[str]]


def filled(template: Path | str, **values: object) -> list[str]:
    """The lines of a text with what was measured in the places that it names, as str.format knows them.

    template: the text, or the module that it stands beside. A list is lines; but where a line of the text asks for
    something of a list's members, `{rows.seconds:.2f}`, it is there for each of them. An empty paragraph is left out.
    """
    text = Path(template).with_suffix(".md").read_text(encoding="utf-8")
    lines = [line for each in text.splitlines() for line in _filled(each, values)]
    return re.sub(r"\n{3,}", "\n\n", "\n".join(lines)).strip("\n").split("\n")


def _filled(line: str, values: Mapping[str, Any]) -> list[str]:
    names = [name for name in re.findall(r"{(\w+)[.\[]", line) if isinstance(values[name], list)]
    if names:
        return [line.format(**{**values, names[0]: each}) for each in values[names[0]]]
    whole = {name: "\n".join(map(str, each)) for name, each in values.items() if isinstance(each, list)}
    return [line.format(**{**values, **whole})]


def apart(chapters: Iterable[Sequence[str]]) -> str:
    """Lines of several chapters, as one place of a text takes them."""
    return "\n\n".join("\n".join(each) for each in chapters)


def run_sections(
    parser: argparse.ArgumentParser,
    names: Callable[[argparse.Namespace], Iterable[str]],
    measure: Callable[[str, argparse.Namespace], None],
    write: Callable[[argparse.Namespace], None],
    arguments: Sequence[str],
    is_meant: Callable[[str, str], bool] | None = None,
) -> int:
    """A command: measure the sections asked for, all by default, each in a process of its own, then write the page.

    is_meant: whether a section, by its name, is meant by a word of the command; by default where its name begins so, up
    to an underscore. One that fails does not keep the others back.
    """
    is_meant = is_meant or _begins
    parser.add_argument("sections", nargs="*", metavar="SECTION", help="which (all)")
    parser.add_argument("--rounds", type=int, default=3, help="alternating runs of each side (3)")
    parser.add_argument("--models", type=Path, default=MODELS, help="folder of .obj models")
    parser.add_argument("--write", action="store_true", help="write the page alone, from the results that are there")
    parser.add_argument("--here", help=argparse.SUPPRESS)
    chosen = parser.parse_args(arguments)
    if chosen.here:
        measure(chosen.here, chosen)
        return 0
    there, failed = list(names(chosen)), []
    for unknown in (each for each in chosen.sections if not any(is_meant(name, each) for name in there)):
        parser.error(f"{unknown}: no such section; choose from {', '.join(there)}")
    wanted = [name for name in there if any(is_meant(name, each) for each in chosen.sections or [name])]
    for name in [] if chosen.write else wanted:
        print(f"== {name}", flush=True)
        command = [sys.executable, "-m", parser.prog.split()[-1], *arguments, "--here", name]
        if subprocess.run(command, check=False).returncode != 0:
            failed.append(name)
    write(chosen)
    for name in failed:
        print(f"FAILED {name}: what was measured of it before is on the page", file=sys.stderr)
    return 1 if failed else 0


def _begins(name: str, given: str) -> bool:
    return f"{name}_".startswith(f"{given}_")


@dataclass(frozen=True)
class Page:
    """A page of several sections. package: of bench, what `python -m` runs; its head.md begins the page. path: from the
    root. modules: one a section, each with its `measure` and its `page`."""

    package: str
    path: str
    modules: Sequence[Any]

    @property
    def sections(self) -> dict[str, tuple[Measure, Write]]:
        """How to measure and how to write each."""
        return {each.__name__.rpartition(".")[2]: (each.measure, each.page) for each in self.modules}

    def run(self, arguments: Sequence[str]) -> int:
        """The command."""
        parser = argparse.ArgumentParser(
            f"python -m {_BENCH}.{self.package}", description=f"Measure and write {self.path}."
        )
        return run_sections(parser, lambda _: self.sections, self._measure, self._write, arguments)

    def _file(self, name: str) -> Path:
        return ROOT / "build" / Path(self.path).stem / f"{name}.json"

    def _measure(self, name: str, chosen: argparse.Namespace) -> None:
        result = {"measured": date.today().isoformat(), "machine": machine(), "result": self.sections[name][0](chosen)}
        write_json(self._file(name), result)

    def _write(self, chosen: argparse.Namespace) -> None:
        page = ROOT / self.path
        chapters = _chapters(page.read_text(encoding="utf-8").splitlines()) if page.exists() else {}
        for name, (_, write) in self.sections.items():
            if self._file(name).exists():
                kept = json.loads(self._file(name).read_text(encoding="utf-8"))
                lines = [*write(kept["result"]), "", f"Measured {kept['measured']} on {kept['machine']}."]
                chapters.update(_chapters(lines))
            else:
                print(f"{name}: not measured, so the page keeps what it has of it")
        head = filled(ROOT / "bench" / self.package / "head", version=version())
        parts = [head, *chapters.values()]
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


def write_json(file: Path, content: Any) -> None:
    """Whole or not at all."""
    file.parent.mkdir(parents=True, exist_ok=True)
    with replacing(file) as part:
        part.write_text(json.dumps(content, indent=1), encoding="utf-8")


def machine() -> str:
    """Processor, cores, and the vector width that decides."""
    cpuinfo = Path("/proc/cpuinfo")
    text = cpuinfo.read_text(encoding="utf-8") if cpuinfo.exists() else ""
    model = next((line.split(":", 1)[1].strip() for line in text.splitlines() if line.startswith("model name")), "?")
    wide = "AVX-512" if "avx512f" in text else "AVX2" if "avx2" in text else "SSE"
    return f"{model}, {os.cpu_count()} cores, {wide}, Python {sys.version_info[0]}.{sys.version_info[1]}"
