"""Install a built extension into a fresh profile and bake with it.

try_extension.py ZIP BLENDER…        a real Blender, given as a command: blender
try_extension.py ZIP --bpy PYTHON    Blender as a module, in the Python that has it
"""

from __future__ import annotations

import json
import os
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

TOOLS = Path(__file__).resolve().parent
INSIDE = str(TOOLS / "in_blender.py")
PNG = b"\x89PNG\r\n\x1a\n"
BAKE = ("--size", "128")
TIMEOUT = 900


def call(command: Sequence[str], resources: Path, **more: str) -> None:
    """Run a command with a profile of its own. SystemExit where it fails."""
    print("+", shlex.join(command), flush=True)
    environment = {**os.environ, "BLENDER_USER_RESOURCES": str(resources), **more}
    status = subprocess.run(command, env=environment, stdin=subprocess.DEVNULL, timeout=TIMEOUT).returncode
    if status:
        raise SystemExit(f"FAILED with status {status}: {shlex.join(command)}")


def check_bake(output: Path, report: Path) -> None:
    """A picture was written and the report names it."""
    pictures = sorted(output.glob("*.png"))
    if not pictures or any(path.read_bytes()[:8] != PNG for path in pictures):
        raise SystemExit(f"FAILED: {len(pictures)} pictures in {output}, or one of them no PNG")
    objects = json.loads(report.read_text(encoding="utf-8"))["objects"]
    missing = [path for entry in objects for path in entry["files"].values() if not Path(path).is_file()]
    if not objects or missing:
        raise SystemExit(f"FAILED: the report names {len(objects)} objects and files that are not there: {missing}")
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
    run("-b", str(scene), "-c", "occlusion_bake", *BAKE, "--output", str(output), "--report", str(report))
    check_bake(output, report)
    run(*inside, "operator", "--", "charts")


def try_module(archive: Path, python: str, work: Path) -> None:
    """Blender as a module, which has no command line: one process does it all, without the environment's packages."""
    scene, output, report = work / "scene.blend", work / "baked", work / "report.json"
    alone = work / "alone"
    alone.mkdir()
    call([python, str(TOOLS / "link_bpy.py"), str(alone)], work / "profile")
    steps = [["install", str(archive)], ["check", str(work)], ["operator"], ["charts"], ["scene", str(scene)]]
    steps += [["command", str(scene), *BAKE, "--output", str(output), "--report", str(report)]]
    words = [word for step in steps for word in ["--", *step]]
    call([python, "-S", INSIDE, *words], work / "profile", PYTHONPATH=str(alone))
    check_bake(output, report)


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
