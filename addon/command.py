"""The command: `blender -b FILE.blend -c occlusion_bake …` and `python -m occlusion_bake FILE …`.

Exit status 0; 1 for a fault of ours; 2 for bad arguments or input, with one line that says what; 3 when cancelled.
"""

from __future__ import annotations

import sys
import time
import traceback
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import bpy

from ..core.bake import Baked
from ..core.errors import Cancelled, InputError
from ..core.images import check_writable
from ..core.progress import Progress
from ..core.report import Json, object_entry, whole_report, write_report
from ..core.scene import Instance
from .arguments import parser, settings_of
from .comparison import compare_with_cycles
from .files import Folder, write_coverage
from .job import Options, Outcome, bake_steps, meshes_in_render
from .load import load
from .runner import run

NAME = "occlusion_bake"


def main(argv: Sequence[str]) -> int:
    """`python -m occlusion_bake FILE …`: loads the file first."""
    return _guarded(partial(_load_and_bake, argv))


def blender_command(argv: Sequence[str]) -> int:
    """`blender -b FILE.blend -c occlusion_bake …`: the file is loaded already."""
    return _guarded(partial(_bake_loaded, argv))


def _guarded(body: Any) -> int:
    try:
        body()
    except InputError as error:
        print(f"{NAME}: {error}", file=sys.stderr)
        return 2
    except Cancelled:
        print(f"{NAME}: cancelled", file=sys.stderr)
        return 3
    except SystemExit as request:  # --help
        return int(request.code or 0)
    except MemoryError as error:
        print(f"{NAME}: {error or 'not enough memory'}; bake fewer objects or a smaller image", file=sys.stderr)
        return 1
    except Exception:
        traceback.print_exc()
        return 1
    return 0


def _load_and_bake(argv: Sequence[str]) -> None:
    options = parser(f"python -m {NAME}", with_file=True).parse_args(argv)
    settings_of(options)  # what is wrong with the options is said before a large file is read
    load(options.file)
    _bake(options)


def _bake_loaded(argv: Sequence[str]) -> None:
    _bake(parser(f"blender -c {NAME}", with_file=False).parse_args(argv))


def _bake(options: Any) -> None:
    context = bpy.context
    settings = settings_of(options)
    folder = Folder(options.output, options.format, options.depth)
    for path in filter(None, (options.report, options.coverage)):
        check_writable(path.resolve().parent)
    names = tuple(options.objects or meshes_in_render(context.view_layer))
    if not names:
        raise InputError("no mesh in the scene renders; add one, or enable it in renders")
    progress = Progress(len(names))
    outcome = Outcome()
    writer = _Writer(context, options, settings, folder, outcome, several=len(names) > 1)
    steps = bake_steps(context, Options(names, settings, options.uv), progress, outcome, writer.deliver)
    run(steps, progress, _Line().show)
    _save_charts(outcome, folder, options)
    for line in (*outcome.notes, *outcome.refused):
        print(f"{NAME}: {line}")
    if options.report:
        assert outcome.baker is not None
        seconds = {**outcome.seconds, "total": outcome.seconds["total"] - writer.cycles_seconds}
        report = whole_report(settings, outcome.baker.device, seconds, writer.entries)
        report["notes"] = outcome.notes
        report["refused"] = outcome.refused
        write_report(options.report.resolve(), report)
    if outcome.refused:
        raise InputError(f"{len(outcome.refused)} of {len(names)} objects were not baked; the lines above say why")


class _Writer:
    """Takes each baked object: writes its files, compares, keeps its entry for the report, prints its line."""

    def __init__(
        self, context: Any, options: Any, settings: Any, folder: Folder, outcome: Outcome, *, several: bool
    ) -> None:
        self.entries: list[Json] = []
        self.cycles_seconds = 0.0
        self._context, self._options, self._settings = context, options, settings
        self._folder, self._outcome, self._several = folder, outcome, several

    def deliver(self, target: Instance, baked: Baked) -> None:
        start = time.perf_counter()
        stem = self._folder.stem(baked.name)
        files = self._folder.write(baked, self._settings, stem)
        baked.seconds["write"] = time.perf_counter() - start
        if self._options.coverage:
            files["coverage"] = write_coverage(self._options.coverage, baked, stem, several=self._several)
        entry = object_entry(baked, files)
        for line in baked.warnings:
            print(f"{NAME}: {line}")
        print(_summary(entry), flush=True)
        if self._options.compare_cycles:
            self._compare(target, baked, stem, entry)
        self.entries.append(entry)

    def _compare(self, target: Instance, baked: Baked, stem: str, entry: Json) -> None:
        start = time.perf_counter()
        samples, picture = self._options.compare_cycles, self._folder.path / f"{stem}_ao_compared.png"
        print(f"{baked.name}: baking with Cycles, {samples} samples …", flush=True)
        cycles = compare_with_cycles(self._context, target, baked, self._settings, samples, self._options.uv, picture)
        entry["cycles"] = cycles
        self.cycles_seconds += time.perf_counter() - start
        ratio = cycles["seconds"] / entry["seconds"]["total"]
        print(
            f"{baked.name}: Cycles {cycles['seconds']:.2f} s at {samples} samples, {ratio:.1f} times as long; "
            f"RMSE {cycles['rmse']:.5f}, bias {cycles['bias']:+.5f}, p99 {cycles['p99']:.5f}; {picture}",
            flush=True,
        )


def _summary(entry: Json) -> str:
    seconds, (width, height) = entry["seconds"], entry["size"]
    rate = entry["rays"] / max(seconds["trace"], 1e-9) / 1e6
    errors = ", ".join(f"{name} ±{error:.4f}" for name, error in entry["error"].items())
    return (
        f"{entry['name']}: {width}x{height}, {entry['texels']:,} texels, {entry['rays']:,} rays in "
        f"{seconds['total']:.2f} s ({rate:.1f} million rays a second); estimated RMSE {errors}"
    )


def _save_charts(outcome: Outcome, folder: Folder, options: Any) -> None:
    """Textures on charts are of no use without them: a copy of the scene with its new UV maps goes beside them."""
    if not outcome.charted:
        return
    source = Path(getattr(options, "file", None) or bpy.data.filepath or "scene")
    path = folder.path / f"{folder.stem(source.stem + '_charts')}.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True, compress=True)
    outcome.notes.append(f"a copy of the scene with the new UV maps is {path}")


class _Line:
    """Progress on the terminal: one line that is written over; elsewhere a line for each stage."""

    def __init__(self) -> None:
        self._stage = ""
        self._due = 0.0

    def show(self, progress: Progress) -> None:
        if sys.stdout.isatty():
            now = time.monotonic()
            if now >= self._due:
                self._due = now + 0.1
                print(f"\r\x1b[K{100.0 * progress.fraction:5.1f} %  {progress.stage}", end="\r", flush=True)
        elif progress.stage != self._stage:
            self._stage = progress.stage
            print(f"{100.0 * progress.fraction:5.1f} %  {progress.stage}", flush=True)
