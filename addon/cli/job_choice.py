"""What to bake by the command's options, from what, who occludes, and where files go."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy

from ...core.base.atomic_file import leads_to
from ...core.base.errors import InputError
from ...core.charts.udim import Udim
from ...core.finish.image_file import SUFFIXES
from ...core.finish.map_files import check_file, check_image, whole_path
from ...core.settings import Settings
from ..job.bake_job import BakeJob, Layout, meshes_in_render
from ..read.blender_state import synced
from ..read.block_ref import BlockRef, refs_of, refs_of_words
from ..read.high_low_pairs import Pairing, paired_by_name, paired_with
from ..read.occluder_filter import SCENE, OccluderFilter, named
from ..read.roles import roles_from_json


def job_of(context: Any, options: Any, settings: Settings) -> BakeJob:
    """What to bake, from what, and who occludes. Raises InputError."""
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


def place_files(options: Any) -> None:
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
