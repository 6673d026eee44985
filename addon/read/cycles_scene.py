"""A scene of our own that Cycles bakes: for what only Cycles can evaluate."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import bpy

from ...core.base.errors import InputError


@contextmanager
def passing_scene(scene: bpy.types.Scene, what: str, samples: int) -> Iterator[bpy.types.Scene]:
    """A scene without objects or World, at the same frame, for the time.

    Raises InputError where Cycles is not enabled; `what` begins the line, which goes on "cannot be read".
    """
    passing: Any = bpy.data.scenes.new("Occlusion Bake")
    try:
        try:
            passing.render.engine = "CYCLES"
        except TypeError as error:
            raise InputError(f"{what} cannot be read without Cycles; enable Cycles in Preferences > Add-ons") from error
        passing.frame_current, passing.frame_subframe = scene.frame_current, scene.frame_subframe
        passing.cycles.samples, passing.cycles.use_adaptive_sampling = samples, False
        cycles: Any = scene.cycles
        passing.cycles.shading_system = cycles.shading_system  # nodes may be scripts
        yield passing
    finally:
        bpy.data.scenes.remove(passing)
