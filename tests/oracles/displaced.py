"""Meshes that a material displaces, read from Blender as the add-on does."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from mathutils import Matrix

from ...addon.typed import Tree, scene_in
from ...core.base.arrays import Doubles
from ...core.scene.scene import Mesh
from .blender import material, read


def displaced(mesh: Mesh, matrix: Doubles, height: float, *, smooth: bool) -> tuple[Doubles, Doubles]:
    """(V, 3) each, in object space: where a constant height along the vertices' normals puts the vertices of a mesh,
    and where they are read to be. matrix: (4, 4), of its object."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    made: Any = bpy.data.meshes.new("Displaced")
    made.from_pydata(mesh.vertices.tolist(), [], mesh.triangles.tolist(), shade_flat=not smooth)
    made.materials.append(constant_displacement(height))
    obj = bpy.data.objects.new("Displaced", made)
    obj.matrix_world = Matrix(matrix.tolist())
    scene_in(bpy.context).collection.objects.link(obj)
    start = np.array([vertex.co for vertex in made.vertices])
    normals = np.array([vertex.normal for vertex in made.vertices])
    scene, lines = read(["Displaced"])
    assert lines == [], lines
    return start + height * normals, scene.targets[0].mesh.vertices.astype(np.float64)


def constant_displacement(height: float) -> Any:
    """A material that displaces by a constant along the normals, in object space."""
    made = material("Constant")
    made.displacement_method = "DISPLACEMENT"
    tree: Tree = made.node_tree
    node = tree.nodes.new("ShaderNodeDisplacement")
    for name, value in (("Height", height), ("Midlevel", 0.0), ("Scale", 1.0)):
        node.inputs[name].default_value = value
    tree.links.new(node.outputs[0], tree.get_output_node("CYCLES").inputs["Displacement"])
    return made
