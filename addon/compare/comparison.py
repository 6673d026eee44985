"""Our AO beside Cycles': the same texels, the same settings, and what is known to differ."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from ...core.base.arrays import Flags
from ...core.base.errors import InputError
from ...core.finish.baked import Baked, BakedMap
from ...core.finish.compare import compare, comparison_image
from ...core.finish.image_file import write_image
from ...core.finish.report import Json, comparison_entry
from ...core.maps.occlusion import AMBIENT
from ...core.rays.ray_options import WHOLE_SPREAD, Falloff
from ...core.scene.ground_plane import ground_below
from ...core.scene.scene import Instance
from ...core.settings import Settings
from ...core.texels.rasterize import owners_by_centre, rasterize
from ..read.blender_state import synced
from ..read.occluder_filter import EVERYTHING, OccluderFilter
from ..typed import view_layer_in
from .cycles import CyclesSettings, bake_ao
from .known_differences import reasons_to_differ


@dataclass(frozen=True, eq=False)
class Compared:
    """What is compared. obj: the object; target: as it was baked. occluding: who blocked light. uv: the UV map, None:
    the active one."""

    obj: bpy.types.Object
    target: Instance
    baked: Baked
    settings: Settings
    occluding: OccluderFilter = EVERYTHING
    uv: str | None = None

    @property
    def ours(self) -> BakedMap:
        """The map that Cycles has, too."""
        return self.baked.maps[AMBIENT.name]


def compare_with_cycles(context: bpy.types.Context, compared: Compared, samples: int, path: Path) -> Json:
    """Bake the target's AO with Cycles, write the picture (ours, Cycles', difference), return the report's entry.

    Texels count that both cover. Those that Cycles gives to another triangle (its rule is the texel's centre, ours the
    largest coverage) are counted apart and named. Raises InputError where Cycles refuses or covers no texel of
    ours.
    """
    target, settings, occluding = compared.target, compared.settings, compared.occluding
    others = [obj for obj in synced(view_layer_in(context)) if obj != compared.obj]
    counting = [obj for obj in others if occluding.counts(obj.session_uid)]
    how = CyclesSettings(
        settings.image.size,
        samples,
        settings.rays.distance,
        settings.threads or os.cpu_count() or 1,
        settings.seed,
    )
    cycles = bake_ao(
        context,
        compared.obj,
        how,
        compared.uv,
        hidden=[obj for obj in others if obj not in counting],
        ground=ground_below([target]) if occluding.ground else None,
    )
    ours = compared.ours
    mask = ours.covered & cycles.coverage
    if not mask.any():
        raise InputError(f"{target.name}: no texel is covered here and in Cycles; compare with a larger image")
    other = _texels_of_another(target, settings, mask)
    captions = (f"Occlusion Bake, {_how_far(settings)}", f"Cycles, {samples} samples")
    write_image(path, comparison_image(ours.values, cycles.values, mask, captions), depth=8)
    entry = comparison_entry(compare(ours.values, cycles.values, mask), samples, cycles.seconds, other, path)
    reasons = reasons_to_differ(
        compared.obj,
        ours.values[mask],
        samples,
        other,
        [compared.obj, *counting],
        _of_our_own(settings),
        normal_maps=settings.normal_maps,
    )
    return {**entry, "reasons": reasons}


def _texels_of_another(target: Instance, settings: Settings, mask: Flags) -> int:
    """How many of the masked texels Cycles gives to another triangle than we do."""
    uv, size = target.mesh.uv, settings.image.size
    assert uv is not None  # it has been baked
    owner = rasterize(target.name, uv, *size, threads=settings.threads).owner
    return int(np.count_nonzero(mask & (owners_by_centre(uv, *size, threads=settings.threads) != owner)))


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
