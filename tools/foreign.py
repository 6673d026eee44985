"""What can be tried of other systems on this Linux machine.

foreign.py windows-x64|linux-arm64 VERB…, by Wine and by qemu:

kernel          the kernel's own tests
bits            maps of all kinds, whose every bit should be what it is here
extension ZIP   Windows alone: the extension installed and baking, in folders with names that are hard for Windows
suite [WORD…]   Windows alone: pytest, given these words

What it needs (a Python, packages, a prefix) is made on first use in build/foreign. Where that cannot be had, a line
says what is missing; the status is then 0, but 1 where the environment has OCCLUSION_BAKE_NO_SKIP.
"""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from build_extension import only
from check_kernel import FOR_TESTS, ROOT, toolchain
from foreign_systems import SYSTEMS, System, Unavailable, Windows, skipped
from try_extension import bake_as_module, run_piped


def kernel(system: System) -> None:
    """Each of the kernel's own test programs ends with status 0, for every instruction set that is there."""
    # Asked for here, for two threads may not both install what is missing.
    runner, embree, environment = system.runner, system.embree, system.environment
    os.environ["OCCLUSION_KERNEL_TARGET"] = system.platform
    target = toolchain.TARGETS[system.platform]
    linked = toolchain.compile_all(toolchain.sources(), toolchain.objects(target.tag), toolchain.OPTIMISED)
    tests = sorted(toolchain.TESTS.glob("*.cpp"))
    compiled = toolchain.compile_all(tests, system.folder / "kernel", ["-O1", *FOR_TESTS])

    def run(test: Path) -> None:
        program, objects = test.with_suffix(".exe"), [test, *linked]
        if not program.exists() or program.stat().st_mtime < max(each.stat().st_mtime for each in objects):
            toolchain.run([*toolchain.compiler(), *map(str, objects), "-o", str(program)])
        run_piped([*runner, str(program), embree], environment)

    with ThreadPoolExecutor(toolchain.JOBS) as pool:
        list(pool.map(run, compiled))
    print(f"{len(tests)} of {len(tests)} kernel tests pass on {system.platform}")


def extension(system: System, archive: str) -> None:
    """In a profile and folders with umlauts, spaces, signs of Chinese, and paths longer than Windows' old 260."""
    assert isinstance(system, Windows)
    with tempfile.TemporaryDirectory(prefix="occlusion-bake-") as folder:
        work = Path(folder, "Prüfung mit Größe", "遮蔽 烘焙", *["a long way down, where artists keep their files"] * 4)
        (work / "profile").mkdir(parents=True)
        os.environ |= system.environment
        bake_as_module(Path(archive).resolve(), system.python, system.blender, work, system.seen)
    print(f"{Path(archive).name} works on {system.platform}")


def suite(system: System, *words: str) -> None:
    """pytest on this checkout, with the wheel of the kernel for that system."""
    # A test that hangs shows where every thread stands, and is ended by pytest itself (pyproject.toml).
    furnish(system)
    cache = f"cache_dir={system.seen(system.folder / 'cache')}"
    tests = [*system.python, "-B", "-m", "pytest", "-q", "-o", cache, *words]
    try:
        run_piped(tests, system.environment)
    except SystemExit as failed:  # Wine now and then has an internal error; what is ours fails again
        print(f"{failed}\nWHAT FAILED, once more and alone:", flush=True)
        run_piped([*tests, "--last-failed", "--last-failed-no-failures=none", "-n0"], system.environment)


def furnish(system: System) -> None:
    """Have its Python find this checkout, the kernel's wheel and all else, as if they were installed."""
    ours = system.folder / "ours"
    ours.mkdir(exist_ok=True)
    if not (link := ours / "occlusion_bake").is_symlink():
        link.symlink_to(ROOT)
    library = unpacked(ROOT / "build" / f"kernel-{system.platform}", system.folder / "library")
    lines = [f"{system.seen(folder)}\n" for folder in (ours, library, *system.packages)]
    system.site.mkdir(exist_ok=True)
    (system.site / "occlusion_bake.pth").write_text("".join(lines), encoding="utf-8")


def unpacked(wheels: Path, folder: Path) -> Path:
    """What the one wheel in a folder holds."""
    shutil.rmtree(folder, ignore_errors=True)
    with zipfile.ZipFile(only(wheels, "*.whl")) as wheel:
        wheel.extractall(folder)
    return folder


def bits(system: System) -> None:
    """The same scene gives the same bits here and there, and by the kernel that zig has built for here."""
    scene, module = system.folder / "scene.pickle", ["-m", "occlusion_bake.tests.oracles.hashed_maps"]
    subprocess.run([sys.executable, *module, "make", str(scene)], check=True)
    asked = [*module, "hash"]
    found = {"here": output([sys.executable, *asked, str(scene)], dict(os.environ))}
    if (zigs := ROOT / "build" / "kernel-linux-x64").exists():
        path = {"PYTHONPATH": str(unpacked(zigs, system.folder / "library-linux"))}
        found["here, by zig"] = output([sys.executable, *asked, str(scene)], os.environ | path)
    furnish(system)
    found[system.platform] = output([*system.python, "-B", *asked, system.seen(scene)], system.environment)
    for where, lines in found.items():
        print(f"{where}: {len(lines)} hashes, {len(set(lines) - set(found['here']))} others than here")
    if any(lines != found["here"] for lines in found.values()):
        raise SystemExit("FAILED: not the same bits everywhere")


def output(command: Sequence[str], environment: dict[str, str]) -> list[str]:
    """The lines that a program writes."""
    ran = subprocess.run(command, env=environment, stdin=subprocess.DEVNULL, capture_output=True, text=True)
    if ran.returncode:
        raise SystemExit(f"FAILED with status {ran.returncode}: {shlex.join(command)}\n{ran.stderr}")
    return ran.stdout.splitlines()


VERBS: dict[str, Callable[..., None]] = {"kernel": kernel, "extension": extension, "suite": suite, "bits": bits}


def main(arguments: list[str]) -> int:
    systems = {each.platform: each for each in SYSTEMS}
    if len(arguments) < 2 or arguments[0] not in systems or arguments[1] not in VERBS:
        raise SystemExit(__doc__)
    platform, verb, *rest = arguments
    system = systems[platform](ROOT / "build" / "foreign" / platform)
    system.folder.mkdir(parents=True, exist_ok=True)
    try:
        VERBS[verb](system, *rest)
    except Unavailable as missing:
        return skipped(f"{verb} on {platform}", missing)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
