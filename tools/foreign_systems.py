"""Other systems on this Linux machine: Windows by Wine, Linux on arm64 by qemu; each with a Python of its own."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path, PureWindowsPath
from typing import ClassVar

from build_extension import only, pins
from try_extension import run_piped

RELEASE, REQUIREMENTS = "3.11", "py311"
_PYTHON = Path(__file__).resolve().parent / "foreign_python"  # the Go program that brings it along
# What neither Blender nor a test imports: checks of the sources, and the wheels that the extension has of its own.
_LEFT_OUT = ("clang-format", "clang-tidy", "fake-bpy-module-4.5", "import-linter", "mypy", "ruff", "setuptools")
_OF_BLENDER = ("bpy", "numpy", "zstandard", "requests", "urllib3", "idna", "certifi", "charset-normalizer", "Cython")


class Unavailable(Exception):
    """What cannot be had on this machine."""


@dataclass(frozen=True)
class System(ABC):
    """folder: where all of it lies. platform: Blender's name. wheels: pip's name for it. go: its system and processor
    in Go's words. toolchain: the release of Go whose programs run there; "" is this machine's."""

    folder: Path
    platform: ClassVar[str]
    wheels: ClassVar[str]
    go: ClassVar[tuple[str, str]]
    toolchain: ClassVar[str]

    @property
    @abstractmethod
    def runner(self) -> list[str]:
        """What its programs are run by. Raises Unavailable."""

    @property
    @abstractmethod
    def environment(self) -> dict[str, str]:
        """That of its programs."""

    @property
    @abstractmethod
    def embree(self) -> str:
        """The path of an Embree, as its programs have it."""

    @property
    @abstractmethod
    def site(self) -> Path:
        """Where its Python has its packages."""

    @property
    @abstractmethod
    def packages(self) -> list[Path]:
        """Folders with what is imported there, beside our own."""

    @abstractmethod
    def seen(self, path: Path) -> str:
        """What a path of ours is called there."""

    @property
    def python(self) -> list[str]:
        """The command that runs its Python. Raises Unavailable."""
        return [*self.runner, str(self._python())]

    @abstractmethod
    def _python(self) -> Path: ...

    def fetch_python(self) -> Path:
        """Its folder, filled on first use by a program of Go's for this system."""
        folder, program = self.folder / "python", self.folder / "foreign_python.exe"
        if folder.exists():
            return folder
        go, (system, processor) = shutil.which("go"), self.go
        if go is None:
            raise Unavailable("no go, by which its Python is fetched")
        asked = {**os.environ, "GOOS": system, "GOARCH": processor, "GOTOOLCHAIN": self.toolchain or "local"}
        if subprocess.run([go, "build", "-trimpath", "-o", str(program), "."], cwd=_PYTHON, env=asked).returncode:
            raise Unavailable("the module that brings its Python, which go could not fetch")
        beside = folder.with_name("python.part")
        shutil.rmtree(beside, ignore_errors=True)
        run_piped([*self.runner, str(program), self.seen(beside)], self.environment)
        return beside.rename(folder)

    def fetch(self, name: str, wanted: Sequence[str]) -> Path:
        """A folder with the contents of these wheels, pinned, made of those for this system."""
        pinned, folder, mark = pins(REQUIREMENTS), self.folder / name, self.folder / f"{name}.made"
        listed = [f"{package}=={pinned[package]}" for package in wanted if package in pinned]
        if mark.exists() and mark.read_text(encoding="utf-8").split() == listed:
            return folder
        shutil.rmtree(folder, ignore_errors=True)
        command = [sys.executable, "-m", "pip", "install", "-q", "--disable-pip-version-check", "--no-deps"]
        command += ["--only-binary=:all:", "--implementation", "cp", "--python-version", RELEASE]
        if subprocess.run([*command, "--platform", self.wheels, "--target", str(folder), *listed]).returncode:
            raise Unavailable("packages for it, which pip could not fetch")
        mark.write_text("\n".join(listed), encoding="utf-8")
        return folder


