"""The command: `blender -b FILE.blend -c occlusion_bake …` and `python -m occlusion_bake FILE …`.

Exit status 0; 1 for a fault of ours; 2 for bad arguments or input, with one line that says what; 3 when cancelled; 4
where some of several objects were refused and the others are done.
"""

from __future__ import annotations

import errno
import io
import sys
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, TextIO

import bpy

from ...core.base.atomic_file import check_writable, leads_to, refusal, replacing
from ...core.base.errors import Cancelled, InputError
from ...core.charts.udim import Udim
from ...core.finish.baked import Baked
from ...core.finish.file_names import FileNames, clean_name
from ...core.finish.image_file import SUFFIXES, check_channel, write_channel
from ...core.finish.map_files import Folder, check_file, check_image, tile_suffix, whole_path, write_coverage
from ...core.finish.report import (
    Json,
    comparison_total,
    error_in_words,
    million_rays_per_second,
    object_entry,
    times_as_long,
    whole_report,
    write_report,
)
from ...core.options.values import told_by_images, told_by_reports
from ...core.progress import Progress
from ...core.settings import Settings
from ..compare.comparison import Compared, compare_with_cycles, with_ambient, without_a_bake
from ..compare.steps import REPORT, compare_into
from ..job.bake_job import BakeJob, Layout, bake_steps, meshes_in_render
from ..job.job_clock import CYCLES
from ..job.outcome import Outcome
from ..job.runner import Steps, run
from ..job.stop_signals import STOPPING, interrupted_by
from ..operator_errors import cause_of
from ..output.color_attributes import store_colours
from ..output.result import Result
from ..read.blender_state import synced
from ..read.block_ref import BlockRef, find, mesh_labels, refs_of, refs_of_words
from ..read.high_low_pairs import Pairing, paired_by_name, paired_with
from ..read.occluder_filter import SCENE, OccluderFilter, named
from ..read.roles import roles_from_json
from .import_file import load
from .options import parsed, parser, settings_of

NAME = "occlusion_bake"
_DONE, _FAULT, _BAD_INPUT, _CANCELLED, _IN_PART = range(5)  # exit statuses
_CLEAR = "\r\x1b[K"


def main(argv: Sequence[str]) -> int:
    """`python -m occlusion_bake FILE …`: loads the file first."""
    return _guarded(partial(_load_and_bake, argv))


def blender_command(argv: Sequence[str]) -> int:
    """`blender -b FILE.blend -c occlusion_bake …`: the file is loaded already."""
    return _guarded(partial(_bake_loaded, argv))


def _guarded(body: Callable[[], int]) -> int:
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # a terminal may lack letters of an object's name
            stream.reconfigure(errors="backslashreplace")
    try:
        with interrupted_by(STOPPING):
            return body()
    except InputError as error:
        _complain(error)
        return _BAD_INPUT
    except (Cancelled, KeyboardInterrupt):  # the latter before and after the bake
        _complain("cancelled")
        return _CANCELLED
    except BrokenPipeError:  # who reads what is said has left, as `head` does
        return _CANCELLED
    except SystemExit as request:  # --help
        return int(request.code or 0)
    except MemoryError as error:
        _complain(f"{error or 'not enough memory'}; bake fewer objects or a smaller image")
        return _FAULT
    except Exception:
        traceback.print_exc()
        return _FAULT


def _load_and_bake(argv: Sequence[str]) -> int:
    options = parsed(parser(f"python -m {NAME}", with_file=True), argv)
    settings_of(options)  # what is wrong with the options is said before a large file is read
    load(options.file)
    return _bake(options)


def _bake_loaded(argv: Sequence[str]) -> int:
    return _bake(parsed(parser(f"blender -c {NAME}", with_file=False), argv))


def _bake(options: Any) -> int:
    context = bpy.context
    settings = settings_of(options)
    _place_files(options)
    chosen = _chosen(context, options, settings)
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
        run(steps, progress, _Line().show, STOPPING)
        progress.raise_if_cancelled()  # while Cycles held the main thread
    except BaseException:
        try:  # what is done is of use, whatever ended the bake; that is told, come what may
            _keep(outcome, options)
        except InputError as unsaved:
            _complain(unsaved)
        raise
    _keep(outcome, options)
    if total := writer.total:
        _say(
            f"{total['images']} images together: Cycles {total['seconds']:.2f} s, here {total['own_seconds']:.2f} s; "
            f"{_agreement(total)} at most"
        )
    if options.report:
        _report(options.report, settings, outcome, writer)
    if outcome.refused:
        _complain(outcome.complaint(len(names)))
    elif writer.uncompared:
        _complain(f"{len(writer.uncompared)} of {len(writer.entries)} images not compared; {writer.uncompared[0]}")
    return _IN_PART if outcome.refused or writer.uncompared else _DONE


