"""Our AO beside Cycles': the same texels, the same settings, and what is known to differ."""

from __future__ import annotations

import os
from pathlib import Path

import bpy
import numpy as np

from ...core.bake import Baked, Settings
from ...core.base.errors import InputError
from ...core.finish.compare import compare, picture
from ...core.finish.image_file import write_image
from ...core.finish.report import Json, comparison_entry
from ...core.rays.map_spec import Falloff
from ...core.scene.ground_plane import ground_below
from ...core.scene.scene import Instance
from ...core.texels.rasterize import owners_by_centre, rasterize
from ..read.occluder_filter import EVERYTHING, Occluding
from .cycles import bake_ao
from .known_differences import reasons_to_differ


def compare_with_cycles(
    context: bpy.types.Context,
    target: Instance,
    baked: Baked,
    settings: Settings,
    samples: int,
    uv: str | None,
    path: Path,
    occluding: Occluding = EVERYTHING,
) -> Json:
    """Bake the target's AO with Cycles onto a UV map (None: the active one), write the picture (ours, Cycles',
    difference), return the report's entry.

    Texels count that both cover. Those that Cycles gives to another triangle (its rule is the texel's centre, ours the
    largest coverage) are counted apart and named. Raises InputError where Cycles refuses or covers no texel of
    ours.
    """
    size, threads = (settings.width, settings.height), settings.threads or os.cpu_count() or 1
    names = [obj.name for obj in context.view_layer.objects]
    counting = {name for name in names if name == target.name or occluding.counts(name)}
    cycles = bake_ao(
        *(context, target.name, size, samples, settings.distance, threads, settings.seed, uv),
        hidden=[name for name in names if name not in counting],
        ground=ground_below([target]) if occluding.ground else None,
    )
    ours = baked.maps["ao"]
    assert target.mesh.uv is not None  # it has been baked
    owner = rasterize(target.name, target.mesh.uv, *size, threads=settings.threads).owner
    mask = ours.covered & cycles.coverage
    if not mask.any():
        raise InputError(f"{target.name}: no texel is covered here and in Cycles; compare with a larger image")
    other = int(np.count_nonzero(mask & (owners_by_centre(target.mesh.uv, *size, threads=settings.threads) != owner)))
    captions = (f"Occlusion Bake, {_how_far(settings)}", f"Cycles, {samples} samples")
    write_image(path, picture(ours.values, cycles.values, mask, captions), depth=8)
    entry = comparison_entry(compare(ours.values, cycles.values, mask), samples, cycles.seconds, other, path)
    return {
        **entry,
        "reasons": reasons_to_differ(
            target.name,
            ours.values[mask],
            samples,
            other,
            counting,
            _of_our_own(settings),
            normal_maps=settings.normal_maps,
        ),
    }


def _of_our_own(settings: Settings) -> list[str]:
    """Settings that Cycles' AO bake lacks, where they are not as it has them."""
    falloff = settings.falloff.name.lower()
    lines = [f"a {falloff} falloff"] if settings.falloff is not Falloff.NONE else []
    lines += [f"a minimum distance of {settings.nearest:g}"] if settings.nearest > 0.0 else []
    lines += [f"a spread of {settings.spread:g} degrees"] if settings.spread < 180.0 else []
    return lines + (["front faces only"] if settings.front_only else [])


def _how_far(settings: Settings) -> str:
    """How far a bake goes, for captions: "64 rays" or "error 0.0039"."""
    return f"{settings.rays} rays" if settings.error is None else f"error {settings.error:.4f}"
