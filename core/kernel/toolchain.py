"""How the kernel is compiled: the compiler, for which platform, and the flags of each file.

The one place for them: the wheel (setup.py), the sanitizer build and clang-tidy (tools/check_kernel.py) all ask here.
"""

from __future__ import annotations

import hashlib
import importlib
import importlib.util
import os
import platform
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from pathlib import Path

HERE = Path(__file__).resolve().parent
SOURCES = HERE / "src"
INCLUDE = HERE / "include"
TESTS = HERE / "tests"
JOBS = 2

# No contraction to fused multiply-adds: the same input gives the same bits on every machine. No errno, so that square
# roots are vectorised. Vectors never cross from one file's instruction set to another's by value (src/packets.h), so
# the note on how each passes them says nothing here.
MEANING = ["-std=c++17", "-fPIC", "-fvisibility=hidden", "-ffp-contract=off", "-fno-math-errno", "-pthread"]
WARNINGS = ["-Wall", "-Wextra", "-Wconversion", "-Werror=return-type", "-Wno-psabi"]
OPTIMISED = ["-O3"]

# A file that ends in one of these holds code for machines that have it, chosen at run time.
VECTOR = {
    "_avx2": ["-mavx2", "-mfma", "-mbmi2"],
    "_avx512": ["-mavx512f", "-mavx512bw", "-mavx512dq", "-mavx512vl", "-mfma", "-mbmi2", "-mprefer-vector-width=512"],
}
OWN_MEMORY = ["-fvisibility-global-new-delete=force-hidden"]  # clang's: else operators new and delete are exported
EXPORTED = "{ global: ob_*; local: *; };\n"  # and none of the C++ library's own functions, which are linked in
LIBRARY_NAMES = {"darwin": "libocclusion_kernel.dylib", "win32": "libocclusion_kernel.dll"}


@dataclass(frozen=True)
class Target:
    """A platform that zig (PyPI: ziglang) builds for from any other. triple: zig's name of it, with the oldest system.
    tag: the wheel's. system: sys.platform there."""

    triple: str
    tag: str
    system: str

    @property
    def is_x86_64(self) -> bool:
        return self.triple.startswith("x86_64")


# By Blender's names.
TARGETS = {
    "linux-x64": Target("x86_64-linux-gnu.2.28", "manylinux_2_28_x86_64", "linux"),
    "linux-arm64": Target("aarch64-linux-gnu.2.28", "manylinux_2_28_aarch64", "linux"),
    "windows-x64": Target("x86_64-windows-gnu", "win_amd64", "win32"),
    "windows-arm64": Target("aarch64-windows-gnu", "win_arm64", "win32"),
    "macos-x64": Target("x86_64-macos.11.0", "macosx_11_0_x86_64", "darwin"),
    "macos-arm64": Target("aarch64-macos.11.0", "macosx_11_0_arm64", "darwin"),
}


def target() -> Target | None:
    """The platform that OCCLUSION_KERNEL_TARGET names; None: this machine's own compiler builds for it alone."""
    name = os.environ.get("OCCLUSION_KERNEL_TARGET", "")
    if name and name not in TARGETS:
        raise SystemExit(f"no target {name}: there are {', '.join(TARGETS)}")
    return TARGETS.get(name)


def system() -> str:
    """What sys.platform is where the library is to run."""
    wanted = target()
    return wanted.system if wanted else sys.platform


def is_x86_64() -> bool:
    wanted = target()
    return wanted.is_x86_64 if wanted else platform.machine().lower() in ("x86_64", "amd64")


def objects(tag: str) -> Path:
    """Where the objects of a wheel's library lie."""
    return HERE / "build" / tag / "objects"


def library_name() -> str:
    """File name of the shared library there."""
    return LIBRARY_NAMES.get(system(), "libocclusion_kernel.so")


def compiler() -> list[str]:
    """The command that compiles C++: zig for another platform, else $CXX, else the first found. SystemExit with one
    line where there is none."""
    if wanted := target():
        return [*zig(), "-target", wanted.triple]
    if named := os.environ.get("CXX"):
        return shlex.split(named)
    for name in ("c++", "g++", "clang++"):
        if shutil.which(name):
            return [name]
    if importlib.util.find_spec("ziglang"):
        return [*zig(), "-mcpu=baseline"]  # else it takes what this very processor has
    raise SystemExit(
        "no C++17 compiler found to build the kernel: install g++ or clang++, name one in CXX, or pip install ziglang"
    )


def zig() -> list[str]:
    return [sys.executable, "-m", "ziglang", "c++"]


def sources() -> list[Path]:
    """The .cpp files this machine can compile, in order of their names."""
    return [path for path in sorted(SOURCES.glob("*.cpp")) if vector_of(path) is None or is_x86_64()]


def vector_of(source: Path) -> str | None:
    """The vector extension that a file's name asks for: a key of VECTOR, or None."""
    return next((suffix for suffix in VECTOR if source.stem.endswith(suffix)), None)


