"""Exact answers: every case in every frame, the texels that must be 1 or 0 to the last bit, and the bowl."""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterable, Iterator
from typing import Any

from ...tests.oracles.exact_cases import FRAMES, cases
from ...tests.oracles.exact_readings import CONVERGED, RESOLVED, T_BOUND, failures, summaries
from ...tests.oracles.whole_bakes import bowls, constant_bakes
from ..pages import filled
from ..tables import table

CASE_COLUMNS = ("case", "map", "exact", "bias", "±", "worst frame", "±", "t", "slack")
CONSTANT_COLUMNS = ("mesh", "value", "frames", "rays", "texels off")
BOWL_COLUMNS = ("frame", "exact", "mean", "±", "texels", "farthest texel", "its noise")


def measure(_: argparse.Namespace) -> dict[str, Any]:
    """Everything; prints a line a case. The length of this run is fixed."""
    rows = []
    for case in cases():
        start = time.perf_counter()
        ours = summaries(case)
        worst, wrong = max(row["worst_bias"] for row in ours), sum(len(row["wrong"]) for row in ours)
        print(f"{case.name}: worst |bias| {worst:.1e}, wrong {wrong}, {time.perf_counter() - start:.1f} s", flush=True)
        rows += ours
    result: dict[str, Any] = {"cases": rows, "constant": list(_told(constant_bakes())), "bowl": list(_told(bowls()))}
    result["failures"] = failures(result)
    print("\n".join(result["failures"]) or "all hold", flush=True)
    return result


def _told(rows: Iterable[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    for row in rows:
        print(row, flush=True)
        yield row


def page(result: dict[str, Any]) -> list[str]:
    """The section of the page."""
    found, constant, bowl = result["cases"], result["constant"], result["bowl"]
    lines = filled(
        __file__,
        bound=T_BOUND,
        frames="; ".join(frame.name for frame in FRAMES),
        cases=table(CASE_COLUMNS, map(_case_cells, found)),
        resolved=sum(RESOLVED * row["error"] <= CONVERGED for row in found),
        rows=len(found),
        least=RESOLVED,
        converged=CONVERGED,
        constant=table(CONSTANT_COLUMNS, map(_constant_cells, constant)),
        bowl=table(BOWL_COLUMNS, map(_bowl_cells, bowl)),
    )
    wrong = [f"- {line}" for line in result["failures"]]
    return lines + (["", "### Does not hold", "", *wrong] if wrong else [])


def _case_cells(row: dict[str, Any]) -> list[str]:
    off = f"{row['bias']:+.1e}", f"{row['error']:.0e}", f"{row['worst_bias']:.1e}", f"{row['worst_error']:.0e}"
    return [row["case"], row["map"], f"{row['exact']:.6f}", *off, f"{row['worst_t']:.1f}", f"{row['slack']:.0e}"]


def _constant_cells(row: dict[str, Any]) -> list[object]:
    return [row["mesh"], f"{row['exact']:g}", row["frames"], f"{row['rays']:,}", row["texels"]]


def _bowl_cells(row: dict[str, Any]) -> list[object]:
    mean = f"{row['exact']:.6f}", f"{row['mean']:.6f}", f"{row['error']:.0e}"
    return [row["frame"], *mean, row["texels"], f"{row['farthest']:.4f}", f"{row['texel_error']:.4f}"]
