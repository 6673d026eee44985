"""Cases measured in turns, since machines are noisy, and in processes of their own where one would disturb the next."""

from __future__ import annotations

import json
import statistics
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, TypeVar

from ..addon.cli.hard_exit import run_and_exit

_Run = TypeVar("_Run")


def in_turns(cases: Mapping[str, Callable[[int], _Run]], rounds: int) -> dict[str, list[_Run]]:
    """What the cases give, by name, a run a round. Each is called with the round's number, all in every round."""
    runs: dict[str, list[_Run]] = {name: [] for name in cases}
    for number in range(rounds):
        for name, case in cases.items():
            runs[name].append(case(number))
    return runs


def medians(runs: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """The median of each figure."""
    return {name: statistics.median(run[name] for run in runs) for name in runs[0]}


def in_child(function: Callable[..., Any], *arguments: object, environment: Mapping[str, str] | None = None) -> Any:
    """What a function of a module gives in a fresh process; what it takes and gives is JSON."""
    command = [sys.executable, "-m", __name__, function.__module__, function.__name__, json.dumps(arguments)]
    answer = subprocess.run(command, env=environment, check=True, stdout=subprocess.PIPE, text=True).stdout
    return json.loads(answer.splitlines()[-1])


def peak_memory(process: int | str = "self") -> float:
    """The most that a process, this one by default, has held, GB; 0 of one that has ended. Not ru_maxrss, which a
    process takes over from the one that started it."""
    try:
        lines = Path(f"/proc/{process}/status").read_text(encoding="utf-8").splitlines()
    except OSError:
        return 0.0
    return next((int(line.split()[1]) / 1048576.0 for line in lines if line.startswith("VmHWM")), 0.0)


def _answer(words: Sequence[str]) -> int:
    """The child's side of `in_child`."""
    module, name, given = words
    print(json.dumps(getattr(import_module(module), name)(*json.loads(given))))
    return 0


if __name__ == "__main__":
    run_and_exit(_answer)
