"""Blender's bake operator: run, and set to fill an image of ours."""

from __future__ import annotations

from typing import Any

import bpy

from ...core.base.errors import InputError
from ..materials.node_links import nodes_of
from ..operator_errors import cause_of
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


def run_operator(name: str, deed: str, act: str, **options: Any) -> None:
    """Run the operator. Raises InputError, a line about `name`, where Cycles cannot do the deed ("bake it"), or gives
    up the act ("the bake"). options: of the operator."""
    try:
        outcome = bpy.ops.object.bake(**options)
    except RuntimeError as error:
        raise InputError(f"{name}: Cycles cannot {deed}: {cause_of(error)}") from error
    if outcome != {"FINISHED"}:
        raise InputError(f"{name}: Cycles gave up {act} without a reason; see Blender's console")


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
