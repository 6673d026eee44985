"""Items of a manifest as an array of Slurm's, while things go wrong: a task is killed in mid-bake, a node drained."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TypeVar

from check_kernel import ROOT
from one_machine_slurm import NODES

_SUBMIT = ROOT / "farm" / "slurm" / "submit.sh"
_TASKS = range(1, 7)
_LONGEST = 300.0  # seconds that are waited for anything
_BAKED = re.compile(r"^.*: \d+x\d+, .* rays in", re.M)
_Found = TypeVar("_Found")


class SlurmArray:
    """environment: of Slurm's commands, and BLENDER. logs: a folder for what the tasks say, which is made."""

    def __init__(self, manifest: Path, environment: Mapping[str, str], logs: Path) -> None:
        self._manifest, self._environment, self._logs = manifest, environment, logs
        self._bake, self._merge = 0, 0  # jobs

    @property
    def said(self) -> str:
        """By all tasks that bake."""
        return "".join(map(self._log, _TASKS))

    @property
    def said_by_merge(self) -> str:
        return self._read(f"slurm-{self._merge}.out")

    def run_with_mishaps(self) -> None:
        """To its end. SystemExit where a mishap has other consequences than it should."""
        self._logs.mkdir()
        told = self._call(_SUBMIT, self._manifest, len(_TASKS))
        self._bake, self._merge = map(int, re.findall(r"job (\d+)", told))
        victim = self._kill_one()
        drained = NODES[1]
        self._wait_for("a task on the node to be drained", lambda: f" {drained}" in self._queue("running"))
        self._call("scontrol", "update", f"nodename={drained}", "state=drain", "reason=tried")
        self._wait_for("what those on it say", lambda: all(map(self._has_begun, self._tasks_on(drained))))
        before = self._begun_on(drained)
        if not self._queue("pending", "--jobs", self._bake):
            raise SystemExit("FAILED: all had been begun before a node was drained")
        self._wait_for("the end of all", lambda: not self._queue("pending,running,completing"))
        if self._begun_on(drained) != before:
            raise SystemExit(f"FAILED: {drained} was drained and went on\n{self.said}")
        if "restarts: 1" not in self._log(victim):
            raise SystemExit(f"FAILED: a task that was killed was not run again\n{self._log(victim)}")
        print(f"task {victim} was killed in mid-bake and run again, {drained} drained after {before} tasks")

    def _kill_one(self) -> int:
        """A task that has baked an item and is at the next one."""
        victim, *_ = self._wait_for("an item", lambda: list(filter(self._is_in_the_middle, _TASKS)))
        killed = processes_with(["--manifest", str(self._manifest), "--items", f"{victim}/{len(_TASKS)}"])
        for process in killed:
            with suppress(ProcessLookupError):
                os.kill(process, signal.SIGKILL)
        if not killed or len(_BAKED.findall(self._log(victim))) > 2:
            raise SystemExit(f"FAILED: task {victim} was not in mid-bake\n{self._log(victim)}")
        return victim

    def _is_in_the_middle(self, task: int) -> bool:
        return len(_BAKED.findall(self._log(task))) == 1

    def _begun_on(self, node: str) -> int:
        return self.said.count(f" on {node},")

    def _tasks_on(self, node: str) -> list[int]:
        return [int(task) for task in re.findall(rf"_(\d+) {node}$", self._queue("running"), re.M)]

    def _has_begun(self, task: int) -> bool:
        return "share " in self._log(task)

    def _queue(self, states: str, *words: object) -> str:
        """Jobs in these states, a line each, with their nodes."""
        return self._call("squeue", "--noheader", "--states", states, "--format", "%i %N", *words).strip()

    def _log(self, task: int) -> str:
        return self._read(f"slurm-{self._bake}_{task}.out")

    def _read(self, name: str) -> str:
        path = self._logs / name
        return path.read_text(encoding="utf-8", errors="replace") if path.exists() else ""

    def _call(self, *words: object) -> str:
        command = [str(word) for word in words]
        ran = subprocess.run(command, env=self._environment, cwd=self._logs, stdout=subprocess.PIPE, text=True)
        if ran.returncode:
            raise SystemExit(f"FAILED with status {ran.returncode}: {' '.join(command)}")
        return ran.stdout

    def _wait_for(self, what: str, look: Callable[[], _Found]) -> _Found:
        """What is found, once it is anything."""
        end = time.monotonic() + _LONGEST
        while not (found := look()):
            if time.monotonic() > end:
                raise SystemExit(f"FAILED: waited for {what} in vain\n{self.said}{self.said_by_merge}")
            time.sleep(0.05)
        return found


def processes_with(words: Sequence[str]) -> list[int]:
    """Processes that were called with these words, one after the other."""
    wanted, found = "\0".join(["", *words, ""]).encode(), []
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            called = path.read_bytes()
        except OSError:  # it has ended
            continue
        if wanted in called:
            found.append(int(path.parent.name))
    return found
