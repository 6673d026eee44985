"""AO against Cycles at 4096 samples: the sample scenes, and models that stand on a ground plane.

python -m occlusion_bake.bench.truth.cycles [NAME...] [--models DIR] [--samples N]

Cycles takes minutes a bake, so each is kept in build/accuracy/cycles/ and a long run may be taken up again.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...addon.cli.hard_exit import leave
from ...addon.compare.cycles import CyclesBake
from ...core.finish.compare import compare
from ...samples.scenes import SCENES
from ..agreement import RAYS, SAMPLES, SIZE, Sides, bake_both, converged, ratio
from ..pages import MODELS, ROOT
from .subjects import SUBJECTS, open_subject

KEPT = ROOT / "build" / "accuracy" / "cycles"

Bools = NDArray[np.bool_]


def measure(chosen: argparse.Namespace) -> dict[str, Any]:
    """Every scene and model asked for. chosen: names (None: all), models (a folder), samples (None: SAMPLES)."""
    samples = getattr(chosen, "samples", None) or SAMPLES
    rows = {}
    for name in getattr(chosen, "names", None) or SUBJECTS:
        target = open_subject(name, chosen.models)
        if target is None:
            continue
        sides = bake_both(target, lambda obj, seed, name=name: _kept(name, obj, samples, seed))  # type: ignore[misc]
        rows[name] = differences(sides)
        print(name, json.dumps(rows[name]), flush=True)
    return {"scenes": rows, "samples": samples, "blender": bpy.app.version_string}


def _kept(name: str, target: str, samples: int, seed: int) -> CyclesBake:
    """Cycles' bake from an earlier run of the same Blender on the same mesh, else a new one."""
    release = bpy.app.version_string.replace(" ", "_")
    key = f"{name}_{SIZE}_{samples}_{seed}_{release}_{_mark(target)}".replace(" ", "_")
    path = KEPT / f"{key}.npz"
    if path.is_file():
        with np.load(path) as kept:
            return CyclesBake(kept["values"], kept["coverage"], float(kept["seconds"]))
    baked = converged(target, seed, samples)
    KEPT.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(".part.npz")
    np.savez_compressed(part, values=baked.values, coverage=baked.coverage, seconds=baked.seconds)
    part.replace(path)
    print(f"{name}: Cycles, seed {seed}, {samples} samples: {baked.seconds:.0f} s", flush=True)
    return baked


def _mark(target: str) -> str:
    """Tells one state of the scene's meshes, their places and the target's UVs from another."""
    mesh = bpy.data.objects[target].data
    uv = np.empty((len(mesh.loops), 2), dtype=np.float32)
    mesh.uv_layers.active.uv.foreach_get("vector", uv.reshape(-1))
    mark = hashlib.blake2b(uv.tobytes(), digest_size=4)
    for each in bpy.data.objects:
        mark.update(np.array(each.matrix_world, dtype=np.float64).tobytes())
    for each in bpy.data.meshes:
        positions = np.empty((len(each.vertices), 3), dtype=np.float32)
        each.vertices.foreach_get("co", positions.reshape(-1))
        mark.update(positions.tobytes())
    return mark.hexdigest()


def differences(sides: Sides) -> dict[str, Any]:
    """Each kind of texel, counted, with what the two differ by there."""
    owned, cycles = sides.owner >= 0, sides.cycles[0].coverage
    whole = sides.same & whole_texels(sides)
    kinds = {
        "whole": whole,
        "cut": sides.same & ~whole,
        "other_triangle": sides.both & ~sides.same,
        "not_in_cycles": owned & ~cycles,
        "not_in_ours": cycles & ~owned,
    }
    row: dict[str, Any] = {"object": sides.target.name, "texels": int(np.count_nonzero(owned))}
    row["same"] = _difference(sides, sides.same)
    row.update({name: _difference(sides, mask) for name, mask in kinds.items()})
    return row


def _difference(sides: Sides, mask: Bools) -> dict[str, float]:
    """bias and rmse of ours minus Cycles', with the noise of each; the count alone where not both have values."""
    count = int(np.count_nonzero(mask))
    if not (mask & sides.both).any():
        return {"texels": count}
    found = compare(sides.ours[0].values, sides.cycles[0].values, mask)
    ours, cycles = sides.noises(mask)
    return {"texels": count, "bias": found.bias, "rmse": found.rmse, "sigma_ours": ours, "sigma_cycles": cycles}


def whole_texels(sides: Sides) -> Bools:
    """(H, W) bool: texels that lie in their triangle with all four corners."""
    uv = sides.target.mesh.uv
    assert uv is not None
    height, width = sides.owner.shape
    y, x = np.nonzero(sides.owner >= 0)
    corners = uv[sides.owner[y, x]].astype(np.float64) * (width, -height) + (0, height)
    inside = np.ones(len(x), dtype=np.bool_)
    for dx, dy in ((0, 0), (1, 0), (0, 1), (1, 1)):
        place = np.column_stack([x + dx, y + dy]).astype(np.float64)
        sides_of = [_turn(corners[:, i], corners[:, (i + 1) % 3], place) for i in range(3)]
        inside &= np.all([turn >= 0 for turn in sides_of], axis=0) | np.all([turn <= 0 for turn in sides_of], axis=0)
    mask = np.zeros((height, width), dtype=np.bool_)
    mask[y, x] = inside
    return mask


