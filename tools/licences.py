"""What the wheels of the extension hold, under which licences, and the texts of those.

A library inside a wheel that is not known here ends it with a line: nothing is handed on whose licence nobody has read.
"""

from __future__ import annotations

import re
import zipfile
from dataclasses import dataclass, field
from email.parser import Parser
from pathlib import Path
from typing import IO

_SHARED = re.compile(r"\.(so(\.\d+)*|dylib|dll)$")
_BESIDE = re.compile(r"[^/]+(\.libs|/\.dylibs)/")
_OWN = re.compile(r"\.dist-info/(licenses/)?[^/]*(LICEN[CS]E|COPYING|THIRD)[^/]*$")
_LINKED = re.compile(r"^occlusion_bake_kernel/licences/")
_APACHE = "Apache-2.0.txt"
_TEXTS = Path(__file__).with_name("licence_texts")


@dataclass(frozen=True)
class Part:
    """licence: an SPDX expression. texts: by file name."""

    name: str
    version: str
    licence: str
    texts: dict[str, bytes] = field(default_factory=dict)

    @property
    def title(self) -> str:
        return f"{self.name} {self.version}".strip()


@dataclass(frozen=True)
class _Library:
    """One that a wheel brings along. files: a pattern of its files' names."""

    name: str
    files: str
    licence: str
    text: str


# Of packages on PyPI, by their own metadata and the projects that their wheels are built of.
_LICENCES = {
    "embreex": "MIT",
    "openimageio": "Apache-2.0 AND BSD-3-Clause",
    "occlusion-bake-kernel": "GPL-3.0-or-later",
}
_LIBRARIES = {
    "embreex": (
        _Library("Embree", r"embree4", "Apache-2.0", _APACHE),
        _Library("oneTBB", r"tbb", "Apache-2.0", _APACHE),
        _Library("Visual C++ runtime", r"msvcp140", "LicenseRef-MSVC-runtime", "msvc-runtime.txt"),
    ),
}
# What the compiler links into the kernel (toolchain.py), by its file in the wheel: name, version, licence.
_RUNTIMES = {
    "LLVM.txt": ("LLVM libc++", "", "Apache-2.0 WITH LLVM-exception"),
    "mingw-w64.txt": ("mingw-w64", "", "LicenseRef-mingw-w64"),
}


def normal(name: str) -> str:
    """A package's name as PyPI compares them."""
    return re.sub(r"[-_.]+", "-", name).lower()


def parts(name: str, wheel: Path | IO[bytes]) -> list[Part]:
    """A wheel's own package first, then what it brings along. name: of its file. SystemExit for unknown licences."""
    with zipfile.ZipFile(wheel) as opened:
        files = opened.namelist()
        (metadata,) = [file for file in files if re.fullmatch(r"[^/]+\.dist-info/METADATA", file)]
        about = Parser().parsestr(opened.read(metadata).decode())
        texts = {Path(file).name: opened.read(file) for file in files if _OWN.search(file)}
        linked = {Path(file).name: opened.read(file) for file in files if _LINKED.search(file)}
    package = normal(about["Name"])
    if package not in _LICENCES:
        raise SystemExit(f"{name}: its licence is not known; read it, and add it to {Path(__file__).name}")
    own = Part(about["Name"], about["Version"], _LICENCES[package], texts)
    runtimes = [Part(*_RUNTIMES[file], {file: text}) for file, text in linked.items()]
    return [own, *_beside(name, package, files), *runtimes]


def _beside(wheel: str, package: str, files: list[str]) -> list[Part]:
    """Libraries that lie beside the package's own."""
    found: dict[str, Part] = {}
    for name in files:
        if not _SHARED.search(name) or not _BESIDE.match(name):
            continue
        known = [each for each in _LIBRARIES.get(package, ()) if re.search(each.files, Path(name).name)]
        if not known:
            raise SystemExit(
                f"{wheel}: the licence of {name} is not known; find it, and add it to {Path(__file__).name}"
            )
        each = known[0]
        found[each.name] = Part(each.name, "", each.licence, {each.text: (_TEXTS / each.text).read_bytes()})
    return list(found.values())
