"""Every kind of bake that Cycles has against Cycles: low from high, atlases, tiles, colour attributes.

python -m occlusion_bake.bench.accuracy.kinds [NAME...] [--samples N]
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import bpy
import numpy as np

from ...addon.charts.chart_request import CHARTS
from ...addon.cli.hard_exit import leave
from ...addon.compare.comparison import Beside, Compared, bake_beside
from ...addon.job.bake_job import BakeJob, Layout, bake_steps
from ...addon.job.outcome import Outcome
from ...addon.job.runner import run
from ...addon.output.result import Result
from ...addon.read.high_low_pairs import paired_with
from ...addon.read.occluder_filter import OccluderFilter
from ...addon.typed import mesh_of, scene_in
from ...core.base.arrays import Flags
from ...core.charts.udim import part_in_tile
from ...core.finish.compare import compare, noise
from ...core.progress import Progress
from ...core.texels.rasterize import owners_by_centre, rasterize
from ...tests.oracles import blender
from ...tests.oracles.settings import flat_settings
from ...tests.oracles.texels import whole_texels
from ..pages import filled
from ..tables import table
from .command import run_alone
from .cycles import ratio

SIZE, RAYS, SAMPLES = 128, 256, 256
SEEDS = (1, 2)
COLUMNS = (
    *("kind", "texels", "bias", "RMSE", "sigma ours", "sigma Cycles", "RMSE² / (σ² + σ²)"),
    "all that the comparison counts: texels, bias, RMSE",
)


def _suzanne(name: str, levels: int = 0) -> Any:
    bpy.ops.mesh.primitive_monkey_add()
    made: Any = bpy.context.object
    made.name = name
    if levels:
        made.modifiers.new("Fine", "SUBSURF").render_levels = levels
    return made


def _low(*, apart: bool = False, cage: str | None = None, extrusion: float | None = None) -> BakeJob:
    """A Suzanne with few faces, charted, of Suzanne with many. apart: her eyes are meshes of their own."""
    _suzanne("High", levels=2)
    if apart:
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.separate(type="LOOSE")
        bpy.ops.object.mode_set(mode="OBJECT")
    highs = [obj.name for obj in bpy.data.objects]
    low = _suzanne("Low")
    low.modifiers.new("Few", "DECIMATE").ratio = 0.5
    bpy.ops.object.modifier_apply(modifier="Few")
    if cage is not None:
        blown_up = low.copy()
        blown_up.name, blown_up.data = cage, low.data.copy()
        scene_in(bpy.context).collection.objects.link(blown_up)
        mesh = mesh_of(blown_up)
        for vertex, normal in zip(mesh.vertices, mesh.vertex_normals, strict=True):
            vertex.co += 0.05 * normal.vector
    ref, *meshes = blender.refs("Low", *highs)
    pairing = paired_with(ref, meshes, blender.refs(cage)[0] if cage else None, extrusion)
    return _job("Low", uv=CHARTS, highs=pairing.highs, occluding=OccluderFilter(excluded=pairing.excluded))


def _job(*names: str, **more: Any) -> BakeJob:
    return BakeJob(blender.refs(*names), flat_settings(width=SIZE, height=SIZE, rays=RAYS, margin=0), **more)


def _atlas() -> BakeJob:
    """A chain."""
    for number in range(3):
        turned = (np.pi / 2 * number, 0.0, 0.0)
        bpy.ops.mesh.primitive_torus_add(location=(1.3 * number, 0.0, 0.0), rotation=turned, minor_radius=0.3)
        torus: Any = bpy.context.object
        torus.name = f"Link {number}"
    return _job("Link 0", "Link 1", "Link 2", uv=CHARTS, layout=Layout("Atlas"))


def _tiles() -> BakeJob:
    """Two cubes, joined, in tiles 1001 and 1002, before a wall."""
    corners = [(x + 3.0 * tile, y, z) for tile in (0, 1) for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
    sides = ((0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7), (4, 5, 6, 7))
    faces = [[corner + 8 * tile for corner in side] for tile in (0, 1) for side in sides]
    cells = [(i % 3, i // 3) for i in range(len(sides))]
    square = ((0.05, 0.05), (0.95, 0.05), (0.95, 0.95), (0.05, 0.95))
    uv = [((column + u) / 3 + tile, (row + v) / 3) for tile in (0, 1) for column, row in cells for u, v in square]
    blender.mesh("Cubes", corners, faces, uv)
    blender.wall(x=1.5, y=(-1.0, 2.0))
    return _job("Cubes")


def _colours() -> BakeJob:
    _suzanne("Suzanne")
    return _job("Suzanne", layout=Layout(corners=True))


KINDS: dict[str, Callable[[], BakeJob]] = {
    "high to low, extrusion": lambda: _low(extrusion=0.05),
    "high to low, cage": lambda: _low(cage="Cage"),
    "high to low, three high meshes": lambda: _low(apart=True, extrusion=0.05),
    "atlas of three": _atlas,
    "UDIM tile": _tiles,
    "color attributes": _colours,
}


def measure(chosen: argparse.Namespace) -> dict[str, Any]:
    """Every kind asked for. chosen: names (none: all), samples (SAMPLES)."""
    samples, rows = getattr(chosen, "samples", SAMPLES), {}
    for kind in getattr(chosen, "names", None) or KINDS:
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        job = KINDS[kind]()
        first, second = (_baked(replace(job, settings=replace(job.settings, seed=seed)), samples) for seed in SEEDS)
        for (compared, beside), (_, again) in zip(first, second, strict=True):
            called = kind if compared.baked.tile is None else f"{kind} {compared.baked.tile}"
            both = beside.mask & again.mask
            rows[called] = {
                "alike": _difference(beside, again, both & _alike(compared)),
                "all": _difference(beside, again, both),
            }
            print(called, rows[called], flush=True)
    return {"kinds": rows, "samples": samples, "blender": bpy.app.version_string}


def _baked(job: BakeJob, samples: int) -> list[tuple[Compared, Beside]]:
    """Each image."""
    found: list[tuple[Compared, Beside]] = []
    progress, outcome = Progress(len(job.objects)), Outcome()

    def deliver(result: Result) -> None:
        compared = Compared.of(result, job, outcome)
        found.append((compared, bake_beside(bpy.context, compared, samples)))

    run(bake_steps(bpy.context, job, progress, outcome, deliver), progress)
    return found


def _alike(compared: Compared) -> Flags:
    """Texels that both look at in the same place: those that they give to the same triangle, with high meshes also in
    their middle, for which they must lie within it; all corners."""
    alike = np.full_like(compared.ours.covered, compared.job.layout.corners)
    for target in () if compared.job.layout.corners else compared.targets:
        uv = part_in_tile(target, compared.baked.tile).mesh.uv
        assert uv is not None  # it has been baked
        owner = rasterize(target.name, uv, *compared.baked.size).owner
        same = (owner >= 0) & (owners_by_centre(uv, *compared.baked.size) == owner)
        alike |= same & whole_texels(uv, owner) if compared.is_from_highs else same
    return alike


def _difference(first: Beside, second: Beside, mask: Flags) -> dict[str, float]:
    found = compare(first.ours, first.cycles, mask)
    return {
        "texels": int(np.count_nonzero(mask)),
        "bias": found.bias,
        "rmse": found.rmse,
        "sigma_ours": noise(first.ours, second.ours, mask),
        "sigma_cycles": noise(first.cycles, second.cycles, mask),
    }


def page(result: dict[str, Any]) -> list[str]:
    """The section of the page."""
    rows = (
        [kind, *_told(row["alike"]), f"{ratio(row['alike']):.2f}", ", ".join(map(str, _told(row["all"])[:3]))]
        for kind, row in result["kinds"].items()
    )
    given = {name: result[name] for name in ("samples", "blender")}
    return filled(__file__, size=SIZE, rays=RAYS, **given, kinds=table(COLUMNS, rows))


def _told(row: Mapping[str, float]) -> list[object]:
    errors = (f"{row[name]:.5f}" for name in ("rmse", "sigma_ours", "sigma_cycles"))
    return [row["texels"], f"{row['bias']:+.5f}", *errors]


if __name__ == "__main__":
    run_alone("kinds", KINDS, measure, page, samples=(SAMPLES, f"that Cycles takes ({SAMPLES})"))
    leave(0)
