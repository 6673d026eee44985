"""A sample scene seen from its camera with nothing but its baked maps: they shine, and nothing else does."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from matplotlib import pyplot as plt

from ...addon.typed import scene_in
from ...core.base.arrays import Doubles
from ...core.rays.map_spec import MapSpec
from ...samples.scenes import build
from ...tests.oracles.settings import flat_settings
from ..bake_here import bake_here
from ..shine import shine


class Views:
    """Opens the sample scene `name` and renders it, size = (width, height) in pixels, as often as wanted."""

    def __init__(self, name: str, size: tuple[int, int]) -> None:
        self._targets = build(name).targets
        scene: Any = scene_in(bpy.context)
        self._render, cycles, view = scene.render, scene.cycles, scene.view_settings
        cycles.samples, cycles.use_denoising, cycles.max_bounces, cycles.pixel_filter_type = 1, False, 0, "BOX"
        self._render.engine, self._render.resolution_percentage = "CYCLES", 100
        self._render.resolution_x, self._render.resolution_y = size
        self._render.image_settings.file_format, self._render.image_settings.color_mode = "PNG", "BW"
        view.view_transform, view.look = "Raw", "None"

    def seen(self, estimator: MapSpec, rays: int, texels: int) -> Doubles:
        """(height, width) in [0, 1]: the map baked with so many rays onto all targets; values above 1 are white."""
        settings = flat_settings((estimator,), width=texels, height=texels, rays=rays)
        for target, baked in bake_here(self._targets, settings).results:
            shine(bpy.data.objects[target.name], baked.maps[estimator.name].values)
        with tempfile.TemporaryDirectory() as folder:
            self._render.filepath = str(Path(folder) / "seen.png")
            bpy.ops.render.render(write_still=True)
            return np.asarray(plt.imread(self._render.filepath), dtype=np.float64)