class Windows(System):
    """By Wine, with Blender as a module."""

    platform, wheels, go = "windows-x64", "win_amd64", ("windows", "amd64")
    toolchain = "go1.21.0"  # programs of later ones ask Wine 8 for a library that it has not

    @cached_property
    def runner(self) -> list[str]:
        wine = [program("wine", "wine", "wine64")]
        # The first program of all makes the prefix, and one that begins meanwhile may fail.
        run_piped([*wine, "wineboot", "--init"], self.environment)
        return wine

    @property
    def environment(self) -> dict[str, str]:
        """Names of any letters reach its programs, and nobody is asked whether to install Mono or Gecko."""
        quiet = {"LC_ALL": "C.UTF-8", "PYTHONUTF8": "1", "WINEDEBUG": "-all", "WINEDLLOVERRIDES": "mscoree,mshtml="}
        return {**os.environ, **quiet, "WINEPREFIX": str(self.folder / "prefix")}

    @property
    def embree(self) -> str:
        return self.seen(only(self.others, "**/embree4*.dll"))

    @property
    def site(self) -> Path:
        return self.fetch_python() / "Lib" / "site-packages"

    @property
    def packages(self) -> list[Path]:
        return [self.blender, self.others]

    @cached_property
    def blender(self) -> Path:
        """A folder with Blender as a module and what it requires."""
        return self.fetch("blender", _OF_BLENDER)

    @cached_property
    def others(self) -> Path:
        """A folder with what tests import, and what the extension brings along."""
        return self.fetch("packages", [name for name in pins(REQUIREMENTS) if name not in (*_LEFT_OUT, *_OF_BLENDER)])

    def seen(self, path: Path) -> str:
        return str(PureWindowsPath("Z:/", *path.absolute().parts[1:]))

    def _python(self) -> Path:
        return self.fetch_python() / "python.exe"


class Arm64(System):
    """Linux by qemu, with Debian's Embree; without Blender, which there is none of."""

    platform, wheels, go, toolchain = "linux-arm64", "manylinux2014_aarch64", ("linux", "arm64"), ""
    _SUITE, _PACKAGES = "trixie", ("libembree4-4", "zlib1g")  # and what those need

    @property
    def runner(self) -> list[str]:
        return [program("qemu-aarch64", "qemu-user"), "-L", str(self._root)]

    @property
    def environment(self) -> dict[str, str]:
        return {**os.environ, "OCCLUSION_BAKE_EMBREE": self.embree}

    @property
    def embree(self) -> str:
        return "libembree4.so.4"

    @property
    def site(self) -> Path:
        return self.fetch_python() / "lib" / f"python{RELEASE}" / "site-packages"

    @property
    def packages(self) -> list[Path]:
        return [self.fetch("packages", ["numpy"])]

    def seen(self, path: Path) -> str:
        return str(path)

    def _python(self) -> Path:
        return self.fetch_python() / "bin" / "python3"

    @cached_property
    def _root(self) -> Path:
        """Debian's libraries for arm64, by an apt that knows of nothing else."""
        root, apt = self.folder / "root", self.folder / "apt"
        if root.exists():
            return root
        if shutil.which("apt-get") is None:
            raise Unavailable("no apt-get, by which its libraries are fetched")
        for place in ("lists/partial", "archives/partial"):
            (apt / place).mkdir(parents=True, exist_ok=True)
        (apt / "status").touch()
        keys = "/usr/share/keyrings/debian-archive-keyring.gpg"
        source = f"deb [arch=arm64 signed-by={keys}] http://deb.debian.org/debian {self._SUITE} main\n"
        (apt / "sources.list").write_text(source, encoding="utf-8")
        (apt / "apt.conf").write_text(
            f"""APT::Architecture "arm64"; APT::Architectures {{ "arm64"; }}; APT::Sandbox::User "root";
Dir::Etc::sourcelist "{apt}/sources.list"; Dir::Etc::sourceparts "-"; Dir::State "{apt}";
Dir::State::status "{apt}/status"; Dir::Cache "{apt}"; Acquire::Languages "none";
""",
            encoding="utf-8",
        )
        asked = {**os.environ, "APT_CONFIG": str(apt / "apt.conf")}
        fetch = ["install", "-y", "--download-only", "--no-install-recommends", *self._PACKAGES]
        for words in (["update"], fetch):
            if subprocess.run(["apt-get", "-q", *words], env=asked, stdout=subprocess.DEVNULL).returncode:
                raise Unavailable("Debian's libraries for arm64, which apt-get could not fetch")
        beside = root.with_name("root.part")
        (beside / "usr" / "lib").mkdir(parents=True, exist_ok=True)
        (beside / "lib").symlink_to("usr/lib")
        for package in sorted((apt / "archives").glob("*.deb")):
            subprocess.run(["dpkg", "-x", str(package), str(beside)], check=True)
        return beside.rename(root)


def program(name: str, *packages: str) -> str:
    """A command's path; its packages of Debian's are installed where this is root. Raises Unavailable."""
    if shutil.which(name) is None and os.geteuid() == 0 and shutil.which("apt-get"):
        environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
        for words in (["update"], ["install", "-y", "--no-install-recommends", *packages]):
            subprocess.run(["apt-get", "-q", *words], stdout=subprocess.DEVNULL, env=environment)
    found = shutil.which(name)
    if found is None:
        raise Unavailable(f"no {name}")
    return found


def skipped(what: str, missing: Unavailable) -> int:
    """Say that a check was left out; the status to end with: 0, but 1 where the environment has
    OCCLUSION_BAKE_NO_SKIP."""
    print(f"SKIPPED {what}: {missing}", flush=True)
    return 1 if os.environ.get("OCCLUSION_BAKE_NO_SKIP") else 0


SYSTEMS: tuple[type[System], ...] = (Windows, Arm64)
