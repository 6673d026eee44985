"""`make bake`: AO and RO of every sample scene, beside Cycles, into out/.

python -m occlusion_bake.samples.bake [NAME...] [--size N] [--rays N] [--samples N] [--output DIR]
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import bpy

from ..addon.cli.hard_exit import run_and_exit
from ..addon.compare.comparison import Compared, compare_with_cycles
from ..addon.job.bake_job import BakeJob, Deliver, bake_steps
from ..addon.job.outcome import Outcome
from ..addon.job.runner import run
from ..addon.output.result import Result
from ..addon.read.block_ref import refs_of
from ..core.base.errors import InputError
from ..core.finish.file_names import clean_name
from ..core.finish.map_files import Folder
from ..core.finish.report import Json, object_entry, whole_report, write_report
from ..core.maps.occlusion import AMBIENT, OcclusionMap
from ..core.options.values import told_by_images, told_by_reports
from ..core.progress import Progress
from ..core.rays.map_spec import reflection
from ..core.settings import ImageSettings, Settings
from ..core.solve.goal import Goal
from .scenes import SCENES, build

COLUMNS = "scene      object         texels  seconds     ±AO  ±RO 10      bias   Cycles  ratio"


def main(arguments: Sequence[str] | None = None) -> int:
    """Bake, compare, print the table, write out/report.json."""
    chosen = _parser().parse_args(arguments)
    unknown = [name for name in chosen.names if name not in SCENES]
    if unknown:
        raise InputError(f"{unknown[0]}: no such sample scene; choose from {', '.join(SCENES)}")
    maps = (AMBIENT, OcclusionMap(reflection(10.0)))
    settings = Settings(maps, ImageSettings(chosen.size, chosen.size), Goal(chosen.rays))
    start = time.perf_counter()
    rows: list[str] = []
    reports = {name: _bake_scene(name, settings, chosen, rows) for name in chosen.names or SCENES}
    write_report(chosen.output / "report.json", {"scenes": reports})
    print(f"\n{COLUMNS}", *rows, sep="\n")
    print(
        f"\n±: measured RMSE at {chosen.rays} rays a texel. bias: mean of our AO minus Cycles'.\n"
        f"Cycles: its seconds for {chosen.samples} samples. ratio: those over our own seconds, button to texture, for "
        f"the same AO at {chosen.samples} rays.\n"
        f"Textures and pictures are in {chosen.output}; {time.perf_counter() - start:.0f} s in all."
    )
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser("python -m occlusion_bake.samples.bake", description="Bake the sample scenes.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"which: {', '.join(SCENES)} (all)")
    parser.add_argument("--size", type=int, default=512, help="texels a side (512)")
    parser.add_argument("--rays", type=int, default=64, help="rays a texel and map (64)")
    parser.add_argument("--samples", type=int, default=16, help="samples that Cycles takes (16)")
    parser.add_argument("--output", type=Path, default=Path("out"), help="folder (out)")
    return parser


def _bake_scene(name: str, settings: Settings, chosen: argparse.Namespace, rows: list[str]) -> Json:
    sample = build(name)
    print(f"{name}: {sample.description}", flush=True)
    folder = Folder(chosen.output / name)
    entries: dict[str, Json] = {}

    def deliver(result: Result) -> None:
        baked = result.baked
        start = time.perf_counter()
        stem = clean_name(baked.name)
        files = folder.write(baked, told_by_images(settings), stem)
        baked.seconds["write"] = time.perf_counter() - start
        entry = entries[baked.name] = object_entry(baked, files)
        picture = folder.path / f"{stem}_ao_compared.png"
        compared = Compared.of(result, job, outcome)
        entry["cycles"] = compare_with_cycles(bpy.context, compared, chosen.samples, picture)

    job, outcome = _job(sample.targets, settings), Outcome()
    _run(job, outcome, deliver)
    for target in sample.targets:
        entries[target]["seconds_at_equal_samples"] = _seconds_of(target, replace(settings, maps=(AMBIENT,)), chosen)
        rows.append(_row(name, entries[target]))
    assert outcome.baker is not None
    embree = outcome.baker.device.description
    return whole_report(told_by_reports(settings), embree, outcome.clock.shared, entries.values())


def _job(names: tuple[str, ...], settings: Settings) -> BakeJob:
    return BakeJob(tuple(refs_of(bpy.data.objects[name] for name in names)), settings)


def _run(job: BakeJob, outcome: Outcome, deliver: Deliver) -> None:
    progress = Progress(len(job.objects))
    run(bake_steps(bpy.context, job, progress, outcome, deliver), progress)
    for line in (*outcome.notes, *outcome.refused):
        print(f"  {line}")


def _seconds_of(target: str, settings: Settings, chosen: argparse.Namespace) -> float:
    """Our seconds from the button to the texture for AO alone with as many rays as Cycles takes samples."""
    folder = Folder(chosen.output / "timing")
    equal = replace(settings, goal=replace(settings.goal, rays=chosen.samples))

    def deliver(result: Result) -> None:
        folder.write(result.baked, told_by_images(equal), "timing")

    start = time.perf_counter()
    _run(_job((target,), equal), Outcome(), deliver)
    return time.perf_counter() - start


def _row(scene: str, entry: Json) -> str:
    cycles = entry["cycles"]
    ratio = cycles["seconds"] / entry["seconds_at_equal_samples"]
    return (
        f"{scene:10} {entry['name']:12.12} {entry['texels']:8,} {entry['seconds']['total']:8.2f} "
        f"{entry['error']['ao']:7.4f} {entry['error']['ro_10']:7.4f} {cycles['bias']:+9.5f} {cycles['seconds']:8.2f} "
        f"{ratio:6.1f}"
    )


if __name__ == "__main__":
    run_and_exit(main)
