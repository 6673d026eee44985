"""Cycles' own AO bake, as measurements stand beside it: every setting as `addon.compare.cycles` matches it."""

from __future__ import annotations

import os
from contextlib import ExitStack
from unittest.mock import patch

import bpy

from ..addon.compare import cycles
from ..addon.compare.cycles import CyclesBake, CyclesSettings, bake_ao
from ..addon.read.blender_state import temporary_attributes

# What a new scene is baked with: as in Blender's factory file.
DEFAULT_SAMPLES, DEFAULT_THRESHOLD, DEFAULT_FEWEST = 4096, 0.01, 0


def bake_cycles(name: str, size: int, samples: int, seed: int) -> CyclesBake:
    """AO of an object of the open file, without adaptive sampling, on all threads."""
    settings = CyclesSettings((size, size), samples, None, os.cpu_count() or 1, seed)
    return bake_ao(bpy.context, bpy.data.objects[name], settings)


def bake_at_defaults(name: str, size: int, seed: int) -> CyclesBake:
    """The same as an artist has it, stopped by Cycles' own adaptive sampling."""
    matched = cycles._match

    def match(stack: ExitStack, scene: bpy.types.Scene, name: str, settings: CyclesSettings) -> None:
        matched(stack, scene, name, settings)
        temporary_attributes(stack, scene.cycles, use_adaptive_sampling=True)
        temporary_attributes(
            stack, scene.cycles, adaptive_threshold=DEFAULT_THRESHOLD, adaptive_min_samples=DEFAULT_FEWEST
        )

    with patch.object(cycles, "_match", match):
        return bake_cycles(name, size, DEFAULT_SAMPLES, seed)
