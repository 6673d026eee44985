"""Another system on this Linux machine: Windows by Wine, with Blender as a module there.

foreign.py kernel          the kernel's own tests
foreign.py extension ZIP   the extension installed and baking, in folders with names that are hard for Windows
foreign.py suite [WORD…]   pytest, given these words
foreign.py bits            maps of all kinds, whose every bit should be what it is here

What it needs (a Python for Windows, packages, a prefix) is made on first use in build/foreign. Where that cannot be
had, a line says what is missing; the status is then 0, but 1 where the environment has OCCLUSION_BAKE_NO_SKIP.
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
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path, PureWindowsPath

from build_extension import only, pins
from check_kernel import FOR_TESTS, ROOT, toolchain
from try_extension import bake_as_module, run_piped

TOOLS = Path(__file__).resolve().parent
PYTHON = TOOLS / "foreign_python"  # the Go program that brings it along
RELEASE, REQUIREMENTS = "3.11", "py311"
# What neither Blender nor a test imports: checks of the sources, and the wheels that the extension has of its own.
LEFT_OUT = ("clang-format", "clang-tidy", "fake-bpy-module-4.5", "import-linter", "mypy", "ruff", "setuptools")
OF_BLENDER = ("bpy", "numpy", "zstandard", "requests", "urllib3", "idna", "certifi", "charset-normalizer", "Cython")
GO_TOOLCHAIN = "go1.21.0"  # programs of later ones ask Wine 8 for a library that it has not
# Names of any letters reach Windows' programs, and nobody is asked whether to install Mono or Gecko.
_QUIET = {"LC_ALL": "C.UTF-8", "PYTHONUTF8": "1", "WINEDEBUG": "-all", "WINEDLLOVERRIDES": "mscoree,mshtml="}


class Unavailable(Exception):
    """What cannot be had on this machine."""


@dataclass(frozen=True)
class Windows:
    """folder: where all of it lies."""

    folder: Path
    platform: str = "windows-x64"
    wheels: str = "win_amd64"

    @property
    def environment(self) -> dict[str, str]:
        return {**os.environ, **_QUIET, "WINEPREFIX": str(self.folder / "prefix")}

    @cached_property
    def python(self) -> list[str]:
        """The command that runs its Python."""
        return [wine(), str(self._python_folder() / "python.exe")]

    def seen(self, path: Path) -> str:
        """What a path of ours is called there."""
        return str(PureWindowsPath("Z:/", *path.absolute().parts[1:]))

    def packages(self, name: str, wanted: dict[str, str]) -> Path:
        """A folder with wheels' contents, made of those for Windows."""
        folder, mark = self.folder / name, self.folder / f"{name}.made"
        listed = [f"{package}=={version}" for package, version in wanted.items()]
        if mark.exists() and mark.read_text(encoding="utf-8").split() == listed:
            return folder
        shutil.rmtree(folder, ignore_errors=True)
        command = [sys.executable, "-m", "pip", "install", "-q", "--disable-pip-version-check", "--no-deps"]
        command += ["--only-binary=:all:", "--implementation", "cp", "--python-version", RELEASE]
        if subprocess.run([*command, "--platform", self.wheels, "--target", str(folder), *listed]).returncode:
            raise Unavailable(f"packages for {self.platform}, which pip could not fetch")
        mark.write_text("\n".join(listed), encoding="utf-8")
        return folder

    def _python_folder(self) -> Path:
        folder = self.folder / "python"
        if not (folder / "python.exe").exists():
            go = shutil.which("go")
            if go is None:
                raise Unavailable("no go, by which a Python for Windows is fetched")
            program = self.folder / "foreign_python.exe"
            asked = {**os.environ, "GOOS": "windows", "GOARCH": "amd64", "GOTOOLCHAIN": GO_TOOLCHAIN}
            built = subprocess.run([go, "build", "-trimpath", "-o", str(program), "."], cwd=PYTHON, env=asked)
            if built.returncode:
                raise Unavailable("the module that brings a Python for Windows, which go could not fetch")
            run_piped([wine(), str(program), self.seen(folder)], self.environment)
        return folder


def wine() -> str:
    """Wine's command; Debian's packages are installed where this is root."""
    if shutil.which("wine") is None and os.geteuid() == 0 and shutil.which("apt-get"):
        environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
        for words in (["update"], ["install", "-y", "--no-install-recommends", "wine", "wine64"]):
            subprocess.run(["apt-get", "-q", *words], stdout=subprocess.DEVNULL, env=environment)
    found = shutil.which("wine")
    if found is None:
        raise Unavailable("no wine")
    return found


