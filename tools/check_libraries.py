"""check_libraries.py WHEEL…: the kernel's library in each wheel is what the wheel's tag says, and asks for no more than
the systems it names have. For each one line: platform, size, what it needs, the oldest system it runs on."""

from __future__ import annotations

import re
import sys
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import lief

ROOT = Path(__file__).resolve().parent.parent
OTHERS = re.compile(r"\.dist-info/|/licences/|/__init__\.py$")  # what a wheel holds beside the library
OURS = "ob_"  # all that is exported begins with it
GLIBC = (2, 28)
MACOS = (11, 0)
# Libraries that are there on any system of the kind.
LINUX = {"libc.so.6", "libm.so.6", "libdl.so.2", "libpthread.so.0", "ld-linux-x86-64.so.2", "ld-linux-aarch64.so.1"}
WINDOWS = ("kernel32.dll", "api-ms-win-crt-")
APPLE = {"/usr/lib/libSystem.B.dylib"}
LINKERS = {"_mh_dylib_header", "__dso_handle"}  # of every library there, made by the linker


@dataclass(frozen=True)
class Library:
    """What a library says of itself. machine: of its code. oldest: the system that it asks for, in words."""

    machine: str
    exported: frozenset[str]
    needed: frozenset[str]
    oldest: str


def main(wheels: list[str]) -> int:
    lief.logging.disable()  # of parts that are not looked at
    wrong = [f"{Path(wheel).name}: {fault}" for wheel in wheels for fault in faults(Path(wheel))]
    for line in wrong:
        print(f"FAILED: {line}", file=sys.stderr)
    return 1 if wrong else 0


def faults(wheel: Path) -> list[str]:
    """What is wrong with a wheel; the line about it is printed."""
    with zipfile.ZipFile(wheel) as archive:
        names = {name for name in archive.namelist() if not OTHERS.search(name)}
        if len(names) != 1:
            return [f"it should hold one library, and holds {', '.join(sorted(names)) or 'none'}"]
        data = archive.read(names.pop())
    tag = wheel.stem.split("-")[-1]
    kind = "linux" if "linux" in tag else "win" if tag.startswith("win") else "macosx"
    library, found = READERS[kind](data)
    needs = ", ".join(sorted(library.needed))
    print(f"{tag}: {len(data) / 1e6:.2f} MB, {library.machine}, {library.oldest}, needs {needs}")
    if not tag.endswith(library.machine):
        found.append(f"its code is for {library.machine}")
    if strays := sorted(name for name in library.exported if not name.startswith(OURS)):
        found.append(f"it exports {', '.join(strays[:5])}")
    if str(ROOT).encode() in data:
        found.append("it tells where it was compiled, and elsewhere other bytes would come of it")
    if not library.exported:
        found.append("it exports nothing")
    return found


def _elf(data: bytes) -> tuple[Library, list[str]]:
    binary: Any = lief.ELF.parse(list(data))
    machines = {"X86_64": "x86_64", "AARCH64": "aarch64"}
    exported = frozenset(str(symbol.name) for symbol in binary.exported_symbols)
    asked = {
        str(version.name)
        for requirement in binary.symbols_version_requirement
        for version in requirement.get_auxiliary_symbols()
    }
    versions = [tuple(map(int, name.removeprefix("GLIBC_").split("."))) for name in asked if name.startswith("GLIBC_")]
    newest = max(versions, default=(0,))
    found = [f"it asks for glibc {'.'.join(map(str, newest))}"] if newest > GLIBC else []
    found += [f"it needs {name}" for name in sorted(set(binary.libraries) - LINUX)]
    oldest = f"glibc {'.'.join(map(str, newest))}"
    return Library(machines[binary.header.machine_type.name], exported, frozenset(binary.libraries), oldest), found


def _pe(data: bytes) -> tuple[Library, list[str]]:
    binary: Any = lief.PE.parse(list(data))
    machines = {"AMD64": "amd64", "ARM64": "arm64"}
    exported = frozenset(str(entry.name) for entry in binary.get_export().entries)
    needed = frozenset(str(entry.name).lower() for entry in binary.imports)
    found = [f"it needs {name}" for name in sorted(needed) if not name.startswith(WINDOWS)]
    header = binary.optional_header
    oldest = f"Windows {header.major_operating_system_version}.{header.minor_operating_system_version}"
    return Library(machines[binary.header.machine.name], exported, needed, oldest), found


def _macho(data: bytes) -> tuple[Library, list[str]]:
    fat: Any = lief.MachO.parse(list(data))
    binary = fat.at(0)
    machines = {"X86_64": "x86_64", "ARM64": "arm64"}
    machine = machines[binary.header.cpu_type.name]
    exported = frozenset(str(symbol.name).removeprefix("_") for symbol in binary.exported_symbols) - LINKERS
    needed = frozenset(str(library.name) for library in binary.libraries) - {"@rpath/libocclusion_kernel.dylib"}
    version = (
        tuple(binary.build_version.minos[:2]) if binary.has_build_version else tuple(binary.version_min.version[:2])
    )
    found = [f"it needs {name}" for name in sorted(needed - APPLE)]
    if version > MACOS:
        found.append(f"it asks for macOS {'.'.join(map(str, version))}")
    if machine == "arm64" and not binary.has_code_signature:
        found.append("it is not signed, which arm64 asks for")
    signed = ", signed" if binary.has_code_signature else ""
    return Library(machine, exported, needed, f"macOS {'.'.join(map(str, version))}{signed}"), found


READERS = {"linux": _elf, "win": _pe, "macosx": _macho}


if __name__ == "__main__":
    if len(sys.argv) < 2:
        raise SystemExit(__doc__)
    sys.exit(main(sys.argv[1:]))
