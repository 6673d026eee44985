"""Objects that show a texture as it is, whatever lights there are."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from ..addon.typed import mesh_of, pixels_in
from ..core.base.arrays import Doubles, Floats


def shine(thing: bpy.types.Object, values: Floats | Doubles) -> None:
    """Give the object one material that emits the values, (H, W) or (H, W, 3), texel by texel, row 0 at the top; black
    where they are not numbers."""
    height, width = values.shape[:2]
    image = bpy.data.images.new(thing.name, width, height, float_buffer=True, is_data=True)
    pixels = np.ones((height, width, 4), dtype=np.float32)
    pixels[..., :3] = np.nan_to_num(values[::-1].reshape(height, width, -1))
    pixels_in(image).foreach_set(pixels.ravel())
    material: Any = bpy.data.materials.new(thing.name)
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    tree, mesh = material.node_tree, mesh_of(thing)
    tree.nodes.clear()
    kinds = ("ShaderNodeTexImage", "ShaderNodeEmission", "ShaderNodeOutputMaterial")
    texture, emission, output = (tree.nodes.new(kind) for kind in kinds)
    texture.image, texture.interpolation = image, "Closest"
    tree.links.new(texture.outputs["Color"], emission.inputs["Color"])
    tree.links.new(emission.outputs["Emission"], output.inputs["Surface"])
    mesh.materials.clear()
    mesh.materials.append(material)
