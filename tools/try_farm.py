"""Share out a bake by the engines that farms have, and compare what comes of it with one run, to the last byte.

try_farm.py                     by Blender as a module
try_farm.py ZIP BLENDER…        by a complete Blender with the extension, given as a command

The job bundle by openjd, two sessions side by side; and the array by Slurm on two nodes, a task of it killed in
mid-bake, a node drained. Where Slurm cannot be had, a line says so; the status is then 0, but 1 where the environment
has OCCLUSION_BAKE_NO_SKIP.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import sys
import tempfile
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from check_kernel import ROOT
from foreign_systems import Unavailable, skipped
from one_machine_slurm import slurm
from slurm_array import SlurmArray
from try_extension import call, run_piped

TOOLS = Path(__file__).resolve().parent
BUNDLES = ROOT / "farm" / "openjd" / "make_bundle.py"
BAKE = ("--maps", "ao", "ro", "--size", "256", "--error", "0.01")
PER_TASK = 3  # items


@dataclass(frozen=True)
class Blender(ABC):
    """program: a command that takes Blender's words, as far as engines use them."""

    program: Path

    @abstractmethod
    def script(self, path: Path, *words: str) -> list[str]:
        """The command that runs a script."""

    @abstractmethod
    def on(self, level: Path, *words: str, verb: Sequence[str] = ()) -> list[str]:
        """The extension's command on a file."""


class Module(Blender):
    """Blender as a module, in this Python."""

    @classmethod
    def made(cls, work: Path) -> Module:
        return cls(_script(work, f'shift 3\nexec {shlex.join(cls._command())} "$@"'))

    def script(self, path: Path, *words: str) -> list[str]:
        return [sys.executable, str(path), "--", *words]

    def on(self, level: Path, *words: str, verb: Sequence[str] = ()) -> list[str]:
        return [*self._command(), *verb, str(level), *words]

    @staticmethod
    def _command() -> list[str]:
        return [sys.executable, "-m", "occlusion_bake"]


class Complete(Blender):
    """A Blender with windows, and a profile that has the extension."""

    @classmethod
    def made(cls, archive: Path, blender: Sequence[str], work: Path) -> Complete:
        profile, found = work / "profile", str(Path(shutil.which(blender[0]) or blender[0]).resolve())
        profile.mkdir()
        command = [found, *blender[1:]]
        call([*command, "--command", "extension", "install-file", "-r", "user_default", "-e", str(archive)], profile)
        home = f"cd {shlex.quote(str(work))}\nexport BLENDER_USER_RESOURCES={shlex.quote(str(profile))}"
        return cls(_script(work, f'{home}\nexec {shlex.join(command)} "$@"'))

    def script(self, path: Path, *words: str) -> list[str]:
        return [str(self.program), "--background", "--python-exit-code", "1", "--python", str(path), "--", *words]

    def on(self, level: Path, *words: str, verb: Sequence[str] = ()) -> list[str]:
        return [str(self.program), "--background", str(level), "--command", "occlusion_bake", *verb, *words]


def _script(work: Path, text: str) -> Path:
    path = work / "blender"
    path.write_text(f"#!/bin/sh\n{text}\n", encoding="utf-8")
    path.chmod(0o755)
    return path


class Farm:
    """A level, its plan, and a Blender that bakes items of it."""

    def __init__(self, work: Path, blender: Blender) -> None:
        self.work, self.blender = work, blender
        self._planned, self._whole = work / "planned", work / "whole"

    def prepare(self) -> None:
        level, scene = self.work / "level.blend", Path(shutil.copy(TOOLS / "farm_scene.py", self.work))
        run(self.blender.script(scene, str(level)))
        run(self.blender.on(level, *BAKE, "--output", str(self._whole)))
        run(self.blender.on(level, *BAKE, "--output", str(self._planned), verb=["plan"]))

    def copied(self, name: str) -> Path:
        """The manifest, in a folder of its own with all that belongs to it."""
        return Path(shutil.copytree(self._planned, self.work / name)) / "manifest.json"

    @cached_property
    def whole(self) -> dict[str, bytes]:
        """The images of one run."""
        return images(self._whole)

    @cached_property
    def items(self) -> Counter[str]:
        """How many each object has."""
        manifest = json.loads((self._planned / "manifest.json").read_text(encoding="utf-8"))
        return Counter(item["name"] for item in manifest["items"])

    def check(self, manifest: Path, said: str) -> None:
        """All images are those of one run, and no item was baked twice. said: by the tasks. SystemExit where not."""
        ours = images(manifest.parent)
        if other := [name for name in self.whole.keys() | ours if ours.get(name) != self.whole.get(name)]:
            raise SystemExit(f"FAILED: missing, too many, or of other bytes: {', '.join(sorted(other))}")
        baked = Counter(re.findall(rf"({'|'.join(map(re.escape, self.items))}): \d+x\d+, ", said))
        if twice := baked - self.items:
            raise SystemExit(f"FAILED: baked more than once: {', '.join(twice)}")
        if baked.total() < self.items.total() - 1:  # one may be killed before it tells
            raise SystemExit(f"FAILED: {self.items.total()} items, and told were {baked.total()}")
        print(
            f"{len(ours)} images of {self.items.total()} items are those of one run, byte by byte; none was baked twice"
        )


def images(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.glob("*.png")}


def run(command: Sequence[str]) -> str:
    return run_piped(command, dict(os.environ))


def try_openjd(farm: Farm) -> None:
    """Two sessions, which take turns in the tasks, then the merge."""
    manifest, bundle = farm.copied("openjd"), farm.work / "bundle"
    per_task = ["--items-per-task", str(PER_TASK)]
    run([sys.executable, str(BUNDLES), str(manifest), str(bundle), "--blender", str(farm.blender.program), *per_task])
    openjd, template = str(Path(sys.executable).with_name("openjd")), str(bundle / "template.yaml")
    run([openjd, "check", template, "--extensions", "TASK_CHUNKING"])
    step = [openjd, "run", template, "-p", f"file://{bundle}/parameters.json", "--step"]
    count = farm.items.total()
    tasks = [{"Items": f"{first}-{min(first + PER_TASK, count) - 1}"} for first in range(0, count, PER_TASK)]
    with ThreadPoolExecutor(2) as sessions:
        shares = (json.dumps(tasks[::2]), json.dumps(tasks[1::2]))
        said = "".join(sessions.map(lambda own: run([*step, "Bake", "--tasks", own]), shares))
    run([*step, "Merge"])
    farm.check(manifest, said)


def try_slurm(farm: Farm) -> None:
    """Raises Unavailable."""
    manifest = farm.copied("slurm")
    with slurm() as environment:
        array = SlurmArray(manifest, {**environment, "BLENDER": str(farm.blender.program)}, farm.work / "logs")
        array.run_with_mishaps()
    farm.check(manifest, array.said)
    if f"{farm.items.total()} of {farm.items.total()} items are baked" not in array.said_by_merge:
        raise SystemExit(f"FAILED: the merge says\n{array.said_by_merge}")


def main(arguments: Sequence[str]) -> int:
    if len(arguments) == 1:
        raise SystemExit(__doc__)
    with tempfile.TemporaryDirectory(prefix="occlusion-bake-") as folder:
        work = Path(folder).resolve()
        archive = Path(arguments[0]).resolve() if arguments else None
        farm = Farm(work, Complete.made(archive, arguments[1:], work) if archive else Module.made(work))
        farm.prepare()
        try_openjd(farm)
        try:
            try_slurm(farm)
        except Unavailable as missing:
            return skipped("Slurm", missing)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
