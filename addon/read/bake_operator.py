"""Blender's bake operator, set to fill an image of ours."""

from __future__ import annotations

from typing import Any

import bpy

from ..materials.node_links import nodes_of
from ..typed import Node, Tree

# How the bake operator fills an image of ours: its active one, as it is, no margin.
INTO_IMAGE: Any = {
    "target": "IMAGE_TEXTURES",
    "save_mode": "INTERNAL",
    "margin": 0,
    "use_clear": False,
    "use_selected_to_active": False,
    "use_split_materials": False,
}


def with_texture(material: bpy.types.Material | None, image: bpy.types.Image) -> bpy.types.Material:
    """A local copy of the material, or a plain one where there are no nodes, with the image active in its tree."""
    if material is None or nodes_of(material) is None:
        copy = bpy.data.materials.new("Occlusion Bake")
        if bpy.app.version < (5, 0):  # later always so
            copy.use_nodes = True
    else:
        copy = material.copy()
    tree: Tree = copy.node_tree
    texture: Node = tree.nodes.new("ShaderNodeTexImage")
    texture.image = image
    tree.nodes.active = texture
    return copy