def blender(system: Windows) -> Path:
    """A folder with Blender as a module and what it requires."""
    pinned = pins(REQUIREMENTS)
    return system.packages("blender", {name: pinned[name] for name in OF_BLENDER if name in pinned})


def others(system: Windows) -> Path:
    """A folder with what tests import, and what the extension brings along."""
    kept = {name: version for name, version in pins(REQUIREMENTS).items() if name not in (*LEFT_OUT, *OF_BLENDER)}
    return system.packages("packages", kept)


def kernel(system: Windows) -> None:
    """Each of the kernel's own test programs ends with status 0, for every instruction set that is there."""
    os.environ["OCCLUSION_KERNEL_TARGET"] = system.platform
    work, tests = system.folder / "kernel", sorted(toolchain.TESTS.glob("*.cpp"))
    target = toolchain.target()
    assert target is not None
    linked = toolchain.compile_all(toolchain.sources(), toolchain.objects(target.tag), toolchain.OPTIMISED)
    compiled = toolchain.compile_all(tests, work, ["-O1", *FOR_TESTS])
    embree = only(others(system), "**/embree4*.dll")

    def run(test: Path) -> None:
        program = test.with_suffix(".exe")
        toolchain.run([*toolchain.compiler(), str(test), *map(str, linked), "-o", str(program)])
        run_piped([wine(), str(program), system.seen(embree)], system.environment)

    with ThreadPoolExecutor(toolchain.JOBS) as pool:
        list(pool.map(run, compiled))
    print(f"{len(tests)} of {len(tests)} kernel tests pass on {system.platform}")


def extension(system: Windows, archive: str) -> None:
    """In a profile and folders with umlauts, spaces, signs of Chinese, and paths longer than Windows' old 260."""
    with tempfile.TemporaryDirectory(prefix="occlusion-bake-") as folder:
        work = Path(folder, "Prüfung mit Größe", "遮蔽 烘焙", *["a long way down, where artists keep their files"] * 4)
        (work / "profile").mkdir(parents=True)
        os.environ |= system.environment
        bake_as_module(Path(archive).resolve(), system.python, blender(system), work, system.seen)
    print(f"{Path(archive).name} works on {system.platform}")


def suite(system: Windows, *words: str) -> None:
    """pytest on this checkout, with the wheel of the kernel for Windows."""
    # One that hangs shows where every thread stands, and is ended by pytest itself (pyproject.toml).
    furnish(system)
    run_piped([*system.python, "-B", "-m", "pytest", "-q", "-p", "no:cacheprovider", *words], system.environment)


def furnish(system: Windows) -> None:
    """Have its Python find this checkout, the kernel's wheel and all else, as if they were installed."""
    ours = system.folder / "ours"
    ours.mkdir(exist_ok=True)
    if not (link := ours / "occlusion_bake").is_symlink():
        link.symlink_to(ROOT)
    library = unpacked(ROOT / "build" / f"kernel-{system.platform}", system.folder / "library")
    folders = (ours, library, blender(system), others(system))
    site = Path(system.python[-1]).parent / "Lib" / "site-packages"
    site.mkdir(exist_ok=True)
    (site / "occlusion_bake.pth").write_text(
        "".join(f"{system.seen(folder)}\n" for folder in folders), encoding="utf-8"
    )


def unpacked(wheels: Path, folder: Path) -> Path:
    """What the one wheel in a folder holds."""
    shutil.rmtree(folder, ignore_errors=True)
    with zipfile.ZipFile(only(wheels, "*.whl")) as wheel:
        wheel.extractall(folder)
    return folder


def bits(system: Windows) -> None:
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
    if not arguments or arguments[0] not in VERBS:
        raise SystemExit(__doc__)
    verb, *rest = arguments
    system = Windows(ROOT / "build" / "foreign" / "windows-x64")
    system.folder.mkdir(parents=True, exist_ok=True)
    try:
        VERBS[verb](system, *rest)
    except Unavailable as what:
        print(f"SKIPPED {verb} on {system.platform}: {what}", flush=True)
        return 1 if os.environ.get("OCCLUSION_BAKE_NO_SKIP") else 0
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
