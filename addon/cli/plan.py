"""`plan`: a manifest of what would be baked, for any number of machines, with all they need beside it."""

from __future__ import annotations

import secrets
import shutil
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any
from uuid import uuid4

import bpy

from ...core.base.atomic_file import check_place, check_writable
from ...core.base.errors import InputError
from ...core.batch.manifest import (
    AtlasItem,
    Item,
    Manifest,
    Places,
    SourceFile,
    check_places,
    claim,
    hashed,
    planned_id,
    write_manifest,
)
from ...core.batch.scene_file import write_scene
from ...core.charts.udim import UvTiles
from ...core.finish.file_names import FileNames
from ...core.finish.map_files import Folder, whole_path
from ...core.options.table import OPTIONS
from ...core.options.values import told_by_reports
from ...core.progress import Progress
from ...core.scene.scene import Instance
from ...core.settings import Settings
from ..job.bake_job import BakeJob, Targets, scene_steps, uv_tiles
from ..job.outcome import Outcome
from ..job.runner import Steps, run
from ..job.stop_signals import STOPPING
from ..read.block_ref import BlockRef, mesh_labels
from .job_choice import job_of, place_files
from .options import settings_of
from .scene_copy import save_copy
from .terminal import NAME, ProgressLine, Status, complain, say

_DEFAULT = "manifest.json"  # in the folder of the images
_FILES = {"into", "color_attributes", "coverage", "cycles_samples"}  # which no plan has
_OF_THE_SCENE = {"objects", "occluders", "highs", "cage", "folder", "report", "threads"}  # which the plan has resolved


def plan(options: Any) -> int:
    """Write the manifest of a bake of the loaded file by the command's options; its exit status. Raises InputError,
    Cancelled."""
    _check_options(options)
    settings = settings_of(options)
    place_files(options)
    places = _places(options)
    job = job_of(bpy.context, options, settings)
    folder = Folder(options.folder, options.format, options.depth, options.use_dither)
    planner = _Planner(options, settings, job, places, folder)
    run(planner.steps(), planner.progress, ProgressLine().show, STOPPING)
    planner.progress.raise_if_cancelled()
    manifest = planner.manifest
    for line in (*manifest.notes, *manifest.refused):
        say(f"{NAME}: {line}")
    say(f"{len(manifest.items)} items to bake: {places.manifest}")
    if manifest.refused:
        complain(f"{len(manifest.refused)} lines on what cannot be baked; {manifest.refused[0]}")
    return Status.DONE


def _check_options(options: Any) -> None:
    """What several machines could not write into one file. Raises InputError."""
    for option in OPTIONS:
        if option.name in _FILES and getattr(options, option.name) is not None:
            assert option.flag is not None
            raise InputError(f"{option.flag.name}: a plan is of images, each in files of its own; leave it out")


def _places(options: Any) -> Places:
    """Where the plan goes; `options.report` is whole then. Raises InputError."""
    source = _scene_file(options)
    given = options.manifest
    places = Places(whole_path(given, source or "") if given is not None else options.folder / _DEFAULT)
    if options.report is None:
        options.report = places.manifest.with_name(f"{places.manifest.stem}_report.json")
    for path in (places.manifest, places.prepared, options.report):
        check_place(path)
    check_places(places, source, options.report)
    return places


def _scene_file(options: Any) -> Path | None:
    """The file that is planned; None where the scene was never saved."""
    name = getattr(options, "file", None) or bpy.data.filepath
    return Path(name).absolute() if name else None


