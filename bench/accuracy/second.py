"""The kernel beside a second opinion: texels of every sample scene and of the models, AO and RO.

python -m occlusion_bake.bench.accuracy.second [NAME...] [--models DIR]
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from ...addon.cli.hard_exit import leave
from ...tests.oracles.blender import read
from ...tests.oracles.second_opinion import LIMIT, RAYS, REPLICAS, SEEDS, STRATA, Agreement, answers
from ...tests.oracles.settings import flat_settings
from ..bake_here import bake_here
from ..pages import filled
from ..tables import table
from .command import run_alone
from .subjects import SUBJECTS, opened

SIZE, TEXELS = 1024, 2048
COLUMNS = ("scene, object", "map", "texels", "bias", "RMSE", "noise", "bias / error", "excess / error")


def measure(chosen: argparse.Namespace) -> dict[str, Any]:
    """Every scene and model asked for. chosen: names (none: all), models (a folder)."""
    subjects = {}
    for name, target in opened(chosen):
        subjects[name] = {"object": target, "maps": _maps(name, target)}
    return {"subjects": subjects}


def _maps(name: str, target: str) -> dict[str, Any]:
    """All maps of an object of the open file, which gets charts where it has no UVs."""
    bake_here([target], flat_settings(width=SIZE, height=SIZE, rays=1))
    scene, _ = read([target])
    rows = {}
    for label, answer in answers(scene, SIZE, TEXELS):
        rows[label] = asdict(answer)
        print(name, label, answer, "in standard errors:", answer.sigmas, flush=True)
    return rows


def page(result: dict[str, Any]) -> list[str]:
    """The section of the page."""
    rows = [
        (f"{name}, {subject['object']}", label, Agreement(**row))
        for name, subject in result["subjects"].items()
        for label, row in subject["maps"].items()
    ]
    found = [row for _, _, row in rows]
    return filled(
        __file__,
        texels=TEXELS,
        size=SIZE,
        limit=LIMIT,
        seeds=SEEDS,
        rays=RAYS,
        ours=SEEDS * RAYS,
        theirs=REPLICAS * STRATA**2,
        rows=len(rows),
        bias=max(abs(row.sigmas[0]) for row in found),
        excess=max(row.sigmas[1] for row in found),
        pooled=_pooled(found),
        facing=sum(row.facing for row in found),
        answers=table(COLUMNS, ([name, label, *_cells(row)] for name, label, row in rows)),
    )


def _cells(row: Agreement) -> list[object]:
    off, beyond = row.sigmas
    bias = f"{row.bias:+.5f} ± {row.bias_error:.5f}"
    return [row.texels, bias, f"{row.rmse:.5f}", f"{row.expected:.5f}", f"{off:+.1f}", f"{beyond:+.1f}"]


def _pooled(rows: Sequence[Agreement]) -> str:
    weights = np.array([1.0 / max(row.bias_error, 1e-9) ** 2 for row in rows])
    mean = float(weights @ [row.bias for row in rows] / weights.sum())
    return f"{mean:+.6f} ± {1.0 / math.sqrt(weights.sum()):.6f}"


if __name__ == "__main__":
    run_alone("second", SUBJECTS, measure, page)
    leave(0)