def flags(source: Path) -> list[str]:
    """Flags that say what the file means: language, vector extension, warnings, includes; not how fast."""
    vector = vector_of(source)
    own = OWN_MEMORY if source.stem == "own_memory" and system() == "darwin" else []
    return [*MEANING, *WARNINGS, *(VECTOR[vector] if vector else []), *own, *defines(), f"-I{INCLUDE}"]


def defines() -> list[str]:
    """OCCLUSION_PROFILE where the environment asks for a profile build (OCCLUSION_KERNEL_PROFILE=1)."""
    return ["-DOCCLUSION_PROFILE"] if os.environ.get("OCCLUSION_KERNEL_PROFILE", "0") not in ("", "0") else []


def build_library(library: Path, work: Path) -> None:
    """Compile every source and link the shared library. SystemExit names the file that does not compile."""
    if not sources():
        raise SystemExit(f"no kernel sources in {SOURCES}")
    library.parent.mkdir(parents=True, exist_ok=True)
    objects, linked = compile_all(sources(), work, OPTIMISED), work / library.name
    run([*compiler(), "-o", str(linked), *map(str, objects), "-pthread", *link_flags(work)])
    if system() == "win32":
        undate(linked)
    shutil.copy(linked, library)  # alone: for Windows some linkers put more beside it


def undate(library: Path) -> None:
    """Take the time of its linking out of a library for Windows: the same sources make the same bytes."""
    data = bytearray(library.read_bytes())
    header = int.from_bytes(data[0x3C:0x40], "little")  # where the PE header is; 8 bytes into it is the time
    data[header + 8 : header + 12] = bytes(4)
    library.write_bytes(data)


def link_flags(work: Path) -> list[str]:
    """What makes a shared library of the objects, without symbols, which for a Mac would tell where they were compiled.
    It brings the C++ library with it, but for macOS, which has one."""
    if system() == "darwin":
        return ["-dynamiclib", "-s", f"-Wl,-install_name,@rpath/{library_name()}"]
    own = [] if "ziglang" in compiler() else ["-static-libstdc++", "-static-libgcc"]
    if system() == "win32":
        return ["-shared", "-s", *own]
    exported = work / "exported.map"
    exported.write_text(EXPORTED, encoding="utf-8")
    return ["-shared", "-s", f"-Wl,--version-script={exported}", "-ldl", *own]


def linked_licences() -> dict[str, Path]:
    """The licences of what zig links in beside our own code, by the name of the file that the wheel holds them in."""
    if "ziglang" not in compiler():
        return {}
    (folder,) = importlib.import_module("ziglang").__path__
    texts = {"LLVM.txt": Path(folder, "lib", "libcxx", "LICENSE.TXT")}
    if system() == "win32":
        texts["mingw-w64.txt"] = Path(folder, "lib", "libc", "mingw", "COPYING")
    return texts


def compile_all(files: Sequence[Path], work: Path, extra: Sequence[str]) -> list[Path]:
    """Object files of `files` under `work`, compiled JOBS at a time with their flags and `extra`; those that the same
    command has made of the same files are left."""
    work.mkdir(parents=True, exist_ok=True)
    read = _digest(
        [*sorted(INCLUDE.iterdir()), *sorted(SOURCES.glob("*.h")), *sorted(TESTS.glob("*.h"))], _version(*compiler())
    )

    def compile_one(source: Path) -> Path:
        target, stamp = work / f"{source.stem}.o", work / f"{source.stem}.made"
        command = [*compiler(), *flags(source), *extra, "-c", str(source), "-o", str(target)]
        made = _digest([source], read, *command)
        if not (target.exists() and stamp.exists() and stamp.read_text(encoding="utf-8") == made):
            stamp.unlink(missing_ok=True)
            run(command)
            stamp.write_text(made, encoding="utf-8")
        return target

    with ThreadPoolExecutor(JOBS) as pool:
        return list(pool.map(compile_one, files))


def _digest(files: Sequence[Path], *words: str) -> str:
    """Of what files hold, and of words."""
    digest = hashlib.blake2b(digest_size=16)
    for part in (*(path.read_bytes() for path in files), *(word.encode() for word in words)):
        digest.update(len(part).to_bytes(8, "little") + part)
    return digest.hexdigest()


@cache
def _version(*command: str) -> str:
    """What a compiler says of itself: another version makes other objects."""
    with tempfile.TemporaryDirectory() as folder:
        where = folder if "ziglang" in command else None  # which leaves an empty a.o where it is asked, of a Mac's
        return subprocess.run([*command, "--version"], cwd=where, capture_output=True, text=True, check=True).stdout


def run(command: Sequence[str]) -> None:
    """Run a command, shown as it stands; SystemExit with one line when it fails."""
    print(shlex.join(command), flush=True)
    if status := subprocess.run(command).returncode:
        raise SystemExit(f"{command[0]} ended with status {status}; its own lines above say why")


if __name__ == "__main__":
    compiler()  # says so in one line where there is none
