"""Install a built extension into a fresh profile and bake with it.

try_extension.py ZIP BLENDER…        a real Blender, given as a command: blender
try_extension.py ZIP --bpy PYTHON    Blender as a module, in the Python that has it
"""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys
import tempfile
import tomllib
import zipfile
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Timer

TOOLS = Path(__file__).resolve().parent
INSIDE = str(TOOLS / "in_blender.py")
MANIFEST = "blender_manifest.toml"
PNG = b"\x89PNG\r\n\x1a\n"
BAKE = ("--size", "128", "--compare-cycles", "4")
TIMEOUT = 900


def call(command: Sequence[str], resources: Path, seen: Callable[[Path], str] = str, **more: str) -> None:
    """Run a command with a profile of its own. SystemExit where it fails."""
    run_piped(command, {**environment_of(resources, seen), **more})


def run_piped(command: Sequence[str], environment: dict[str, str]) -> str:
    """Run a command and pass on what it writes, which is returned. SystemExit where it fails. Through a pipe: Windows'
    programs under Wine take a file for no handle at all."""
    print("+", shlex.join(command), flush=True)
    pipe, none = subprocess.PIPE, subprocess.DEVNULL
    with subprocess.Popen(command, env=environment, stdin=none, stdout=pipe, stderr=subprocess.STDOUT) as child:
        watch = Timer(TIMEOUT, child.kill)
        watch.start()
        assert child.stdout is not None
        said = []
        for line in child.stdout:
            said.append(line)
            sys.stdout.buffer.write(line)
            sys.stdout.buffer.flush()
        watch.cancel()
    if child.returncode:
        raise SystemExit(f"FAILED with status {child.returncode}: {shlex.join(command)}")
    return b"".join(said).decode(errors="replace")


def environment_of(resources: Path, seen: Callable[[Path], str] = str) -> dict[str, str]:
    """That of a Blender with this profile."""
    return {**os.environ, "BLENDER_USER_RESOURCES": seen(resources)}


def version_of(archive: Path) -> str:
    with zipfile.ZipFile(archive) as opened:
        return str(tomllib.loads(opened.read(MANIFEST).decode())["version"])


def newer(archive: Path, folder: Path) -> Path:
    """The same extension, its last number one up."""
    old = version_of(archive)
    first, _, last = old.rpartition(".")
    new = f"{first}.{int(last) + 1}"
    target = folder / archive.name.replace(old, new)
    with zipfile.ZipFile(archive) as opened, zipfile.ZipFile(target, "w") as written:
        for entry in opened.infolist():
            data = opened.read(entry)
            if entry.filename == MANIFEST:
                data = re.sub(rb'(?m)^version = ".*"', f'version = "{new}"'.encode(), data)
            written.writestr(entry, data)
    return target


def check_bake(output: Path, report: Path, seen: Callable[[Path], str] = str) -> None:
    """Pictures were written and the report names them, and each object was compared. seen: as in `bake_as_module`."""
    pictures = sorted(output.glob("*.png"))
    if not pictures or any(path.read_bytes()[:8] != PNG for path in pictures):
        raise SystemExit(f"FAILED: {len(pictures)} pictures in {output}, or one of them no PNG")
    objects = json.loads(report.read_text(encoding="utf-8"))["objects"]
    if any("cycles" not in entry for entry in objects):
        raise SystemExit("FAILED: an object was not compared with Cycles")
    named = {path for entry in objects for path in entry["files"].values()}
    written = {seen(path) for path in pictures}
    if not named or not named <= written:
        raise SystemExit(f"FAILED: the report names {sorted(named)}, written were {sorted(written)}")
    print(f"baked {', '.join(path.name for path in pictures)}")


def try_blender(archive: Path, blender: Sequence[str], work: Path) -> None:
    """A real Blender, through its own commands."""
    scene, output, report = work / "scene.blend", work / "baked", work / "report.json"

    def run(*arguments: str) -> None:
        call([*blender, *arguments], work / "profile")

    run("--command", "extension", "validate", str(archive))
    run("--command", "extension", "install-file", "-r", "user_default", "-e", str(archive))
    inside = ("-b", "--python-exit-code", "1", "-P", INSIDE, "--")
    run(*inside, "check", str(work), "--", "scene", str(scene))
    bake = ("-b", str(scene), "-c", "occlusion_bake", *BAKE, "--output", str(output), "--report", str(report))
    run(*inside, "again")
    with ThreadPoolExecutor(2) as both:  # two Blenders at once, of one profile
        other = both.submit(run, *inside, "operator", "--", "charts")
        run(*bake)
        other.result()
    check_bake(output, report)


def try_module(archive: Path, python: str, work: Path) -> None:
    """Blender as a module, which has no command line: one process does it all, without the environment's packages."""
    alone = work / "alone"
    alone.mkdir()
    call([python, str(TOOLS / "link_bpy.py"), str(alone)], work / "profile")
    bake_as_module(archive, [python], alone, work)


def bake_as_module(
    archive: Path, python: Sequence[str], alone: Path, work: Path, seen: Callable[[Path], str] = str
) -> None:
    """All that is tried in one process. python: the command that runs it. alone: a folder with bpy and what that wants.
    seen: what a path here is called there."""
    scene, output, report = work / "scene.blend", work / "baked", work / "report.json"
    said = ["--output", seen(output), "--report", seen(report)]
    later = newer(archive, work)
    # The scene first: factory settings know of no extension.
    steps = [["scene", seen(scene)], ["install", seen(archive)], ["again"], ["check", seen(work)], ["operator"]]
    steps += [["charts"], ["command", seen(scene), *BAKE, *said]]
    steps += [["install", seen(later)], ["version", version_of(later)], ["command", seen(scene), *BAKE, *said]]
    words = [word for step in steps for word in ["--", *step]]
    call([*python, "-S", seen(Path(INSIDE)), *words], work / "profile", seen=seen, PYTHONPATH=seen(alone))
    check_bake(output, report, seen)


def main(arguments: Sequence[str]) -> None:
    if len(arguments) < 2:
        raise SystemExit(__doc__)
    archive = Path(arguments[0]).resolve()
    with tempfile.TemporaryDirectory(prefix="occlusion-bake-") as folder:
        work = Path(folder).resolve()
        (work / "profile").mkdir()
        if arguments[1] == "--bpy":
            try_module(archive, arguments[2], work)
        else:
            try_blender(archive, arguments[1:], work)
    print(f"{archive.name} works in {shlex.join(arguments[1:])}")


if __name__ == "__main__":
    main(sys.argv[1:])
