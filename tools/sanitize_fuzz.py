"""The kernel's C interface under the sanitizers, with the inputs of the property tests.

sanitize_fuzz.py [--share X] [--sources FOLDER]

The kernel is compiled once more as a shared library with the address and undefined-behaviour sanitizers, and child
Pythons load it in place of the installed one. --sources: other kernel sources, to see that a fault in them is found.
"""

from __future__ import annotations

import argparse
import importlib.util
import os
import random
import subprocess
import sys
from pathlib import Path

from check_kernel import ROOT, SANITIZE, toolchain
from occlusion_bake.tests.oracles.fuzz_batch import long_run

LIBRARY = "OCCLUSION_BAKE_SANITIZED"  # for the child: the library to load
# The share of a long run's cases: the sanitizers take their time. Those that never enter the kernel are left out.
CASES = {
    "is_sound": 400,
    "farther_never_brightens": 20,
    "an_occluder_never_brightens": 20,
    "a_stray_part_changes_nothing_but_grazing_rays": 20,
    "alone_is_as_among_others": 20,
    "powers_of_two_change_no_bit": 20,
    "motion_changes_nothing_but_noise": 20,
    "texels_are_sound": 300,
    "texels_hold_the_area_of_their_triangles": 50,
    "charts_are_sound": 5,
}
# The child's first lines: the package finds this library where it would find its own.
BOOT = """
import os, sys
from pathlib import Path
import occlusion_bake_kernel
occlusion_bake_kernel.library_path = lambda: Path(os.environ["OCCLUSION_BAKE_SANITIZED"])
from occlusion_bake.tests.oracles.fuzz_batch import main
sys.exit(main(sys.argv[1:]))
"""


def build(sources: Path, work: Path) -> Path:
    """The kernel as a shared library under the sanitizers."""
    toolchain.SOURCES = sources
    library = work / toolchain.library_name()
    compiled = toolchain.compile_all(toolchain.sources(), work, SANITIZE)
    toolchain.run(
        [*toolchain.compiler(), *SANITIZE, "-shared", *map(str, compiled), "-pthread", "-ldl", "-o", str(library)]
    )
    return library


def preloaded() -> str | None:
    """What must be in the process before Python: the address sanitizer's runtime, and C++'s, whose throw it wraps."""
    paths = []
    for name in ("libasan.so", "libstdc++.so.6"):
        command = [*toolchain.compiler(), f"-print-file-name={name}"]
        path = subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
        if not Path(path).is_absolute():
            return None
        paths.append(path)
    return " ".join(paths)


def environment(library: Path, preload: str) -> dict[str, str]:
    """PYTHONMALLOC=malloc gives every array of numpy's own its red zones."""
    return {
        **os.environ,
        LIBRARY: str(library),
        "LD_PRELOAD": preload,
        "ASAN_OPTIONS": "detect_leaks=0:abort_on_error=0:exitcode=99:allocator_may_return_null=1",
        "UBSAN_OPTIONS": "print_stacktrace=1:halt_on_error=1:exitcode=99",
        "PYTHONMALLOC": "malloc",
        "PYTHONDONTWRITEBYTECODE": "1",
    }


def fuzz(library: Path, preload: str, share: float, seed: int | None) -> int:
    """How many properties failed."""
    seeds, child = random.Random(seed), environment(library, preload)
    wanted = {name: max(1, round(share * cases)) for name, cases in CASES.items()}
    return sum(
        bool(long_run(name, cases, seeds, print, ("-c", BOOT), child)["failures"]) for name, cases in wanted.items()
    )


def main() -> None:
    parser = argparse.ArgumentParser("sanitize_fuzz.py", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--share", type=float, default=1.0, help="of the cases (1)")
    parser.add_argument("--seed", type=int, help="another each time by default")
    parser.add_argument("--sources", type=Path, default=toolchain.SOURCES, help="kernel sources (core/kernel/src)")
    chosen = parser.parse_args()
    preload = preloaded()
    if sys.platform != "linux" or preload is None or importlib.util.find_spec("occlusion_bake_kernel") is None:
        print("SKIPPED the fuzzing under sanitizers: it needs Linux, this compiler's libasan and `make venv`")
        return
    work = ROOT / "build" / "sanitize" / "fuzz"
    library = build(chosen.sources.resolve(), work)
    if failed := fuzz(library, preload, chosen.share, chosen.seed):
        raise SystemExit(f"{failed} properties failed under the sanitizers; their own lines above say why")


if __name__ == "__main__":
    main()
