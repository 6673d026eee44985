"""AO against Cycles at 4096 samples: the sample scenes, and models that stand on a ground plane.

python -m occlusion_bake.bench.accuracy.cycles [NAME...] [--models DIR] [--samples N]

Cycles takes minutes a bake, so each is kept in build/accuracy/cycles/ and a long run may be taken up again.
"""

from __future__ import annotations

import argparse
import hashlib
import json
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import bpy
import numpy as np

from ...addon.cli.hard_exit import leave
from ...addon.compare.cycles import CyclesBake
from ...core.base.arrays import Flags
from ...core.base.atomic_file import replacing
from ...core.finish.baked import BakedMap
from ...core.finish.compare import compare, noise
from ...core.texels.rasterize import owners_by_centre, rasterize
from ...tests.oracles.blender import read
from ...tests.oracles.settings import flat_settings
from ...tests.oracles.texels import whole_texels
from ..bake_here import bake_here
from ..cycles import bake_cycles
from ..pages import ROOT, filled
from ..tables import table
from .command import run_alone
from .subjects import SUBJECTS, opened

SIZE, RAYS, SAMPLES = 256, 1024, 4096
SEEDS = (1, 2)
KEPT = ROOT / "build" / "accuracy" / "cycles"
SAME_COLUMNS = ("scene, object", "texels", "bias", "RMSE", "sigma ours", "sigma Cycles", "RMSE² / (σ² + σ²)")
KIND_COLUMNS = (
    *("scene, object", "texels", "not in Cycles", "not in ours", "other triangle: texels, bias, RMSE"),
    *("whole: texels, bias, ratio", "cut: texels, bias, ratio"),
)


def measure(chosen: argparse.Namespace) -> dict[str, Any]:
    """Every scene and model asked for. chosen: names (none: all), models (a folder), samples (SAMPLES)."""
    samples, rows = getattr(chosen, "samples", SAMPLES), {}
    for name, target in opened(chosen):
        rows[name] = differences(name, target, samples)
        print(name, json.dumps(rows[name]), flush=True)
    return {"scenes": rows, "samples": samples, "blender": bpy.app.version_string}


def differences(name: str, target: str, samples: int) -> dict[str, Any]:
    """Each kind of texel of an object of the open file, counted, with what the two differ by there.

    Two seeds of each side. Where the object has no UVs it gets charts, which are then its active map.
    """
    settings = flat_settings(width=SIZE, height=SIZE, rays=RAYS, margin=0)
    bakes = [bake_here([target], replace(settings, seed=seed)).results[0] for seed in SEEDS]
    uv = bakes[0][0].mesh.uv
    assert uv is not None
    sides = [baked.maps["ao"] for _, baked in bakes], [_kept(name, target, samples, seed) for seed in SEEDS]
    owner, cycles = rasterize(target, uv, SIZE, SIZE).owner, sides[1][0].coverage
    both = sides[0][0].covered & cycles
    same = both & (owners_by_centre(uv, SIZE, SIZE) == owner)
    whole = same & whole_texels(uv, owner)
    kinds = {
        "same": same,
        "whole": whole,
        "cut": same & ~whole,
        "other_triangle": both & ~same,
        "not_in_cycles": (owner >= 0) & ~cycles,
        "not_in_ours": cycles & (owner < 0),
    }
    found = {kind: _difference(*sides, mask, both) for kind, mask in kinds.items()}
    return {"object": target, "texels": int(np.count_nonzero(owner >= 0)), **found}


def _difference(ours: list[BakedMap], cycles: list[CyclesBake], mask: Flags, both: Flags) -> dict[str, float]:
    """bias and rmse of ours minus Cycles', with the noise of each; the count alone where not both have values."""
    count = int(np.count_nonzero(mask))
    if not (mask & both).any():
        return {"texels": count}
    found = compare(ours[0].values, cycles[0].values, mask)
    noises = [noise(first.values, second.values, mask) for first, second in (ours, cycles)]
    return {"texels": count, "bias": found.bias, "rmse": found.rmse, "sigma_ours": noises[0], "sigma_cycles": noises[1]}


def _kept(name: str, target: str, samples: int, seed: int) -> CyclesBake:
    """Cycles' bake from an earlier run of the same Blender on the same mesh, else a new one."""
    release = bpy.app.version_string.replace(" ", "_")
    key = f"{name}_{SIZE}_{samples}_{seed}_{release}_{_mark(target)}".replace(" ", "_")
    path = KEPT / f"{key}.npz"
    if path.is_file():
        with np.load(path) as kept:
            return CyclesBake(kept["values"], kept["coverage"], float(kept["seconds"]))
    baked = bake_cycles(target, SIZE, samples, seed)
    KEPT.mkdir(parents=True, exist_ok=True)
    with replacing(path) as part:
        np.savez_compressed(part, values=baked.values, coverage=baked.coverage, seconds=baked.seconds)
    print(f"{name}: Cycles, seed {seed}, {samples} samples: {baked.seconds:.0f} s", flush=True)
    return baked


def _mark(target: str) -> str:
    """Tells one state of the scene's meshes, their places and the target's UVs from another."""
    scene, _ = read([target])
    uv = scene.targets[0].mesh.uv
    assert uv is not None
    mark = hashlib.blake2b(uv.tobytes(), digest_size=4)
    for each in scene.occluders:
        mark.update(each.matrix.tobytes() + each.mesh.vertices.tobytes())
    return mark.hexdigest()


def page(result: dict[str, Any]) -> list[str]:
    """The section of the page."""
    rows = {f"{name}, {row['object']}": row for name, row in result["scenes"].items()}
    lines = filled(
        __file__,
        size=SIZE,
        rays=RAYS,
        samples=result["samples"],
        blender=result["blender"],
        same=table(SAME_COLUMNS, ([name, *_same(row["same"])] for name, row in rows.items())),
        kinds=table(KIND_COLUMNS, ([name, *_kinds(row)] for name, row in rows.items())),
    )
    missing = ", ".join(name for name in SUBJECTS if name not in result["scenes"])
    return lines + (["", f"Not measured here: {missing}."] if missing else [])


def ratio(row: Mapping[str, float]) -> float:
    """The mean square difference over what the noise of both would give: 1 where nothing else tells them apart."""
    return row["rmse"] ** 2 / (row["sigma_ours"] ** 2 + row["sigma_cycles"] ** 2)


def _same(kind: Mapping[str, float]) -> list[object]:
    if "bias" not in kind:
        return [kind["texels"], "", "", "", "", ""]
    noises = f"{kind['sigma_ours']:.5f}", f"{kind['sigma_cycles']:.5f}"
    return [kind["texels"], f"{kind['bias']:+.5f}", f"{kind['rmse']:.5f}", *noises, f"{ratio(kind):.2f}"]


def _kinds(row: dict[str, Any]) -> list[object]:
    other = row["other_triangle"]
    told = f", {other['bias']:+.4f}, {other['rmse']:.4f}" if "bias" in other else ""
    return [
        *(row["texels"], row["not_in_cycles"]["texels"], row["not_in_ours"]["texels"], f"{other['texels']}{told}"),
        *(
            f"{kind['texels']}, {kind['bias']:+.5f}, {ratio(kind):.2f}" if "bias" in kind else kind["texels"]
            for kind in (row["whole"], row["cut"])
        ),
    ]


if __name__ == "__main__":
    run_alone("cycles", SUBJECTS, measure, page, samples=(SAMPLES, f"that Cycles takes ({SAMPLES})"))
    leave(0)
