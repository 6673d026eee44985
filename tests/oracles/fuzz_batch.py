"""A batch of fuzzing: cases of one property, in a child process that may crash or hang.

A batch is repeated by its seed; a child notes each case before it runs it, so that the last note of one that dies is
the case that killed it.
"""

from __future__ import annotations

import random
import subprocess
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import seed as seeded
from hypothesis import strategies as st

from .properties import PROPERTIES

BATCH = 200  # cases
ENOUGH = 5  # failures of one property
LIMIT = 1800.0  # seconds a batch may take: a hundred times what it does
HANGS = 124
PHASES = [Phase.generate, Phase.shrink]
START = ("-m", "occlusion_bake.tests.oracles.fuzz_batch")


def run_batch(name: str, seed: int, cases: int, note: Path) -> None:
    """Draw and check so many cases; writes each to `note` first. Raises AssertionError for the smallest that fails."""
    chosen = PROPERTIES[name]
    warnings.simplefilter("ignore", RuntimeWarning)  # numpy's, on overflow: wild cases are meant to

    @seeded(seed)
    @settings(
        max_examples=cases,
        deadline=None,
        database=None,
        phases=PHASES,
        suppress_health_check=[*HealthCheck],
    )
    @given(st.tuples(*chosen.cases))
    def holds(case: tuple[Any, ...]) -> None:
        note.write_text(f"{name}{case!r}", encoding="utf-8")
        with note.with_suffix(".count").open("a") as count:
            count.write(".")
        chosen.check(*case)

    holds()


def child(
    name: str, seed: int, cases: int, start: Sequence[str] = START, environment: Mapping[str, str] | None = None
) -> dict[str, Any]:
    """One batch in a process of its own: property, seed, how many cases ran, status and, where it failed, what with.

    start: how Python starts this module's `main`.
    """
    with tempfile.TemporaryDirectory() as folder:
        note = Path(folder) / "case"
        command = [sys.executable, *start, name, str(seed), str(cases), str(note)]
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT, env=environment, check=False)
            status, said = done.returncode, done.stdout + done.stderr
        except subprocess.TimeoutExpired:
            status, said = HANGS, f"no end within {LIMIT:g} s"
        counted = note.with_suffix(".count")
        result = {"property": name, "seed": seed, "status": status, "cases": 0}
        result["cases"] = counted.stat().st_size if counted.exists() else 0
        if status != 0:
            result["case"] = note.read_text(encoding="utf-8") if note.exists() else "none"
            result["said"] = said[-3000:]
    return result


def long_run(
    name: str,
    cases: int,
    seeds: random.Random,
    say: Callable[[str], None],
    start: Sequence[str] = START,
    environment: Mapping[str, str] | None = None,
) -> dict[str, Any]:
    """A property's cases, batch by batch. say: takes a line for each that fails, and one at the end; after ENOUGH that
    fail it is left."""
    began, done = time.monotonic(), 0
    failures: list[dict[str, Any]] = []
    while done < cases and len(failures) < ENOUGH:
        result = child(name, seeds.getrandbits(31), min(BATCH, cases - done), start, environment)
        done += max(1, result["cases"])
        if result["status"] != 0:
            failures.append(result)
            say(complaint(result))
    say(f"{name}: {done} cases, {len(failures)} failures, {time.monotonic() - began:.0f} s")
    return {"property": name, "cases": done, "failures": failures}


def complaint(result: Mapping[str, Any]) -> str:
    """What went wrong in a batch, and how to run it again."""
    head = f"FAILED {result['property']}, seed {result['seed']}, status {result['status']}: {result['case']}"
    return f"{head}\n{result['said']}"


def main(arguments: Sequence[str]) -> int:
    """The child: PROPERTY SEED CASES NOTE. 0 where the property held."""
    name, seed, cases, note = arguments
    try:
        run_batch(name, int(seed), int(cases), Path(note))
    except Exception:
        traceback.print_exc()
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
