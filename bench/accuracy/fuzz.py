"""The long run of the property tests: thousands of new cases, in child processes that may crash or hang.

python -m occlusion_bake.bench.accuracy.fuzz [--seed S] [--share X] [PROPERTY...]
"""

from __future__ import annotations

import argparse
import random
import sys
from typing import Any

from ...tests.oracles.fuzz_batch import long_run
from ...tests.oracles.properties import PROPERTIES
from ..pages import filled
from ..tables import table
from .command import run_alone


def measure(chosen: argparse.Namespace) -> dict[str, Any]:
    """Every property, or those named. `chosen`: names, seed (below 0: another each time), share of the cases."""
    seed = getattr(chosen, "seed", -1)
    seeds = random.Random(seed if seed >= 0 else None)
    share = getattr(chosen, "share", 1.0)
    wanted = {name: PROPERTIES[name].long * share for name in getattr(chosen, "names", None) or PROPERTIES}
    return {"properties": [long_run(name, max(1, round(cases)), seeds, print) for name, cases in wanted.items()]}


def page(result: dict[str, Any]) -> list[str]:
    """The section of the page."""
    rows = result["properties"]
    cells = ((PROPERTIES[row["property"]].meaning, f"{row['cases']:,}", len(row["failures"])) for row in rows)
    return filled(
        __file__,
        total=sum(row["cases"] for row in rows),
        failed=sum(len(row["failures"]) for row in rows),
        properties=table(("what must hold", "cases", "failures"), cells),
    )


if __name__ == "__main__":
    options = {"seed": (-1, "of the batches' seeds (another each time)"), "share": (1.0, "of the number of cases (1)")}
    found = run_alone("fuzz", PROPERTIES, measure, page, **options)
    sys.exit(any(row["failures"] for row in found["properties"]))