def _compare_alone(context: Any, options: Any, job: BakeJob) -> int:
    """What another Blender has asked for (compare/steps.py)."""
    folder, progress = Path(options.comparison), Progress(len(job.objects))

    def steps() -> Steps:
        report = yield from compare_into(folder, context, job, options.cycles_samples, progress)
        write_report(folder / REPORT, report)

    run(steps(), progress, _Line().show, STOPPING)
    return _DONE


def _with_comparison(options: Any, job: BakeJob) -> BakeJob:
    """The job with AO among its maps; what Cycles has no bake for is said. Raises InputError where no picture could be
    written."""
    check_writable(options.folder)
    for line in without_a_bake(job.settings):
        _say(f"{NAME}: {line}")
    return replace(job, settings=with_ambient(job.settings))


def _check_into(options: Any, chosen: BakeJob) -> None:
    path, channel = options.into
    if (len(chosen.objects) > 1 and not chosen.layout.atlas) or not chosen.settings.is_one_grey:
        raise InputError(f"--into {path}:{channel}: a channel takes one grey map of one object; choose one of each")
    check_channel(path, channel, chosen.settings.image.size)


def _chosen(context: Any, options: Any, settings: Settings) -> BakeJob:
    """What to bake, from what, and who occludes."""
    pairing, occluding = (
        _roles(context.view_layer, options) if options.roles is None else roles_from_json(options.roles)
    )
    return BakeJob(
        pairing.targets,
        settings,
        options.uv,
        occluding,
        pairing.highs,
        Layout(
            options.atlas or "",
            Udim.STACKED if options.into and not options.atlas else Udim(options.udim),
            options.color_attributes is not None,
        ),
    )


def _roles(view_layer: bpy.types.ViewLayer, options: Any) -> tuple[Pairing, OccluderFilter]:
    """Who takes part, by the names that were given. Raises InputError."""
    objects = synced(view_layer)

    def meant(words: Sequence[str]) -> list[BlockRef]:
        return refs_of_words(bpy.data.objects, words, objects)

    chosen = dict.fromkeys(meant(options.objects) if options.objects else _all_meshes(view_layer))
    pairing = Pairing(tuple(chosen))
    if options.pairs:
        pairing = paired_by_name(objects, tuple(chosen), options.extrusion)
    elif options.highs:
        cage = meant([options.cage])[0] if options.cage else None
        pairing = paired_with(pairing.targets[0], meant(options.highs), cage, options.extrusion)
    occluding = named(options.occluders or [SCENE], ground=options.use_ground)
    return pairing, replace(occluding, excluded=pairing.excluded)


def _place_files(options: Any) -> None:
    """Make the options' paths whole, and refuse before the bake what could not be written after it."""
    scene_file = bpy.data.filepath or getattr(options, "file", "")
    options.folder = whole_path(options.folder, scene_file)
    if options.report is not None:
        options.report = whole_path(options.report, scene_file)
        check_file(options.report)
    if options.into is not None:
        options.into = whole_path(options.into[0], scene_file), options.into[1]
    if options.color_attributes is not None:
        options.color_attributes = whole_path(options.color_attributes, scene_file)
        check_file(options.color_attributes)
    if options.coverage is not None:
        options.coverage = whole_path(options.coverage, scene_file)
        check_image(options.coverage)
    _check_apart(options, scene_file)


def _check_apart(options: Any, scene_file: str | Path) -> None:
    """Each of the named files is its own: the last to be written would be all that is left. Raises InputError."""
    if options.report and options.report.suffix.lower() in SUFFIXES:
        raise InputError(f"--report {options.report}: it is no image; end its name in .json")
    taken = {leads_to(Path(scene_file))} if scene_file else set()
    into = options.into[0] if options.into else None
    for path in filter(None, (options.report, options.coverage, into)):
        if leads_to(path) in taken:
            raise InputError(f"{path}: it is the scene, or another option's file, too; give each a file of its own")
        taken.add(leads_to(path))