def _turn(a: NDArray[np.float64], b: NDArray[np.float64], c: NDArray[np.float64]) -> NDArray[np.float64]:
    """Above 0 where a, b, c turn one way, below where the other."""
    along, to = b - a, c - a
    turn: NDArray[np.float64] = along[:, 0] * to[:, 1] - along[:, 1] * to[:, 0]
    return turn


def page(result: dict[str, Any]) -> list[str]:
    """The section of the page."""
    return [
        "## Beside Cycles",
        "",
        f"AO of every sample scene's first object, and of models on a ground plane, at {SIZE}x{SIZE}: ours with {RAYS} "
        f"rays, Cycles (Blender {result['blender']}) with {result['samples']} samples, settings matched as by *Compare "
        "with Cycles*. Sigma: the noise of one bake, from two seeds of each side. Compared are the texels that both "
        "give to the same triangle. The last column is 1 where the two differ by their noise alone.",
        "",
        "| scene, object | texels | bias | RMSE | sigma ours | sigma Cycles | RMSE² / (σ² + σ²) |",
        "|---|---|---|---|---|---|---|",
        *(f"| {name}, {row['object']} | {_cells(row['same'])} |" for name, row in result["scenes"].items()),
        "",
        *_DIFFERENCES,
        "",
        "| scene, object | texels | not in Cycles | not in ours | other triangle: texels, bias, RMSE "
        "| whole: texels, bias, ratio | cut: texels, bias, ratio |",
        "|---|---|---|---|---|---|---|",
        *(_counts(name, row) for name, row in result["scenes"].items()),
        *_elsewhere(result["scenes"]),
    ]


def _elsewhere(rows: dict[str, Any]) -> list[str]:
    """Where to find what is not in the table."""
    missing = [name for name in SUBJECTS if name not in rows]
    if not missing:
        return []
    samples = (
        "; the sample scenes are in [Figures](figures.md), by the same measure" if set(missing) & set(SCENES) else ""
    )
    return ["", f"Not measured here: {', '.join(missing)}{samples}."]


_DIFFERENCES = [
    "What is known to differ, and how often:",
    "",
    "- *Not in Cycles*: no triangle covers the texel's centre, and Cycles leaves it out. We bake every texel that a "
    "triangle touches.",
    "- *Other triangle*: Cycles gives a texel to the last triangle over its centre, we to the one that covers most of "
    "it. Where the two differ, so does the surface that is baked; the values are compared all the same.",
    "- *Whole* and *cut*: texels inside their triangle, and texels at its edges, which it covers in part. There we "
    "spread the rays over the covered part; Cycles tries up to ten places in the texel for each ray and then takes "
    "the centre.",
    "- In Blender 4.5 Cycles spreads its rays over the middle of a texel alone, ±0.25, in 5.2 over the whole. The "
    "table is of the release named above.",
    "- Cycles' first ray starts at the texel's centre: one of all its samples.",
    "- Cycles' rays start on the surface and skip the triangle that they start on; ours start 2⁻²⁰ of the triangle's "
    "largest coordinate off it. That tells only where faces coincide, and here none do: models float 0.001 of their "
    "height over their ground.",
]


def _cells(kind: dict[str, float]) -> str:
    if "bias" not in kind:
        return f"{kind['texels']} | | | | |"
    return (
        f"{kind['texels']} | {kind['bias']:+.5f} | {kind['rmse']:.5f} | {kind['sigma_ours']:.5f} "
        f"| {kind['sigma_cycles']:.5f} | {ratio(kind):.2f}"
    )


def _counts(name: str, row: dict[str, Any]) -> str:
    other = row["other_triangle"]
    cells = [f"{name}, {row['object']}", row["texels"], row["not_in_cycles"]["texels"], row["not_in_ours"]["texels"]]
    cells.append(
        f"{other['texels']}, {other['bias']:+.4f}, {other['rmse']:.4f}" if "bias" in other else other["texels"]
    )
    for kind in (row["whole"], row["cut"]):
        named = "bias" in kind
        cells.append(f"{kind['texels']}, {kind['bias']:+.5f}, {ratio(kind):.2f}" if named else kind["texels"])
    return f"| {' | '.join(map(str, cells))} |"


def main(arguments: Sequence[str]) -> int:
    """Measure some scenes, all by default."""
    parser = argparse.ArgumentParser("python -m occlusion_bake.bench.truth.cycles", description="AO beside Cycles.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"which: {', '.join(SUBJECTS)} (all)")
    parser.add_argument("--models", type=Path, default=MODELS, help="folder of .obj models")
    parser.add_argument("--samples", type=int, default=SAMPLES, help=f"samples that Cycles takes ({SAMPLES})")
    measure(parser.parse_args(arguments))
    return 0


if __name__ == "__main__":
    leave(main(sys.argv[1:]))
