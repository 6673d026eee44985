"""The command: `blender -b FILE.blend -c occlusion_bake …` and `python -m occlusion_bake FILE …`.

Exit status 0; 1 for a fault of ours; 2 for bad arguments or input, with one line that says what; 3 when cancelled; 4
where some of several objects were refused and the others are done.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import bpy

from ...core.base.atomic_file import check_writable, leads_to
from ...core.base.errors import InputError
from ...core.finish.baked import Baked
from ...core.finish.file_names import FileNames, clean_name
from ...core.finish.image_file import check_channel, write_channel
from ...core.finish.map_files import Folder, tile_suffix, write_coverage
from ...core.finish.report import (
    Json,
    comparison_total,
    object_entry,
    summary,
    times_as_long,
    whole_report,
    write_report,
)
from ...core.options.values import told_by_images, told_by_reports
from ...core.progress import Progress
from ...core.settings import Settings
from ..compare.comparison import Compared, compare_with_cycles, with_ambient, without_a_bake
from ..compare.steps import REPORT, compare_into
from ..job.bake_job import BakeJob, bake_steps
from ..job.job_clock import CYCLES
from ..job.outcome import Outcome
from ..job.runner import Steps, run
from ..job.stop_signals import STOPPING
from ..output.color_attributes import store_colours
from ..output.result import Result
from ..read.blender_state import synced
from ..read.block_ref import find, mesh_labels
from . import batch_command
from .import_file import load
from .job_choice import job_of, place_files
from .options import parsed, parser, settings_of
from .plan import plan
from .scene_copy import save_copy
from .terminal import NAME, ProgressLine, Status, complain, guarded, say


def main(argv: Sequence[str]) -> int:
    """`python -m occlusion_bake [plan] FILE …`: loads the file first."""
    if batch_command.is_meant(argv):
        return batch_command.main(argv)
    return guarded(partial(_load_and_go, argv))


def blender_command(argv: Sequence[str]) -> int:
    """`blender -b FILE.blend -c occlusion_bake [plan] …`: the file is loaded already."""
    if batch_command.is_meant(argv):
        return batch_command.main(argv)
    return guarded(partial(_go_on, argv))


def _load_and_go(argv: Sequence[str]) -> int:
    body, words = _meant(argv)
    options = parsed(parser(f"python -m {NAME}", with_file=True, planning=body is plan), words)
    settings_of(options)  # what is wrong with the options is said before a large file is read
    load(options.file)
    return body(options)


def _go_on(argv: Sequence[str]) -> int:
    body, words = _meant(argv)
    return body(parsed(parser(f"blender -c {NAME}", with_file=False, planning=body is plan), words))


def _meant(argv: Sequence[str]) -> tuple[Callable[[Any], int], Sequence[str]]:
    """What to do, and with which words."""
    return (plan, argv[1:]) if argv[:1] == [batch_command.PLAN] else (_bake, argv)


def _bake(options: Any) -> int:
    context = bpy.context
    settings = settings_of(options)
    place_files(options)
    chosen = job_of(context, options, settings)
    if options.comparison:
        return _compare_alone(context, options, chosen)
    names = chosen.objects
    if options.into:
        _check_into(options, chosen)
    if options.cycles_samples:
        chosen = _with_comparison(options, chosen)
    elsewhere = options.into or options.color_attributes
    folder = None if elsewhere else Folder(options.folder, options.format, options.depth, options.use_dither)
    progress = Progress(len(names))
    outcome = Outcome()
    writer = _Writer(context, options, chosen, folder, outcome)
    steps = bake_steps(context, chosen, progress, outcome, writer.deliver)
    try:
        run(steps, progress, ProgressLine().show, STOPPING)
        progress.raise_if_cancelled()  # while Cycles held the main thread
    except BaseException:
        try:  # what is done is of use, whatever ended the bake; that is told, come what may
            _keep(outcome, options)
        except InputError as unsaved:
            complain(unsaved)
        raise
    _keep(outcome, options)
    if total := writer.total:
        say(
            f"{total['images']} images together: Cycles {total['seconds']:.2f} s, here {total['own_seconds']:.2f} s; "
            f"{_agreement(total)} at most"
        )
    if options.report:
        _report(options.report, settings, outcome, writer)
    if outcome.refused:
        complain(outcome.complaint(len(names)))
    elif writer.uncompared:
        complain(f"{len(writer.uncompared)} of {len(writer.entries)} images not compared; {writer.uncompared[0]}")
    return Status.IN_PART if outcome.refused or writer.uncompared else Status.DONE


def _compare_alone(context: Any, options: Any, job: BakeJob) -> int:
    """What another Blender has asked for (compare/steps.py)."""
    folder, progress = Path(options.comparison), Progress(len(job.objects))

    def steps() -> Steps:
        report = yield from compare_into(folder, context, job, options.cycles_samples, progress)
        write_report(folder / REPORT, report)

    run(steps(), progress, ProgressLine().show, STOPPING)
    return Status.DONE


def _with_comparison(options: Any, job: BakeJob) -> BakeJob:
    """The job with AO among its maps; what Cycles has no bake for is said. Raises InputError where no picture could be
    written."""
    check_writable(options.folder)
    for line in without_a_bake(job.settings):
        say(f"{NAME}: {line}")
    return replace(job, settings=with_ambient(job.settings))


def _check_into(options: Any, chosen: BakeJob) -> None:
    path, channel = options.into
    if (len(chosen.objects) > 1 and not chosen.layout.atlas) or not chosen.settings.is_one_grey:
        raise InputError(f"--into {path}:{channel}: a channel takes one grey map of one object; choose one of each")
    check_channel(path, channel, chosen.settings.image.size)


def _report(path: Path, settings: Settings, outcome: Outcome, writer: _Writer) -> None:
    assert outcome.baker is not None  # something has been baked
    embree = outcome.baker.device.description
    report = whole_report(told_by_reports(settings), embree, outcome.clock.shared, writer.entries)
    refused = [*outcome.refused, *writer.uncompared]
    more = {"occluders": outcome.occluders, "notes": outcome.notes, "refused": refused}
    total = {"cycles": writer.total} if writer.total else {}
    write_report(path, {**report, **total, **more})


class _Writer:
    """Takes each baked object: writes its files, compares, keeps its entry for the report, prints its line."""

    def __init__(self, context: Any, options: Any, chosen: BakeJob, folder: Folder | None, outcome: Outcome) -> None:
        self.entries: list[Json] = []
        self.uncompared: list[str] = []  # a line for each object that Cycles would not bake
        self._context, self._options, self._chosen, self._settings = context, options, chosen, settings_of(options)
        self._outcome = outcome
        self._folder, self._several = folder, len(chosen.objects) > 1 and not chosen.layout.atlas
        self._names = FileNames(options.folder, mesh_labels())

    def deliver(self, result: Result) -> None:
        stem = self._names.of(result.name)
        entry = self._write(result, stem)
        if len(result.targets) > 1:
            entry["objects"] = [target.name for target in result.targets]
        charting = self._outcome.charting
        if (figures := charting.made.get(result.objects[0])) is not None:
            entry["charts"] = figures.as_json(charting.request.layer)
        self.entries.append(entry)
        if self._options.cycles_samples:
            self._compare(result, stem, entry)

    @property
    def total(self) -> Json:
        """Of all comparisons, where there are several."""
        total = comparison_total(self.entries)
        return total if total.get("images", 0) > 1 else {}

    def _write(self, result: Result, stem: str) -> Json:
        asked = {each.name for each in self._settings.maps}  # less AO that is there for a comparison alone
        maps = {name: each for name, each in result.baked.maps.items() if name in asked}
        baked, start = replace(result.baked, maps=maps), time.perf_counter()
        files = self._put(result, baked, stem)
        if self._options.coverage:
            files["coverage"] = write_coverage(self._options.coverage, baked, stem, several=self._several)
        baked.seconds["write"] = time.perf_counter() - start
        entry = object_entry(baked, files)
        for line in baked.warnings:
            say(f"{NAME}: {line}")
        say(summary(entry))
        return entry

    def _put(self, result: Result, baked: Baked, stem: str) -> dict[str, Path]:
        """The maps to where they go; returns the files."""
        if self._folder is not None:
            return self._folder.write(baked, told_by_images(self._settings), stem)
        if self._options.into is None:
            obj = self._object(result)
            store_colours(self._context, obj, result.target, baked)
            return {}
        path, channel = self._options.into
        ((name, made),) = baked.maps.items()
        write_channel(path, made.values, channel, dither=self._options.use_dither)
        return {name: path}

    def _object(self, result: Result) -> bpy.types.Object:
        """Nobody removes objects while the command runs."""
        obj: bpy.types.Object | None = find(synced(self._context.view_layer), result.objects[0])
        assert obj is not None
        return obj

    def _compare(self, result: Result, stem: str, entry: Json) -> None:
        samples, compared = self._options.cycles_samples, Compared.of(result, self._chosen, self._outcome)
        picture = self._options.folder / f"{stem}_ao_compared{tile_suffix(result.baked.tile)}.png"
        say(f"{compared.name}: baking with Cycles, {samples} samples …")
        try:
            with self._outcome.clock.stage(CYCLES):
                cycles = compare_with_cycles(self._context, compared, samples, picture)
        except InputError as refusal:  # the others go on
            self.uncompared.append(str(refusal))
            return
        entry["cycles"] = cycles
        say(
            f"{compared.name}: Cycles {cycles['seconds']:.2f} s at {samples} samples, {times_as_long(entry):.1f} times "
            f"as long for a sample as for a ray here; {_agreement(cycles)}; {picture}"
        )
        for line in cycles["reasons"]:
            say(f"{compared.name}: {line}")


def _agreement(cycles: Json) -> str:
    return f"RMSE {cycles['rmse']:.5f}, bias {cycles['bias']:+.5f}, p99 {cycles['p99']:.5f}"


def _keep(outcome: Outcome, options: Any) -> None:
    """Save what the finished objects have beside their images, and say what there is to say. Raises InputError."""
    try:
        if options.color_attributes and outcome.finished:
            save_copy(options.color_attributes, "color attributes")
        _save_charts(outcome, options)
    finally:
        for line in (*outcome.notes, *(outcome.refused if len(outcome.states) > 1 else ())):
            say(f"{NAME}: {line}")


def _save_charts(outcome: Outcome, options: Any) -> None:
    """Textures on charts are of no use without them: a copy of the scene with its new UV maps goes beside them."""
    if set(outcome.charting.made).isdisjoint(outcome.finished):
        return
    source = Path(getattr(options, "file", None) or bpy.data.filepath or "scene")
    folder = options.into[0].parent if options.into else options.folder
    path = leads_to(folder) / f"{clean_name(source.stem + '_charts')}.blend"
    save_copy(path, "new UV maps")
    outcome.notes.append(f"a copy of the scene with the new UV maps is {path}")
