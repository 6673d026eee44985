"""Checks on the kernel: `tidy` (warnings, symbols, layout, clang-tidy; all errors) and `sanitize` (its own tests)."""

from __future__ import annotations

import importlib.util
import shutil
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
KERNEL = ROOT / "core" / "kernel"
WARNINGS = ROOT / "build" / "warnings"
sys.path.insert(0, str(KERNEL))

import toolchain  # noqa: E402

__all__ = ["ROOT", "SANITIZE", "toolchain"]  # what sanitize_fuzz.py builds with, too

SANITIZE = ["-O1", "-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-fno-omit-frame-pointer"]
FOR_TESTS = [f"-I{toolchain.SOURCES}"]


def tidy() -> None:
    """Every source and test compiles without a warning, exports what it may, is laid out and passes .clang-tidy."""
    sources, tests = toolchain.sources(), sorted(toolchain.TESTS.glob("*.cpp"))
    if not sources:
        print("SKIPPED clang-tidy: no kernel sources")
        return
    toolchain.compile_all(sources, WARNINGS, [*toolchain.OPTIMISED, "-Werror"])
    toolchain.compile_all(tests, WARNINGS / "tests", [*FOR_TESTS, "-Werror"])
    symbols()
    layout()
    if (program := tool("clang-tidy")) is None:
        raise SystemExit("no clang-tidy beside this Python: pip install -r requirements/common.txt")

    def check(source: Path) -> None:
        extra = FOR_TESTS if source in tests else []
        toolchain.run([str(program), "--quiet", str(source), "--", *toolchain.flags(source), *extra])

    with ThreadPoolExecutor(toolchain.JOBS) as pool:
        list(pool.map(check, [*sources, *tests]))


def symbols() -> None:
    """A file built for a vector extension defines one global symbol: its table of functions.

    Any other, an inline function's say, is a copy that the linker may keep for the whole library, and that would run
    on machines without the extension. Looked at without optimisation too, where nothing is inlined away.
    """
    if shutil.which("nm") is None:
        print("SKIPPED the symbols of vector code: there is no nm")
        return
    vector = [source for source in toolchain.sources() if toolchain.vector_of(source)]
    for level in ("-O0", *toolchain.OPTIMISED):
        for compiled in toolchain.compile_all(vector, WARNINGS / level, [level]):
            listed = ["nm", "-g", "-P", "--defined-only", str(compiled)]
            lines = subprocess.run(listed, check=True, capture_output=True, text=True).stdout.splitlines()
            names = [line.split()[0] for line in lines]
            if len(names) != 1 or not names[0].endswith("PacketsE"):
                raise SystemExit(f"{compiled} defines {', '.join(names)}; only its table of packet code may be global")


def layout() -> None:
    """Sources and tests are as clang-format would write them."""
    if (program := tool("clang-format")) is None:
        print("SKIPPED the layout of the kernel: no clang-format beside this Python")
        return
    files = [path for folder in ("src", "include", "tests") for path in sorted((KERNEL / folder).iterdir())]
    toolchain.run([str(program), "--dry-run", "-Werror", *map(str, files)])


def tool(name: str) -> Path | None:
    """A program installed beside this Python, by a wheel."""
    program = Path(sys.executable).parent / name
    return program if program.exists() else None


def sanitize() -> None:
    """Each program in core/kernel/tests, linked with the kernel, ends with status 0 under the sanitizers.

    It gets the path of an Embree library as its argument where the embreex wheel is installed.
    """
    tests = sorted(toolchain.TESTS.glob("*.cpp"))
    if not tests:
        print("SKIPPED the sanitizers: no programs in core/kernel/tests")
        return
    work = ROOT / "build" / "sanitize"
    extra = [*SANITIZE, *FOR_TESTS]
    kernel = toolchain.compile_all(toolchain.sources(), work, extra)
    for test, compiled in zip(tests, toolchain.compile_all(tests, work / "tests", extra), strict=True):
        program = work / test.stem
        link = [str(compiled), *map(str, kernel), "-pthread", "-ldl"]
        toolchain.run([*toolchain.compiler(), *SANITIZE, *link, "-o", str(program)])
        run_checked([str(program), *embree()])


def run_checked(command: list[str], attempts: int = 3) -> None:
    """Run a sanitized program. The leak check at its end may itself crash on Embree's threads: then once more."""
    print(*command, flush=True)
    for _ in range(attempts):
        done = subprocess.run(command, capture_output=True, text=True)
        if "LeakSanitizer has encountered a fatal error" not in done.stderr:
            break
    print(done.stdout, done.stderr, sep="", end="", flush=True)
    if done.returncode:
        raise SystemExit(f"{command[0]} ended with status {done.returncode}; its own lines above say why")


def embree() -> list[str]:
    """The Embree library inside the embreex wheel: one path, or none."""
    spec = importlib.util.find_spec("embreex")
    if spec is None or spec.origin is None:
        return []
    return [str(path) for path in sorted(Path(spec.origin).parent.parent.glob("embreex.libs/libembree4*"))[:1]]


VERBS: dict[str, Callable[[], None]] = {"tidy": tidy, "symbols": symbols, "layout": layout, "sanitize": sanitize}

if __name__ == "__main__":
    if sys.argv[1:] not in ([verb] for verb in VERBS):
        raise SystemExit(f"check_kernel.py {'|'.join(VERBS)}")
    VERBS[sys.argv[1]]()
