"""Bias and RMSE against a converged Cycles, beside the noise of both."""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..addon.compare.cycles import CyclesBake, CyclesSettings, bake_ao
from ..core.base.arrays import Ints
from ..core.finish.baked import BakedMap
from ..core.finish.compare import compare, noise
from ..core.scene.scene import Instance
from ..core.texels.rasterize import owners_by_centre, rasterize
from ..samples.scenes import SCENES, build
from ..tests.oracles.settings import flat_settings
from .ours import bake_here

SIZE, RAYS, SAMPLES = 256, 1024, 4096
SEEDS = (1, 2)

Reference = Callable[[str, int], CyclesBake]  # of an object's name and a seed


@dataclass(frozen=True, eq=False)
class Sides:
    """Two seeds of each side, ours and Cycles'. owner: (H, W) int32, ours; by_centre: the same by Cycles' rule."""

    target: Instance
    ours: list[BakedMap]
    cycles: list[CyclesBake]
    owner: Ints
    by_centre: Ints

    @property
    def both(self) -> NDArray[np.bool_]:
        """(H, W) bool: texels that both sides bake."""
        mask: NDArray[np.bool_] = self.ours[0].covered & self.cycles[0].coverage
        return mask

    @property
    def same(self) -> NDArray[np.bool_]:
        """Those that both give to the same triangle."""
        mask: NDArray[np.bool_] = self.both & (self.by_centre == self.owner)
        return mask

    def noises(self, mask: NDArray[np.bool_]) -> tuple[float, float]:
        """Sigma of one bake of ours and of one of Cycles' over the masked texels."""
        ours, cycles = self.ours, self.cycles
        return noise(ours[0].values, ours[1].values, mask), noise(cycles[0].values, cycles[1].values, mask)


def measure(chosen: argparse.Namespace) -> dict[str, Any]:
    """Every scene's first target: two seeds of each side."""
    scenes = {}
    for name in SCENES:
        target = build(name).targets[0]
        scenes[name] = figures(bake_both(target, converged))
        print(name, scenes[name], flush=True)
    return {"scenes": scenes, "blender": bpy.app.version_string}


def converged(target: str, seed: int, samples: int = SAMPLES) -> CyclesBake:
    """What is compared with: AO of an object of the open file, by Cycles."""
    return bake_ao(bpy.context, target, CyclesSettings((SIZE, SIZE), samples, None, os.cpu_count() or 1, seed))


def bake_both(target: str, reference: Reference) -> Sides:
    """Both sides of an object of the open file. Where it has no UVs it gets charts, which are then its active map."""
    settings = flat_settings(width=SIZE, height=SIZE, rays=RAYS, margin=0)
    pairs = [bake_here([target], replace(settings, seed=seed))[1][0] for seed in SEEDS]
    instance = pairs[0][0]
    uv = instance.mesh.uv
    assert uv is not None
    return Sides(
        instance,
        [baked.maps["ao"] for _, baked in pairs],
        [reference(target, seed) for seed in SEEDS],
        rasterize(target, uv, SIZE, SIZE).owner,
        owners_by_centre(uv, SIZE, SIZE),
    )


def figures(sides: Sides) -> dict[str, Any]:
    """A row of the page."""
    owned, both, same = sides.owner >= 0, sides.both, sides.same
    ours, cycles = sides.ours[0].values, sides.cycles[0].values
    there, everywhere = compare(ours, cycles, same), compare(ours, cycles, both)
    sigma_ours, sigma_cycles = sides.noises(same)
    return {
        "object": sides.target.name,
        "texels": int(np.count_nonzero(owned)),
        "not_covered_by_cycles": int(np.count_nonzero(owned & ~sides.cycles[0].coverage)),
        "of_another_triangle": int(np.count_nonzero(both & ~same)),
        "bias": there.bias,
        "rmse": there.rmse,
        "sigma_ours": sigma_ours,
        "sigma_cycles": sigma_cycles,
        "bias_everywhere": everywhere.bias,
        "rmse_everywhere": everywhere.rmse,
    }


def ratio(row: Mapping[str, float]) -> float:
    """The mean square difference over what the noise of both would give: 1 where nothing else tells them apart."""
    return row["rmse"] ** 2 / (row["sigma_ours"] ** 2 + row["sigma_cycles"] ** 2)


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
        lines.append(
            f"| {name}, {row['object']} | {row['texels']} | {row['not_covered_by_cycles']} "
            f"| {row['of_another_triangle']} | {row['bias']:+.5f} | {row['rmse']:.5f} | {row['sigma_ours']:.5f} "
            f"| {row['sigma_cycles']:.5f} | {ratio(row):.2f} |"
        )
    return lines