class _Planner:
    """progress: of the planning."""

    def __init__(self, options: Any, settings: Settings, job: BakeJob, places: Places, folder: Folder) -> None:
        self.progress = Progress(len(job.objects))
        self._options, self._settings, self._job = options, settings, job
        self._places, self._folder = places, folder
        self._outcome = Outcome()
        self._names = FileNames(folder.path, mesh_labels())
        self._id = planned_id(places) or uuid4().hex
        self.manifest: Manifest

    def steps(self) -> Steps:
        """For a `Runner`."""
        check_writable(self._places.manifest.parent)
        claim(self._places, self._id, self._folder.path)
        targets = yield from scene_steps(bpy.context, self._job, self.progress, self._outcome)
        self.progress.enter("looking at what is to be baked")
        items: list[Item] = yield partial(self._items, targets)
        if not items:
            raise InputError(self._outcome.complaint(len(self._job.objects)))
        assert self._outcome.baker is not None
        claim(self._places, self._id, self._folder.path)  # once more: another may have been planned meanwhile
        self.progress.enter("writing what is to be baked")
        scene = self._places.scenes / secrets.token_hex(8)
        yield partial(write_scene, scene, self._outcome.baker.scene)
        save_copy(self._places.prepared, "prepared scene")
        self.manifest = self._manifest(items, scene)
        write_manifest(self._places.manifest, self.manifest)
        self._remove_old_scenes(scene)

    def _remove_old_scenes(self, new: Path) -> None:
        """All but the newest two: machines may be at work on what was planned before."""
        scenes = sorted(self._places.scenes.iterdir(), key=lambda path: path.stat().st_mtime_ns)
        for path in scenes[:-2]:
            if path != new:
                shutil.rmtree(path, ignore_errors=True)

    def _items(self, targets: Targets) -> list[Item]:
        """What can be baked; the rest is refused."""
        assert self._outcome.baker is not None
        number = {id(target): place for place, target in enumerate(self._outcome.baker.scene.targets)}
        items: list[Item] = []
        for ref, target in targets.items():
            self.progress.raise_if_cancelled()
            tiles = uv_tiles(target, self._job)
            try:
                items += list(self._items_of(ref, target, number[id(target)], tiles))
            except InputError as why:
                self._outcome.refuse(ref, why)
        return items

    def _items_of(self, ref: BlockRef, target: Instance, number: int, tiles: UvTiles) -> Iterator[Item]:
        charting, baker = self._outcome.charting, self._outcome.baker
        assert baker is not None
        figures = charting.made.get(ref)
        stem = self._names.of(ref.label)
        numbers = tiles.numbers or (None,)
        for tile in numbers:
            baker.check(target, tile)
            yield Item(
                name=ref.label,
                target=number,
                stem=stem,
                inputs=baker.inputs_of(target, tile),
                files={} if self._job.layout.atlas else self._files(stem, tile),
                tile=tile,
                uv_map=target.mesh.uv_map,
                charts=None if figures is None else figures.as_json(charting.request.layer),
                warnings=tiles.warnings(target.name) if tile == numbers[0] else (),
            )

    def _files(self, stem: str, tile: int | None) -> Mapping[str, str]:
        """Relative to the folder."""
        return {name: file.name for name, file in self._folder.files(self._settings.maps, stem, tile).items()}

    def _manifest(self, items: list[Item], scene: Path) -> Manifest:
        outcome, places, atlas = self._outcome, self._places, self._job.layout.atlas
        values = vars(self._options)
        kept = {option.name: values[option.name] for option in OPTIONS if option.flag and option.name in values}
        stem = self._names.of(atlas) if atlas else ""
        return Manifest(
            id=self._id,
            options={name: value for name, value in kept.items() if name not in _OF_THE_SCENE | _FILES},
            settings={
                **told_by_reports(self._settings),
                "ground": self._options.use_ground,
                "occluders": outcome.occluders,
            },
            folder=places.told(self._folder.path),
            report=places.told(self._options.report),
            source=self._source(),
            prepared=hashed(places.prepared, places.told(places.prepared)),
            scene=places.told(scene),
            items=items,
            atlas=AtlasItem(atlas, stem, self._files(stem, None)) if atlas else None,
            notes=outcome.notes,
            refused=outcome.refused,
        )

    def _source(self) -> SourceFile | None:
        """The file that was planned."""
        path = _scene_file(self._options)
        return hashed(path, self._places.told(path)) if path is not None else None
