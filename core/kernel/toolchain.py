"""How the kernel is compiled: the compiler, and the flags of each file.

The one place for them: the wheel (setup.py), the sanitizer build and clang-tidy (tools/check_kernel.py) all ask here.
"""

from __future__ import annotations

import os
import platform
import shlex
import shutil
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

HERE = Path(__file__).resolve().parent
SOURCES = HERE / "src"
INCLUDE = HERE / "include"
JOBS = 2

# No contraction to fused multiply-adds: the same input gives the same bits on every machine. No errno, so that square
# roots are vectorised. Vectors never cross from one file's instruction set to another's by value (src/packets.h), so
# the note on how each passes them says nothing here.
GNU = ["-std=c++17", "-fPIC", "-fvisibility=hidden", "-ffp-contract=off", "-fno-math-errno", "-pthread", "-Wno-psabi"]
GNU_OPTIMISED = ["-O3"]
GNU_WARNINGS = ["-Wall", "-Wextra", "-Wconversion", "-Werror=return-type"]
MSVC = ["/nologo", "/std:c++17", "/O2", "/EHsc", "/W4", "/fp:precise"]

# A file that ends in one of these holds code for machines that have it, chosen at run time.
VECTOR = {
    "_avx2": (["-mavx2", "-mfma", "-mbmi2"], ["/arch:AVX2"]),
    "_avx512": (
        ["-mavx512f", "-mavx512bw", "-mavx512dq", "-mavx512vl", "-mfma", "-mbmi2", "-mprefer-vector-width=512"],
        ["/arch:AVX512"],
    ),
}
LIBRARY_NAMES = {"darwin": "libocclusion_kernel.dylib", "win32": "libocclusion_kernel.dll"}


def library_name() -> str:
    """File name of the shared library on this platform."""
    return LIBRARY_NAMES.get(sys.platform, "libocclusion_kernel.so")


def compiler() -> list[str]:
    """The command that compiles C++: $CXX, else the first found. SystemExit with one line where there is none."""
    if wanted := os.environ.get("CXX"):
        return shlex.split(wanted)
    for name in ["cl", "clang-cl"] if sys.platform == "win32" else ["c++", "g++", "clang++"]:
        if shutil.which(name):
            return [name]
    raise SystemExit("no C++17 compiler found to build the kernel: install g++ or clang++, or name one in CXX")


def sources() -> list[Path]:
    """The .cpp files this machine can compile, in order of their names."""
    return [path for path in sorted(SOURCES.glob("*.cpp")) if vector_of(path) is None or is_x86_64()]


def is_x86_64() -> bool:
    return platform.machine().lower() in ("x86_64", "amd64")


def vector_of(source: Path) -> str | None:
    """The vector extension that a file's name asks for: a key of VECTOR, or None."""
    return next((suffix for suffix in VECTOR if source.stem.endswith(suffix)), None)


def flags(source: Path) -> list[str]:
    """GNU-style flags that say what the file means: language, vector extension, warnings, includes; not how fast."""
    vector = vector_of(source)
    return [*GNU, *GNU_WARNINGS, *(VECTOR[vector][0] if vector else []), *defines("-D"), f"-I{INCLUDE}"]


def defines(prefix: str) -> list[str]:
    """OCCLUSION_PROFILE where the environment asks for a profile build (OCCLUSION_KERNEL_PROFILE=1)."""
    return [f"{prefix}OCCLUSION_PROFILE"] if os.environ.get("OCCLUSION_KERNEL_PROFILE", "0") not in ("", "0") else []


def build_library(library: Path, work: Path) -> None:
    """Compile every source and link the shared library. SystemExit names the file that does not compile."""
    if not sources():
        raise SystemExit(f"no kernel sources in {SOURCES}")
    library.parent.mkdir(parents=True, exist_ok=True)
    if is_msvc():
        build_msvc(library, work)
        return
    objects = compile_all(sources(), work, GNU_OPTIMISED)
    link = ["-dynamiclib"] if sys.platform == "darwin" else ["-shared", "-ldl", "-static-libstdc++", "-static-libgcc"]
    run([*compiler(), "-o", str(library), *map(str, objects), "-pthread", *link])


def compile_all(files: Sequence[Path], work: Path, extra: Sequence[str]) -> list[Path]:
    """Object files of `files` under `work`, compiled JOBS at a time with their flags and `extra`."""
    work.mkdir(parents=True, exist_ok=True)

    def compile_one(source: Path) -> Path:
        target = work / f"{source.stem}.o"
        run([*compiler(), *flags(source), *extra, "-c", str(source), "-o", str(target)])
        return target

    with ThreadPoolExecutor(JOBS) as pool:
        return list(pool.map(compile_one, files))


def is_msvc() -> bool:
    return Path(compiler()[0]).stem.lower() in ("cl", "clang-cl")


def build_msvc(library: Path, work: Path) -> None:
    """As build_library, with Microsoft's compiler or one that takes its flags."""
    work.mkdir(parents=True, exist_ok=True)
    objects = []
    for source in sources():
        vector = vector_of(source)
        target = work / f"{source.stem}.obj"
        wide = VECTOR[vector][1] if vector else []
        run([*compiler(), *MSVC, *wide, *defines("/D"), f"/I{INCLUDE}", "/c", str(source), f"/Fo{target}"])
        objects.append(str(target))
    run([*compiler(), "/nologo", "/LD", *objects, f"/Fe{library}"])


def run(command: Sequence[str]) -> None:
    """Run a command, shown as it stands; SystemExit with one line when it fails."""
    print(shlex.join(command), flush=True)
    if status := subprocess.run(command).returncode:
        raise SystemExit(f"{command[0]} ended with status {status}; its own lines above say why")


if __name__ == "__main__":
    compiler()  # says so in one line where there is none
