"""Materials that Geometry Nodes give to faces: those that stand in no slot of the object cannot show its maps."""

from __future__ import annotations

import bpy
import numpy as np

from ..materials.mesh_layers import materials_of, slots_of
from ..typed import mesh_of


def lines_on_node_materials(context: bpy.types.Context, obj: bpy.types.Object) -> list[str]:
    """A line for each of them, of the object as the viewport has it."""
    modifiers = [modifier.name for modifier in obj.modifiers if modifier.type == "NODES" and modifier.show_viewport]
    if not modifiers:
        return []  # which spares an evaluation
    evaluated = obj.evaluated_get(context.evaluated_depsgraph_get())
    mesh, materials = mesh_of(evaluated), materials_of(evaluated)
    used = [
        materials[slot]
        for slot in np.unique(slots_of(mesh, np.arange(len(mesh.polygons), dtype=np.int64), len(materials)))
    ]
    given = {str(material.original.name): material.original for material in used if material is not None}
    return [
        f"{obj.name}: its modifier {' or '.join(modifiers)} gives faces the material {name}, which is in no slot of "
        "the object, so that they do not show the maps; put it into one, and bake again"
        for name, material in sorted(given.items())
        if material not in materials_of(obj)
    ]
