"""Cycles' own AO bake, as measurements stand beside it: every setting as `addon.compare` matches it."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from unittest.mock import patch

import bpy

from ..addon.compare import cycles
from ..addon.compare.cycles import CyclesBake, CyclesSettings, Surroundings, bake_ao
from ..addon.compare.projected import bake_projected, projection_onto
from ..addon.read.blender_state import temporary_attributes
from ..core.scene.scene import Scene

# What a new scene is baked with: as in Blender's factory file.
DEFAULT_SAMPLES, DEFAULT_THRESHOLD, DEFAULT_FEWEST = 4096, 0.01, 0


def bake_cycles(name: str, size: int, samples: int, seed: int) -> CyclesBake:
    """AO of an object of the open file, without adaptive sampling, on all threads."""
    return bake_ao(bpy.context, bpy.data.objects[name], _settings(size, samples, seed))


def bake_cycles_from(highs: Sequence[str], scene: Scene, size: int, samples: int, seed: int) -> CyclesBake:
    """The same of the scene's one target from these high meshes, from selected to active: Cycles looks for them as far
    off as ours, and the low mesh blocks no light."""
    (target,), objects = scene.targets, bpy.data.objects
    around = Surroundings([objects[target.name]])
    projection = projection_onto(target, scene.highs[target.name])
    return bake_projected(
        bpy.context, projection, [objects[name] for name in highs], _settings(size, samples, seed), around
    )


def _settings(size: int, samples: int, seed: int) -> CyclesSettings:
    return CyclesSettings((size, size), samples, None, os.cpu_count() or 1, seed)


@contextmanager
def at_defaults() -> Iterator[None]:
    """Bakes as an artist has them, with DEFAULT_SAMPLES stopped by Cycles' own adaptive sampling."""
    matched = cycles._match

    def match(stack: ExitStack, scene: bpy.types.Scene, name: str, settings: CyclesSettings) -> None:
        matched(stack, scene, name, settings)
        temporary_attributes(stack, scene.cycles, use_adaptive_sampling=True)
        temporary_attributes(
            stack, scene.cycles, adaptive_threshold=DEFAULT_THRESHOLD, adaptive_min_samples=DEFAULT_FEWEST
        )

    with patch.object(cycles, "_match", match):
        yield
