"""build_extension.py KERNEL_WHEEL_FOLDER: the extension as a zip for this platform, with its wheels, under dist/."""

from __future__ import annotations

import re
import subprocess
import sys
import sysconfig
import tomllib
import zipfile
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
CACHE = ROOT / "build" / "wheels"

# What goes in; all else (tests, benchmarks, samples, tools, the kernel's sources) stays out.
FILES = ("__init__.py", "__main__.py", "README.md", "LICENSE", "core/**/*.py", "addon/**/*.py")

# The Pythons that Blender uses, and which requirements file pins their wheels.
PYTHONS = {
    "3.11": ("py311", ("OpenImageIO", "embreex")),
    "3.13": ("py313", ("OpenImageIO", "embreex")),
    "3.14": ("py313", ("OpenImageIO", "embreex")),
}


@dataclass(frozen=True)
class Platform:
    """Blender's name for a platform, and the wheel tags that run there, as pip wants them spelt out."""

    name: str
    tags: tuple[str, ...]


PLATFORMS = {
    "linux-x86_64": Platform(
        "linux-x64", ("manylinux2014_x86_64", *(f"manylinux_2_{minor}_x86_64" for minor in range(17, 29)))
    ),
    "macosx-arm64": Platform("macos-arm64", tuple(f"macosx_{major}_0_arm64" for major in range(11, 15))),
    "win-amd64": Platform("windows-x64", ("win_amd64",)),
}


def this_platform() -> Platform:
    """The platform we build for. SystemExit where Blender or Embree's wheel has none like it."""
    found = re.sub(r"^macosx-[\d.]+-", "macosx-", sysconfig.get_platform())
    found = "macosx-arm64" if found == "macosx-universal2" else found
    if found not in PLATFORMS:
        raise SystemExit(f"no extension for {found}: the wheels it needs exist for {', '.join(PLATFORMS)}")
    return PLATFORMS[found]


def pins(name: str) -> dict[str, str]:
    """{package: version} of a requirements file and those it takes in."""
    found: dict[str, str] = {}
    for line in (ROOT / "requirements" / f"{name}.txt").read_text(encoding="utf-8").splitlines():
        if included := re.match(r"-r (\w+)\.txt", line):
            found |= pins(included[1])
        elif pinned := re.match(r"([\w.-]+)==(\S+)", line):
            found[pinned[1]] = pinned[2]
    return found


def fetched(package: str, version: str, python: str, platform: Platform) -> Path:
    """The wheel in the cache, downloaded where it is not there yet."""
    tag = "cp" + python.replace(".", "")
    pattern = f"{package.lower()}-{version}-{tag}-*.whl"
    if not list(CACHE.glob(pattern)):
        command = [sys.executable, "-m", "pip", "download", "-q", "--disable-pip-version-check", "--no-deps"]
        command += ["--only-binary=:all:", "--implementation", "cp", "--python-version", python, "-d", str(CACHE)]
        for name in platform.tags:
            command += ["--platform", name]
        if subprocess.run([*command, f"{package}=={version}"]).returncode:
            raise SystemExit(f"{package} {version} for Python {python} on {platform.name} could not be downloaded")
    return only(CACHE, pattern)


def only(folder: Path, pattern: str) -> Path:
    """The one file in the folder that fits."""
    found = sorted(folder.glob(pattern))
    if len(found) != 1:
        raise SystemExit(f"{folder}: {len(found)} files fit {pattern}, there should be one; remove the folder")
    return found[0]


def wheels(kernel: Path, platform: Platform) -> list[Path]:
    """All wheels of the extension, in order."""
    chosen = [only(kernel, "occlusion_bake_kernel-*.whl")]
    for python, (requirements, packages) in PYTHONS.items():
        versions = pins(requirements)
        chosen += [fetched(package, versions[package], python, platform) for package in packages]
    return chosen


def manifest(platform: Platform, names: list[str]) -> str:
    """The checkout's manifest with the platform and the wheels, set before its first table."""
    text = (ROOT / "blender_manifest.toml").read_text(encoding="utf-8")
    text = re.sub(r"(?m)^# `platforms`.*\n", "", text)
    listed = "".join(f'    "./wheels/{name}",\n' for name in names)
    added = f'platforms = ["{platform.name}"]\nwheels = [\n{listed}]\n\n'
    return re.sub(r"(?m)^\[(?!\[)", lambda table: added + table[0], text, count=1)


def staged() -> list[Path]:
    """The package's own files. SystemExit where one that must be there is missing."""
    found = []
    for pattern in FILES:
        matches = sorted(path for path in ROOT.glob(pattern) if not {"__pycache__", "kernel"} & set(path.parts))
        if not matches:
            raise SystemExit(f"{pattern} is missing; the extension needs it")
        found += matches
    return found


def write_zip(target: Path, text: str, files: list[Path], bundled: list[Path]) -> None:
    """Write the archive beside its place, then rename. The same contents give the same bytes."""
    target.parent.mkdir(exist_ok=True)
    beside = target.with_suffix(".part")
    with zipfile.ZipFile(beside, "w") as archive:
        add(archive, "blender_manifest.toml", text.encode())
        for path in files:
            add(archive, path.relative_to(ROOT).as_posix(), path.read_bytes())
        for path in bundled:
            add(archive, f"wheels/{path.name}", path.read_bytes(), zipfile.ZIP_STORED)
    beside.replace(target)


def add(archive: zipfile.ZipFile, name: str, data: bytes, how: int = zipfile.ZIP_DEFLATED) -> None:
    """Put a file into the archive, dated 1980 and readable by all."""
    entry = zipfile.ZipInfo(name)
    entry.external_attr = 0o644 << 16
    entry.compress_type = how
    archive.writestr(entry, data)


def main(kernel: Path) -> None:
    platform, files = this_platform(), staged()
    bundled = wheels(kernel, platform)
    text = manifest(platform, [path.name for path in bundled])
    about = tomllib.loads(text)
    target = ROOT / "dist" / f"{about['id']}-{about['version']}-{platform.name.replace('-', '_')}.zip"
    write_zip(target, text, files, bundled)
    print(f"{target.relative_to(ROOT)}: {target.stat().st_size / 1e6:.1f} MB, {len(bundled)} wheels")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        raise SystemExit(__doc__)
    main(Path(sys.argv[1]))
