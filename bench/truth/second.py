"""The kernel beside a second opinion: texels of every sample scene and of the models, AO and RO.

python -m occlusion_bake.bench.truth.second [NAME...] [--models DIR]
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...addon.cli.hard_exit import leave
from ...addon.job.bake_job import BakeJob, prepared_charts
from ...addon.job.outcome import Outcome
from ...addon.job.runner import run
from ...addon.read.scene_reader import SceneRequest, read_scene
from ...core.progress import Progress
from ...core.rays.map_spec import AO, MapSpec, reflection
from ...core.scene.checks import zero_area
from ...core.scene.scene import Instance, Scene
from ...core.scene.world_mesh import bounds_of
from ...core.texels.rasterize import rasterize
from ...tests.oracles.settings import flat_settings
from ..pages import MODELS
from .opinion import RAYS, REPLICAS, SEEDS, STRATA, Agreement, ask
from .subjects import SUBJECTS, open_subject

SIZE, TEXELS = 1024, 2048
LIMIT = 0.1  # of the object's diagonal, where the distance is limited
MAPS: dict[str, tuple[MapSpec, bool]] = {
    "AO": (AO, False),
    "RO 10": (reflection(10.0), False),
    "RO 100": (reflection(100.0), False),
    "RO 10, camera": (reflection(10.0, from_camera=True), False),
    "RO 100, camera": (reflection(100.0, from_camera=True), False),
    "AO, limited": (AO, True),
    "RO 10, limited": (reflection(10.0), True),
}


def measure(chosen: argparse.Namespace) -> dict[str, Any]:
    """Every scene and model asked for. chosen: names (none: all), models (a folder)."""
    subjects = {}
    for name in getattr(chosen, "names", None) or SUBJECTS:
        target = open_subject(name, chosen.models)
        if target is not None:
            subjects[name] = {"object": target, "maps": _maps(name, *_read(target))}
    return {"subjects": subjects}


def _read(name: str) -> tuple[Scene, Instance]:
    """The scene as a bake would read it, with charts where the object has no UVs."""
    settings = flat_settings(width=SIZE, height=SIZE)
    progress, outcome = Progress(1), Outcome()
    run(prepared_charts(bpy.context, BakeJob((name,), settings), progress, outcome), progress)
    scene, _ = read_scene(bpy.context, bpy.context.view_layer, SceneRequest([name]))
    return scene, scene.targets[0]


def _maps(name: str, scene: Scene, target: Instance) -> dict[str, Any]:
    uv = target.mesh.uv
    assert uv is not None
    owner = rasterize(target.name, uv, SIZE, SIZE, skip=zero_area(target.mesh)).owner
    low, high = bounds_of(target)
    rows = {}
    for limited in (False, True):
        labels = [label for label, (_, short) in MAPS.items() if short == limited]
        reach = LIMIT * float(np.linalg.norm(high - low)) if limited else math.inf
        answers = ask(scene, target, owner, [MAPS[label][0] for label in labels], count=TEXELS, distance=reach)
        for label, answer in zip(labels, answers, strict=True):
            rows[label] = asdict(answer)
            print(name, label, answer, "in standard errors:", answer.sigmas, flush=True)
    return rows


def page(result: dict[str, Any]) -> list[str]:
    """The section of the page."""
    rows = [
        (name, label, Agreement(**row))
        for name, subject in result["subjects"].items()
        for label, row in subject["maps"].items()
    ]
    bias, excess = max(abs(row.sigmas[0]) for _, _, row in rows), max(row.sigmas[1] for _, _, row in rows)
    lines = [
        "## A second opinion",
        "",
        *_ABOUT,
        "",
        f"Largest of {len(rows)} rows: bias {bias:.1f}, excess {excess:.1f} standard errors. Mean bias of all "
        f"rows, were they independent: {_pooled(rows)}. Texels on whose facing the camera the two differ: "
        f"{sum(row.facing for _, _, row in rows)}.",
        "",
        "| scene, object | map | texels | bias | RMSE | noise | bias / error | excess / error |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name, label, row in rows:
        off, beyond = row.sigmas
        lines.append(
            f"| {name}, {result['subjects'][name]['object']} | {label} | {row.texels} | {row.bias:+.5f} ± "
            f"{row.bias_error:.5f} | {row.rmse:.5f} | {row.expected:.5f} | {off:+.1f} | {beyond:+.1f} |"
        )
    return [*lines, "", *_NOTES]


_ABOUT = [
    "Are the rays, the weights and the tracer right? The same maps were made a second time with nothing of the kernel: "
    "libigl's tree and triangle test, float64 throughout, places in the texels by rejection, directions by numpy's "
    "random generator, transforms applied to every instance's vertices, R mirrored for every ray. "
    f"{TEXELS} random texels of a {SIZE}x{SIZE} texture, among them those that a triangle covers in part; "
    f"{SEEDS * RAYS} rays a texel on our side ({SEEDS} seeds of {RAYS}), {REPLICAS * STRATA**2} on the other. Limited: "
    f"rays end at {LIMIT:g} of the object's diagonal. Models stand on a ground plane, seen from the front; texels that "
    "face away from the camera have no RO from it.",
    "",
    "Bias: mean of ours minus the other, ± its standard error. Noise: the RMSE that the scatter of both alone would "
    "give. The last two columns say how many standard errors the bias is off zero, and the mean square beyond that "
    "noise. Chance alone brings the bias past 6.5 once in 100,000 rows; an excess means something far above 0, never "
    "below.",
]
_NOTES = [
    "What both have in common, by definition: directions below the horizon of the shading normal count nothing; those "
    "above it and below the triangle itself are traced, and meet the inside of a closed mesh. What differs on purpose: "
    "our rays start 2⁻²⁰ of the triangle's largest coordinate off the surface, the other's 2⁻³⁶; our positions are "
    "float32 about the middle of the object, the other's are float64. Neither shows in the table.",
    "",
    "libigl takes triangles below a fixed area for edge-on: the bunny, 0.16 across, would come out at 0.94 in place of "
    "0.91. So every scene is made some 2⁴⁰ large before libigl sees it.",
]


def _pooled(rows: Sequence[tuple[str, str, Agreement]]) -> str:
    weights = np.array([1.0 / max(row.bias_error, 1e-9) ** 2 for _, _, row in rows])
    mean = float(weights @ [row.bias for _, _, row in rows] / weights.sum())
    return f"{mean:+.6f} ± {1.0 / math.sqrt(weights.sum()):.6f}"


def main(arguments: Sequence[str]) -> int:
    """Compare some scenes and models, all by default."""
    parser = argparse.ArgumentParser("python -m occlusion_bake.bench.truth.second", description="A second opinion.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"which: {', '.join(SUBJECTS)} (all)")
    parser.add_argument("--models", type=Path, default=MODELS, help="folder of .obj models")
    print(*page(measure(parser.parse_args(arguments))), sep="\n")
    return 0


if __name__ == "__main__":
    leave(main(sys.argv[1:]))
