"""Our AO beside Cycles': the same texels, the same settings, and what is known to differ."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import bpy
import numpy as np

from ...core.base.arrays import Flags, Floats
from ...core.base.errors import InputError
from ...core.charts.udim import part_in_tile
from ...core.finish.baked import Baked, BakedMap
from ...core.finish.compare import compare, comparison_image
from ...core.finish.image_file import write_image
from ...core.finish.map_images import title
from ...core.finish.report import Json, comparison_entry
from ...core.maps.occlusion import AMBIENT
from ...core.rays.ray_options import WHOLE_SPREAD, Falloff
from ...core.scene.ground_plane import NAME as GROUND
from ...core.scene.scene import Instance, Scene
from ...core.settings import Settings
from ...core.texels.rasterize import owners_by_centre, rasterize
from ..job.bake_job import BakeJob
from ..job.outcome import Outcome
from ..output.result import Result
from ..read.blender_state import synced
from ..read.block_ref import BlockRef, find
from ..typed import uid_of, view_layer_in
from .corner_colours import bake_corners
from .cycles import CyclesBake, CyclesSettings, Surroundings, bake_ao
from .known_differences import reasons_to_differ
from .projected import bake_projected, projection_onto


@dataclass(frozen=True, eq=False)
class Compared:
    """One image. objects: those in it; targets: the same, as they were baked, in `scene`. maps: the UV
    maps that they are baked onto, where those are not the active ones."""

    baked: Baked
    objects: tuple[BlockRef, ...]
    targets: tuple[Instance, ...]
    job: BakeJob
    scene: Scene
    maps: Mapping[BlockRef, str]

    @classmethod
    def of(cls, result: Result, job: BakeJob, outcome: Outcome) -> Compared:
        """What a bake has delivered."""
        assert outcome.baker is not None
        return cls(result.baked, result.objects, result.targets, job, outcome.baker.scene, outcome.charting.maps)

    @property
    def ours(self) -> BakedMap:
        """The map that Cycles has, too."""
        return self.baked.maps[AMBIENT.name]

    @property
    def is_from_highs(self) -> bool:
        """Whether anything in it is baked from others."""
        return any(target.name in self.scene.highs for target in self.targets)

    @property
    def name(self) -> str:
        """What it is called: its object, or the atlas, with its tile."""
        return self.baked.name if self.baked.tile is None else f"{self.baked.name} {self.baked.tile}"


@dataclass(eq=False)
class Beside:
    """Both in one image. mask: the texels that count. other_owner: how many of them show another triangle in Cycles."""

    ours: Floats
    cycles: Floats
    mask: Flags
    seconds: float = 0.0
    other_owner: int = 0


def with_ambient(settings: Settings) -> Settings:
    """The settings with AO among the maps: what Cycles has, too."""
    has = any(each.name == AMBIENT.name for each in settings.maps)
    return settings if has else replace(settings, maps=(*settings.maps, AMBIENT))


def without_a_bake(settings: Settings) -> list[str]:
    """A line on the maps that Cycles cannot bake, where there are any."""
    names = ", ".join(title(each.name) for each in settings.maps if each.name != AMBIENT.name)
    return [f"Cycles has no bake of {names}; AO is compared"] if names else []


def compare_with_cycles(context: bpy.types.Context, compared: Compared, samples: int, path: Path) -> Json:
    """Bake AO of all that is in the image with Cycles, write the picture (ours, Cycles', difference), return the
    report's entry.

    Texels count that both cover, and that one object alone does. Those that Cycles gives to another triangle (its rule
    is the texel's centre, ours the largest coverage) are counted apart and named. Raises InputError where Cycles
    refuses or covers no texel of ours.
    """
    settings, beside = compared.job.settings, bake_beside(context, compared, samples)
    captions = (f"Occlusion Bake, {_how_far(settings)}", f"Cycles, {samples} samples")
    write_image(path, comparison_image(beside.ours, beside.cycles, beside.mask, captions), depth=8)
    figures = compare(beside.ours, beside.cycles, beside.mask)
    surfaces = {ref: _surfaces(context, compared.job, ref) for ref in compared.objects}
    reasons = reasons_to_differ(
        _each_once(surfaces.values()),
        beside.ours[beside.mask],
        samples,
        _each_once(_occluding(context, compared, ref) for ref in compared.objects),
        list(_of_the_bake(compared, beside)),
        highs=_each_once(seen for ref, seen in surfaces.items() if ref in compared.job.highs),
        normal_maps=settings.normal_maps,
    )
    return {**comparison_entry(figures, samples, beside.seconds, beside.other_owner, path), "reasons": reasons}


def bake_beside(context: bpy.types.Context, compared: Compared, samples: int) -> Beside:
    """Cycles' bake of all that is in the image beside ours. Raises InputError where it refuses or has none of our
    texels."""
    bake = _corners if compared.job.layout.corners else _texels
    beside = bake(context, compared, samples)
    if not beside.mask.any():
        raise InputError(f"{compared.name}: no texel is covered here and in Cycles; compare with a larger image")
    return beside


def _each_once(lists: Iterable[list[bpy.types.Object]]) -> list[bpy.types.Object]:
    return list(dict.fromkeys(obj for each in lists for obj in each))


def _texels(context: bpy.types.Context, compared: Compared, samples: int) -> Beside:
    """All objects of the image, one after the other."""
    ours, size, threads = compared.ours, compared.baked.size, compared.job.settings.threads
    beside = Beside(ours.values, np.zeros_like(ours.values), np.zeros_like(ours.covered))
    taken, shared = np.zeros_like(ours.covered), np.zeros_like(ours.covered)
    for ref, target in zip(compared.objects, compared.targets, strict=True):
        shown = part_in_tile(target, compared.baked.tile)
        assert shown.mesh.uv is not None  # it has been baked
        owner = rasterize(target.name, shown.mesh.uv, *size, threads=threads).owner
        by_centre = owners_by_centre(shown.mesh.uv, *size, threads=threads)
        cycles = _bake(context, compared, ref, target, _matched(compared, samples))
        both = ours.covered & (owner >= 0) & cycles.coverage
        shared |= taken & (owner >= 0)
        taken |= owner >= 0
        beside.cycles[both], beside.mask = cycles.values[both], beside.mask | both
        beside.seconds += cycles.seconds
        beside.other_owner += _count(both & (by_centre != owner))
    if beside.mask.any() and not (beside.mask & ~shared).any():
        raise InputError(f"{compared.name}: its objects lie on one another in the UV map; compare them with new charts")
    beside.mask &= ~shared
    return beside


def _bake(
    context: bpy.types.Context, compared: Compared, ref: BlockRef, target: Instance, how: CyclesSettings
) -> CyclesBake:
    """One object with Cycles, from its high meshes where it has any."""
    around, tile = _around(context, compared, ref), compared.baked.tile
    surfaces = _surfaces(context, compared.job, ref)
    highs = compared.scene.highs.get(target.name)
    if highs is None:
        return bake_ao(context, surfaces[0], how, compared.maps.get(ref), around=around, tile=tile)
    return bake_projected(context, projection_onto(target, highs, tile), surfaces, how, around)


def _corners(context: bpy.types.Context, compared: Compared, samples: int) -> Beside:
    """The corners of the one object's faces."""
    (ref,), (target,) = compared.objects, compared.targets
    surfaces, highs = _surfaces(context, compared.job, ref), compared.scene.highs.get(target.name)
    how, around = _matched(compared, samples), _around(context, compared, ref)
    return Beside(*bake_corners(context, target, highs, surfaces, compared.ours, how, around))


def _matched(compared: Compared, samples: int) -> CyclesSettings:
    settings = compared.job.settings
    threads = settings.threads or os.cpu_count() or 1
    return CyclesSettings(compared.baked.size, samples, settings.rays.distance, threads, settings.seed)


def _around(context: bpy.types.Context, compared: Compared, ref: BlockRef) -> Surroundings:
    """Who occludes an object, as in our bake of it."""
    occluding = set(_occluding(context, compared, ref))
    hidden = [obj for obj in synced(view_layer_in(context)) if obj not in occluding]
    ground = next((each for each in compared.scene.occluders if each.belongs_to == GROUND), None)
    return Surroundings(hidden, ground)


def _occluding(context: bpy.types.Context, compared: Compared, ref: BlockRef) -> list[bpy.types.Object]:
    """The objects that block light for one that is baked."""
    occluding, own = compared.job.occluding, {each.uid for each in _surface_refs(compared.job, ref)}
    objects = synced(view_layer_in(context))
    return [obj for obj in objects if occluding.counts(uid_of(obj), own=uid_of(obj) in own)]


def _surfaces(context: bpy.types.Context, job: BakeJob, ref: BlockRef) -> list[bpy.types.Object]:
    """The objects whose surface is baked: itself, or its high meshes. Raises InputError for one that is gone."""
    objects, found = synced(view_layer_in(context)), []
    for each in _surface_refs(job, ref):
        if (obj := find(objects, each)) is None:
            raise InputError(f"{each.label}: removed during the bake; compare another")
        found.append(obj)
    return found


def _surface_refs(job: BakeJob, ref: BlockRef) -> Sequence[BlockRef]:
    return job.highs[ref].meshes if ref in job.highs else [ref]


def _of_the_bake(compared: Compared, beside: Beside) -> Iterator[str]:
    """On how it was baked."""
    if beside.other_owner:
        yield (
            f"Edges: {beside.other_owner} texels show another triangle in Cycles, which looks at their middle; here "
            "the one that covers most of them counts"
        )
    if compared.is_from_highs:
        yield "Rays: Cycles' end at a high mesh's first face, back or front; here they go on to one that faces them"
        yield (
            "Points: a corner sees the high mesh from one point of its part here, and from many in Cycles"
            if compared.job.layout.corners
            else "Points: where a chart's edge cuts a texel, the high mesh is seen from the middle of its covered part "
            "here, in Cycles from its own middle"
        )
    if compared.job.layout.corners:
        yield (
            "Colors: Cycles' own bake into color attributes looks from each corner alone, ours is the mean over the "
            "parts of the faces nearest to it; Cycles was given the same parts"
        )
    yield from (f"Settings: {what}, which Cycles' bake has not" for what in _of_our_own(compared.job.settings))


def _of_our_own(settings: Settings) -> list[str]:
    """Settings that Cycles' AO bake lacks, where they are not as it has them."""
    rays = settings.rays
    lines = [f"a {rays.falloff.name.lower()} falloff"] if rays.falloff is not Falloff.NONE else []
    lines += [f"a minimum distance of {rays.nearest:g}"] if rays.nearest > 0.0 else []
    lines += [f"a spread of {rays.spread:g} degrees"] if rays.spread < WHOLE_SPREAD else []
    return lines + (["front faces only"] if rays.front_only else [])


def _how_far(settings: Settings) -> str:
    """How far a bake goes, for captions: "64 rays" or "error 0.0039"."""
    goal = settings.goal
    return f"{goal.rays} rays" if goal.error is None else f"error {goal.error:.4f}"


def _count(texels: Flags) -> int:
    return int(np.count_nonzero(texels))
