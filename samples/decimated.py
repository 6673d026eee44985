"""A low mesh of a model, made by Blender's Decimate, and the model to bake it from."""

from __future__ import annotations

from typing import Any

import bpy

from ..addon.typed import mesh_of
from . import stage

TRIANGLES = 2000
SIZE = 2048  # texels a side


def build(scene: bpy.types.Scene, name: str, high: bpy.types.Object) -> stage.Sample:
    """Put a low mesh into the scene beside the model, smooth and without UVs."""
    modifier: Any = high.modifiers.new("Decimate", "DECIMATE")
    modifier.ratio = TRIANGLES / sum(len(face.vertices) - 2 for face in mesh_of(high).polygons)
    layer = scene.view_layers[0]
    layer.update()
    graph = layer.depsgraph
    assert graph is not None  # it has just been updated
    coarse = bpy.data.meshes.new_from_object(high.evaluated_get(graph))
    high.modifiers.remove(modifier)
    low = stage.add(scene, f"{high.name}_low", coarse)
    low.matrix_world = high.matrix_world.copy()
    description = f"{high.name} onto {TRIANGLES:,} triangles."
    return stage.Sample(name, description, (low.name,), SIZE, highs=(high.name,))