def _all_meshes(view_layer: bpy.types.ViewLayer) -> list[BlockRef]:
    """What renders; where nothing does, whatever mesh there is, for the bake to say why it cannot be baked."""
    meshes = meshes_in_render(view_layer) or [obj for obj in synced(view_layer) if obj.type == "MESH"]
    if not meshes:
        raise InputError(f"the view layer {view_layer.name} holds no mesh; add one, or include its collection")
    return refs_of(meshes)


def _report(path: Path, settings: Settings, outcome: Outcome, writer: _Writer) -> None:
    assert outcome.baker is not None  # something has been baked
    report = whole_report(told_by_reports(settings), outcome.baker.device, outcome.clock.shared, writer.entries)
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
            _say(f"{NAME}: {line}")
        _say(_summary(entry))
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
        _say(f"{compared.name}: baking with Cycles, {samples} samples …")
        try:
            with self._outcome.clock.stage(CYCLES):
                cycles = compare_with_cycles(self._context, compared, samples, picture)
        except InputError as refusal:  # the others go on
            self.uncompared.append(str(refusal))
            return
        entry["cycles"] = cycles
        _say(
            f"{compared.name}: Cycles {cycles['seconds']:.2f} s at {samples} samples, {times_as_long(entry):.1f} times "
            f"as long for a sample as for a ray here; {_agreement(cycles)}; {picture}"
        )
        for line in cycles["reasons"]:
            _say(f"{compared.name}: {line}")


def _agreement(cycles: Json) -> str:
    return f"RMSE {cycles['rmse']:.5f}, bias {cycles['bias']:+.5f}, p99 {cycles['p99']:.5f}"


def _summary(entry: Json) -> str:
    seconds, (width, height) = entry["seconds"], entry["size"]
    errors = ", ".join(f"{name} {error_in_words(entry, name)}" for name in entry["error"])
    return (
        f"{entry['name']}: {width}x{height}, {entry['texels']:,} texels, {entry['rays']:,} rays in "
        f"{seconds['total']:.2f} s ({million_rays_per_second(entry):.1f} million rays a second); RMSE {errors}"
    )


def _keep(outcome: Outcome, options: Any) -> None:
    """Save what the finished objects have beside their images, and say what there is to say. Raises InputError."""
    try:
        if options.color_attributes and outcome.finished:
            _save_copy(options.color_attributes, "color attributes")
        _save_charts(outcome, options)
    finally:
        for line in (*outcome.notes, *(outcome.refused if len(outcome.states) > 1 else ())):
            _say(f"{NAME}: {line}")


def _save_charts(outcome: Outcome, options: Any) -> None:
    """Textures on charts are of no use without them: a copy of the scene with its new UV maps goes beside them."""
    if set(outcome.charting.made).isdisjoint(outcome.finished):
        return
    source = Path(getattr(options, "file", None) or bpy.data.filepath or "scene")
    folder = options.into[0].parent if options.into else options.folder
    path = leads_to(folder) / f"{clean_name(source.stem + '_charts')}.blend"
    _save_copy(path, "new UV maps")
    outcome.notes.append(f"a copy of the scene with the new UV maps is {path}")


def _save_copy(path: Path, what: str) -> None:
    try:
        with replacing(path) as temporary:  # uncompressed: on a full disk Blender takes a compressed stump for success
            bpy.ops.wm.save_as_mainfile(filepath=str(temporary), copy=True, compress=False)
    except OSError as error:
        raise refusal(path, error) from error
    except RuntimeError as error:
        cause = cause_of(error)
        raise InputError(f"{path}: the {what} cannot be saved ({cause}); check that the disk has room") from error


def _complain(line: object) -> None:
    _say(f"{NAME}: {line}", sys.stderr)


def _say(line: str, stream: TextIO | None = None) -> None:
    """Print a line, in the place of the progress on a terminal. Raises BrokenPipeError where nobody reads it."""
    stream = stream or sys.stdout
    try:
        print(f"{_CLEAR if stream.isatty() else ''}{line}", file=stream, flush=True)
    except OSError as error:
        if error.errno == errno.EINVAL:  # as Windows has it
            raise BrokenPipeError from error
        raise


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
                print(f"{_CLEAR}{100.0 * progress.fraction:5.1f} %  {progress.stage}", end="\r", flush=True)
        elif progress.stage != self._stage:
            self._stage = progress.stage
            _say(f"{100.0 * progress.fraction:5.1f} %  {progress.stage}")
