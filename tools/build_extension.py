"""build_extension.py KERNEL_WHEEL_FOLDER [PLATFORM]: the extension as a zip, with its wheels, under dist/.

PLATFORM: one of Blender's names, whose kernel's wheel is in the folder; this machine's where none is given.
"""

from __future__ import annotations

import re
import subprocess
import sys
import sysconfig
import tomllib
import zipfile
from pathlib import Path

from licences import parts

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


# Blender's names for the platforms, and the tags of wheels that run on each, as pip wants them spelt out.
TAGS = {
    "linux-x64": ("manylinux2014_x86_64", *(f"manylinux_2_{minor}_x86_64" for minor in range(17, 29))),
    "windows-x64": ("win_amd64",),
    "macos-arm64": tuple(f"macosx_{major}_0_arm64" for major in range(11, 15)),
    "macos-x64": (
        *(f"macosx_10_{minor}_x86_64" for minor in range(9, 17)),
        *(f"macosx_{major}_0_x86_64" for major in range(11, 15)),
    ),
}
# Where there are no such wheels: Blender brings Embree and OpenImageIO itself there.
BROUGHT_BY_BLENDER = ("windows-arm64",)
SYSTEMS = {"macosx": "macos", "win": "windows"}
MACHINES = {"x86_64": "x64", "amd64": "x64", "arm64": "arm64", "universal2": "arm64"}  # a Mac's Python of both kinds


def this_platform() -> str:
    """Blender's name of the platform we build on."""
    system, _, rest = sysconfig.get_platform().partition("-")
    machine = rest.rpartition("-")[2]
    return f"{SYSTEMS.get(system, system)}-{MACHINES.get(machine, machine)}"


def pins(name: str) -> dict[str, str]:
    """{package: version} of a requirements file and those it takes in."""
    found: dict[str, str] = {}
    for line in (ROOT / "requirements" / f"{name}.txt").read_text(encoding="utf-8").splitlines():
        if included := re.match(r"-r (\w+)\.txt", line):
            found |= pins(included[1])
        elif pinned := re.match(r"([\w.-]+)==(\S+)", line):
            found[pinned[1]] = pinned[2]
    return found


def fetched(package: str, version: str, python: str, platform: str) -> Path:
    """The wheel in the cache, downloaded where it is not there yet."""
    cache = CACHE / platform
    pattern = f"{package.lower()}-{version}-cp{python.replace('.', '')}-*.whl"
    if not list(cache.glob(pattern)):
        command = [sys.executable, "-m", "pip", "download", "-q", "--disable-pip-version-check", "--no-deps"]
        command += ["--only-binary=:all:", "--implementation", "cp", "--python-version", python, "-d", str(cache)]
        for tag in TAGS[platform]:
            command += ["--platform", tag]
        if subprocess.run([*command, f"{package}=={version}"]).returncode:
            raise SystemExit(f"{package} {version} for Python {python} on {platform} could not be downloaded")
    return only(cache, pattern)


def only(folder: Path, pattern: str) -> Path:
    """The one file in the folder that fits."""
    found = sorted(folder.glob(pattern))
    if len(found) != 1:
        raise SystemExit(f"{folder}: {len(found)} files fit {pattern}, there should be one; remove the folder")
    return found[0]


def wheels(kernel: Path, platform: str) -> list[Path]:
    """All wheels of the extension, in order."""
    chosen = [only(kernel, "occlusion_bake_kernel-*.whl")]
    if platform in BROUGHT_BY_BLENDER:
        return chosen
    for python, (requirements, packages) in PYTHONS.items():
        versions = pins(requirements)
        chosen += [fetched(package, versions[package], python, platform) for package in packages]
    return chosen


def manifest(platform: str, names: list[str]) -> str:
    """The checkout's manifest with the platform and the wheels, set before its first table."""
    text = (ROOT / "blender_manifest.toml").read_text(encoding="utf-8")
    text = re.sub(r"(?m)^# `platforms`.*\n", "", text)
    listed = "".join(f'    "./wheels/{name}",\n' for name in names)
    added = f'platforms = ["{platform}"]\nwheels = [\n{listed}]\n\n'
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
    """Write the archive beside its place, then rename. The same contents give the same bytes. The licences of what is
    bundled are in it, each once."""
    target.parent.mkdir(exist_ok=True)
    beside = target.with_suffix(".part")
    with zipfile.ZipFile(beside, "w") as archive:
        add(archive, "blender_manifest.toml", text.encode())
        for path in files:
            add(archive, path.relative_to(ROOT).as_posix(), path.read_bytes())
        for name, licence in licences(bundled).items():
            add(archive, f"licences/{name}", licence)
        for path in bundled:
            add(archive, f"wheels/{path.name}", path.read_bytes(), zipfile.ZIP_STORED)
    beside.replace(target)


def licences(bundled: list[Path]) -> dict[str, bytes]:
    """Texts by what they are called in the zip: the part and its file."""
    return {
        f"{part.title}/{name}": text
        for path in bundled
        for part in parts(path.name, path)
        for name, text in sorted(part.texts.items())
    }


def add(archive: zipfile.ZipFile, name: str, data: bytes, how: int = zipfile.ZIP_DEFLATED) -> None:
    """Put a file into the archive, dated 1980 and readable by all."""
    entry = zipfile.ZipInfo(name)
    entry.external_attr = 0o644 << 16
    entry.compress_type = how
    archive.writestr(entry, data)


def main(kernel: Path, platform: str) -> None:
    if platform not in (*TAGS, *BROUGHT_BY_BLENDER):
        raise SystemExit(f"no extension for {platform}: the wheels it needs exist for {', '.join(TAGS)}")
    files, bundled = staged(), wheels(kernel, platform)
    text = manifest(platform, [path.name for path in bundled])
    about = tomllib.loads(text)
    target = ROOT / "dist" / f"{about['id']}-{about['version']}-{platform.replace('-', '_')}.zip"
    write_zip(target, text, files, bundled)
    print(f"{target.relative_to(ROOT)}: {target.stat().st_size / 1e6:.1f} MB, {len(bundled)} wheels")


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3):
        raise SystemExit(__doc__)
    main(Path(sys.argv[1]), sys.argv[2] if len(sys.argv) == 3 else this_platform())
