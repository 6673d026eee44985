"""Cycles as an artist has it: stopped by its own adaptive sampling, all else as `addon.compare.cycles` matches it."""

from __future__ import annotations

import os
from contextlib import ExitStack

import bpy
import numpy as np

from ...addon.compare import cycles
from ...addon.compare.cycles import CyclesBake
from ...addon.read.blender_state import bake_override, object_mode, silenced, temporary_attributes

SAMPLES, THRESHOLD, FEWEST = 4096, 0.01, 0  # as in Blender's factory file: what a new scene is baked with


def bake_at_defaults(name: str, size: int, seed: int) -> CyclesBake:
    """AO of an object of the open file at Cycles' own samples, adaptive threshold and fewest samples."""
    context = bpy.context
    scene = context.scene
    obj = cycles._object(context, name, None)
    how = cycles.CyclesSettings((size, size), SAMPLES, None, os.cpu_count() or 1, seed)
    with ExitStack() as stack:
        stack.enter_context(object_mode(context))
        stack.enter_context(silenced("object_bake_pre", "object_bake_complete", "object_bake_cancel"))
        image = stack.enter_context(cycles._image(how.size))
        world = stack.enter_context(cycles._world(cycles.UNLIMITED))
        stack.enter_context(cycles._local_mesh(obj))
        stack.enter_context(cycles._materials(obj, image))
        cycles._match(stack, scene, obj, how)
        temporary_attributes(stack, scene.cycles, use_adaptive_sampling=True)
        temporary_attributes(stack, scene.cycles, adaptive_threshold=THRESHOLD, adaptive_min_samples=FEWEST)
        temporary_attributes(stack, scene, world=world)
        stack.enter_context(bake_override(context, obj, scene, context.view_layer))
        seconds = cycles._bake(obj, None)
        values = cycles._pixels(image)
    covered = values != cycles.UNTOUCHED
    return CyclesBake(np.where(covered, values, np.float32(0.0)), covered, seconds)
