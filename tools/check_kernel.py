"""Checks on the native kernel: `tidy` (compiler warnings and clang-tidy, all errors) and `sanitize` (its own tests)."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
KERNEL = ROOT / "core" / "kernel"
sys.path.insert(0, str(KERNEL))

import toolchain  # noqa: E402

SANITIZE = ["-O1", "-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-fno-omit-frame-pointer"]


def tidy() -> None:
    """Every source compiles without a warning and passes .clang-tidy."""
    sources = toolchain.sources()
    if not sources:
        print("SKIPPED clang-tidy: no kernel sources")
        return
    toolchain.compile_all(sources, ROOT / "build" / "warnings", [*toolchain.GNU_OPTIMISED, "-Werror"])
    program = Path(sys.executable).parent / "clang-tidy"

    def check(source: Path) -> None:
        toolchain.run([str(program), "--quiet", str(source), "--", *toolchain.flags(source)])

    with ThreadPoolExecutor(toolchain.JOBS) as pool:
        list(pool.map(check, sources))


def sanitize() -> None:
    """Each program in core/kernel/tests, linked with the kernel, ends with status 0 under the sanitizers.

    It gets the path of an Embree library as its argument where the embreex wheel is installed.
    """
    tests = sorted((KERNEL / "tests").glob("*.cpp"))
    if not tests:
        print("SKIPPED the sanitizers: no programs in core/kernel/tests")
        return
    work = ROOT / "build" / "sanitize"
    extra = [*SANITIZE, f"-I{toolchain.SOURCES}"]
    kernel = toolchain.compile_all(toolchain.sources(), work, extra)
    for test, compiled in zip(tests, toolchain.compile_all(tests, work / "tests", extra), strict=True):
        program = work / test.stem
        link = [str(compiled), *map(str, kernel), "-pthread", "-ldl"]
        toolchain.run([*toolchain.compiler(), *SANITIZE, *link, "-o", str(program)])
        toolchain.run([str(program), *embree()])


def embree() -> list[str]:
    """The Embree library inside the embreex wheel: one path, or none."""
    spec = importlib.util.find_spec("embreex")
    if spec is None or spec.origin is None:
        return []
    return [str(path) for path in sorted(Path(spec.origin).parent.parent.glob("embreex.libs/libembree4*"))[:1]]


VERBS: dict[str, Callable[[], None]] = {"tidy": tidy, "sanitize": sanitize}

if __name__ == "__main__":
    if sys.argv[1:] not in ([verb] for verb in VERBS):
        raise SystemExit(f"check_kernel.py {'|'.join(VERBS)}")
    VERBS[sys.argv[1]]()
