"""The long run of the property tests: thousands of new cases, in child processes that may crash or hang.

python -m occlusion_bake.bench.truth.fuzz [--seed S] [--share X] [PROPERTY...]

Each batch is a child with a time limit. A batch is repeated by its seed; a child notes each case before it runs it, so
that the last note of one that dies is the case that killed it.
"""

from __future__ import annotations

import argparse
import json
import random
import subprocess
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import seed as seeded
from hypothesis import strategies as st

from .properties import PROPERTIES

BATCH = 200  # cases
LIMIT = 1800.0  # seconds a batch may take: a hundred times what it does
HANGS = 124
PHASES = [Phase.generate, Phase.shrink]


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
    name: str,
    seed: int,
    cases: int,
    start: Sequence[str] = ("-m", "occlusion_bake.bench.truth.fuzz"),
    environment: dict[str, str] | None = None,
) -> dict[str, Any]:
    """One batch in a process of its own: property, seed, how many cases ran, status and, where it failed, what with.

    start: how Python starts this module's `main`.
    """
    with tempfile.TemporaryDirectory() as folder:
        note = Path(folder) / "case"
        command = [sys.executable, *start, "--batch", name, str(seed), str(cases), str(note)]
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


def complaint(result: dict[str, Any]) -> str:
    """What went wrong in a batch, and how to run it again."""
    head = f"FAILED {result['property']}, seed {result['seed']}, status {result['status']}: {result['case']}"
    return f"{head}\n{result['said']}"


def measure(chosen: argparse.Namespace) -> dict[str, Any]:
    """Every property, or those named: batches with fresh seeds. `chosen`: properties, seed, share of the cases."""
    seeds = random.Random(getattr(chosen, "seed", None))
    share = getattr(chosen, "share", None) or 1.0
    rows = []
    for name in getattr(chosen, "properties", None) or PROPERTIES:
        start, cases = time.monotonic(), 0
        failures: list[dict[str, Any]] = []
        wanted = max(1, round(PROPERTIES[name].long * share))
        while cases < wanted and len(failures) < 5:
            result = child(name, seeds.getrandbits(31), min(BATCH, wanted - cases))
            cases += max(1, result["cases"])
            if result["status"] != 0:
                failures.append(result)
                print(complaint(result), flush=True)
        rows.append({"property": name, "cases": cases, "failures": failures})
        print(f"{name}: {cases} cases, {len(failures)} failures, {time.monotonic() - start:.0f} s", flush=True)
    return {"properties": rows}


def page(result: dict[str, Any]) -> list[str]:
    """The section of the page."""
    rows = result["properties"]
    total, failed = sum(row["cases"] for row in rows), sum(len(row["failures"]) for row in rows)
    lines = [
        "## Fuzzing",
        "",
        f"{total:,} random cases, {failed} failures: meshes, UVs, normals, transforms and settings that no artist "
        "would make on purpose (not finite, 1e30, 1e-30, without area, empty, mirrored, flattened), each a new one, in "
        "processes of their own so that a crash or a hang would show.",
        "",
        "| what must hold | cases | failures |",
        "|---|---|---|",
    ]
    lines += [f"| {MEANING[row['property']]} | {row['cases']:,} | {len(row['failures'])} |" for row in rows]
    return lines


MEANING = {
    "is_sound": "refused in one line that names the object or the setting, or finite and within its weights' range",
    "farther_never_brightens": "a larger distance never raises a value, texel by texel",
    "an_occluder_never_brightens": "one more occluder never raises a value, texel by texel",
    "powers_of_two_change_no_bit": "scene and distance scaled by a power of two: not a bit changes",
    "stray_vertices_change_no_bit": "loose vertices, however far off: not a bit changes",
    "scale_changes_nothing_but_grazing_rays": "scaled by any other factor: the mean by 2 % at most, by grazing rays",
    "motion_changes_nothing_but_noise": "turned and moved: nothing beyond six sigmas, and one texel",
    "texels_are_sound": "texels: owners exist, coverage within [0, 1], nothing left out, threads change nothing",
    "texels_hold_the_area_of_their_triangles": "coverage adds up to the area of the triangles; mirrored UVs mirror it",
    "margins_stay_between": "margins stay between the covered values; covered texels keep their bits",
    "comparisons_agree": "comparisons: nothing with itself, the other way round the other sign",
    "images_come_back": "images come back as they were written, metadata whole",
    "charts_are_sound": "charts lie in the square, none mirrored, none on another",
}


def main(arguments: Sequence[str]) -> int:
    """0 where every property held."""
    if arguments[:1] == ["--batch"]:
        name, seed, cases, note = arguments[1:]
        try:
            run_batch(name, int(seed), int(cases), Path(note))
        except Exception:
            traceback.print_exc()
            return 1
        return 0
    parser = argparse.ArgumentParser("python -m occlusion_bake.bench.truth.fuzz", description=__doc__.splitlines()[0])
    parser.add_argument("properties", nargs="*", metavar="PROPERTY", help=f"which: {', '.join(PROPERTIES)} (all)")
    parser.add_argument("--seed", type=int, help="of the batches' seeds (another each time)")
    parser.add_argument("--share", type=float, default=1.0, help="of the full number of cases (1)")
    parser.add_argument("--output", type=Path, help="file for the result, JSON")
    chosen = parser.parse_args(arguments)
    result = measure(chosen)
    if chosen.output:
        chosen.output.parent.mkdir(parents=True, exist_ok=True)
        chosen.output.write_text(json.dumps(result, indent=1), encoding="utf-8")
    print("\n".join(page(result)))
    return 1 if any(row["failures"] for row in result["properties"]) else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
