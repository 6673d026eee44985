"""Bias and RMSE against a converged Cycles, beside the noise of both."""

from __future__ import annotations

import argparse
import os
from dataclasses import replace
from typing import Any

import bpy
import numpy as np

from ..addon.cycles import bake_ao
from ..core.bake import Settings
from ..core.compare import compare, noise
from ..core.texels import owners_by_centre, rasterize
from ..samples.scenes import SCENES, build
from .ours import bake_here

SIZE, RAYS, SAMPLES = 256, 1024, 4096


def measure(chosen: argparse.Namespace) -> dict[str, Any]:
    """Every scene's first target: two seeds of each side."""
    scenes = {}
    for name in SCENES:
        scenes[name] = _scene(name)
        print(name, scenes[name], flush=True)
    return {"scenes": scenes, "blender": bpy.app.version_string}


def _scene(name: str) -> dict[str, Any]:
    target = build(name).targets[0]
    settings = Settings(width=SIZE, height=SIZE, rays=RAYS, margin=0)
    pairs = [bake_here([target], replace(settings, seed=seed))[1][0] for seed in (1, 2)]
    ours = [baked.maps["ao"].values for _, baked in pairs]
    threads = os.cpu_count() or 1
    cycles = [bake_ao(bpy.context, target, (SIZE, SIZE), SAMPLES, None, threads, seed) for seed in (1, 2)]
    uv = pairs[0][0].mesh.uv
    assert uv is not None
    owner = rasterize(target, uv, SIZE, SIZE).owner
    both = pairs[0][1].maps["ao"].covered & cycles[0].coverage
    same = both & (owners_by_centre(uv, SIZE, SIZE) == owner)
    figures, everywhere = compare(ours[0], cycles[0].values, same), compare(ours[0], cycles[0].values, both)
    return {
        "object": target,
        "texels": int(np.count_nonzero(owner >= 0)),
        "not_covered_by_cycles": int(np.count_nonzero((owner >= 0) & ~cycles[0].coverage)),
        "of_another_triangle": int(np.count_nonzero(both & ~same)),
        "bias": figures.bias,
        "rmse": figures.rmse,
        "sigma_ours": noise(ours[0], ours[1], same),
        "sigma_cycles": noise(cycles[0].values, cycles[1].values, same),
        "bias_everywhere": everywhere.bias,
        "rmse_everywhere": everywhere.rmse,
    }


def page(result: dict[str, Any]) -> list[str]:
    """The section of the page."""
    lines = [
        "## Agreement with Cycles",
        "",
        f"AO at {SIZE}x{SIZE}: ours with {RAYS} rays, no filter; Cycles (Blender {result['blender']}) with {SAMPLES} "
        "samples, settings matched. Sigma: the noise of one bake, from two seeds. Compared are the texels that both "
        "give to the same triangle; the others are counted: Cycles leaves out texels whose centre no triangle covers, "
        "and gives a texel to the triangle at its centre where we give it to the one that covers most of it. Goal: "
        "bias within 0.0005 and RMSE² at most 1.1 times the sum of the squared sigmas.",
        "",
        "With Blender 5.2 (`make figures VENV=.venv-3.13`): there Cycles spreads its samples over the whole texel, as "
        "we do; in 4.5 over its middle alone, ±0.25, and where triangles are as small as texels the two then differ by "
        "more than their noise.",
        "",
        "| scene, object | texels | not in Cycles | other triangle | bias | RMSE | sigma ours | sigma Cycles "
        "| RMSE² / (σ² + σ²) |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for name, row in result["scenes"].items():
        ratio = row["rmse"] ** 2 / (row["sigma_ours"] ** 2 + row["sigma_cycles"] ** 2)
        lines.append(
            f"| {name}, {row['object']} | {row['texels']} | {row['not_covered_by_cycles']} "
            f"| {row['of_another_triangle']} | {row['bias']:+.5f} | {row['rmse']:.5f} | {row['sigma_ours']:.5f} "
            f"| {row['sigma_cycles']:.5f} | {ratio:.2f} |"
        )
    return lines
