"""A sample scene seen from its camera with nothing but its baked maps: they shine, and nothing else does."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np
from matplotlib import pyplot as plt

from ...core.base.arrays import Doubles, Floats
from ...core.rays.map_spec import MapSpec
from ...samples.scenes import build
from ...tests.oracles.settings import flat_settings
from ..ours import bake_here


class Views:
    """Opens the sample scene `name` and renders it, size = (width, height) in pixels, as often as wanted."""

    def __init__(self, name: str, size: tuple[int, int]) -> None:
        self._targets = build(name).targets
        scene = bpy.context.scene
        scene.render.engine = "CYCLES"
        scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.max_bounces = 1, False, 0
        scene.cycles.pixel_filter_type = "BOX"
        scene.render.resolution_x, scene.render.resolution_y = size
        scene.render.resolution_percentage = 100
        scene.render.image_settings.file_format, scene.render.image_settings.color_mode = "PNG", "BW"
        scene.view_settings.view_transform, scene.view_settings.look = "Raw", "None"

    def seen(self, estimator: MapSpec, rays: int, texels: int) -> Doubles:
        """(height, width) in [0, 1]: the map baked with so many rays onto all targets; values above 1 are white."""
        settings = flat_settings((estimator,), width=texels, height=texels, rays=rays)
        for target, baked in bake_here(self._targets, settings)[1]:
            _shine(bpy.data.objects[target.name], baked.maps[estimator.name].values)
        with tempfile.TemporaryDirectory() as folder:
            bpy.context.scene.render.filepath = str(Path(folder) / "seen.png")
            with _quiet():
                bpy.ops.render.render(write_still=True)
            return np.asarray(plt.imread(Path(folder) / "seen.png"), dtype=np.float64)


@contextmanager
def _quiet() -> Iterator[None]:
    """Cycles tells every step of a render on the standard output."""
    sys.stdout.flush()
    kept = os.dup(1)
    with Path(os.devnull).open("w") as nowhere:
        os.dup2(nowhere.fileno(), 1)
    try:
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)


def _shine(thing: bpy.types.Object, values: Floats) -> None:
    """Give the object one material that emits the values, texel by texel."""
    height, width = values.shape
    image = bpy.data.images.new(thing.name, width, height, float_buffer=True, is_data=True)
    pixels = np.ones((height, width, 4), dtype=np.float32)
    pixels[..., :3] = np.nan_to_num(values[::-1, :, None])
    image.pixels.foreach_set(pixels.ravel())
    material = bpy.data.materials.new(thing.name)
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    texture, emission = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeEmission")
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    texture.image, texture.interpolation = image, "Closest"
    tree.links.new(texture.outputs["Color"], emission.inputs["Color"])
    tree.links.new(emission.outputs["Emission"], output.inputs["Surface"])
    thing.data.materials.clear()
    thing.data.materials.append(material)
