"""A case's scene in Blender."""

from __future__ import annotations

from typing import cast

import bpy
import numpy as np
from mathutils import Matrix

from ....addon.typed import Tree, scene_in
from ....core.scene.scene import Instance, Mesh, Scene
from ..blender import material


def open_scene(scene: Scene, *, displaced: bool = False) -> str:
    """Replace the open file by the scene's occluders and return the first target's name. displaced: as of a Case."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    made: dict[int, bpy.types.Mesh] = {}
    for instance in scene.occluders:
        key = id(instance.mesh)
        if key not in made:
            made[key] = _mesh(instance.mesh)
            if displaced:
                _flatten(made[key])
        _object(instance, made[key])
    return scene.targets[0].name


def _object(instance: Instance, mesh: bpy.types.Mesh) -> None:
    """The matrix hangs on an empty parent's inverse, the one place where Blender keeps a shear."""
    obj = bpy.data.objects.new(instance.name, mesh)
    parent = bpy.data.objects.new(f"{instance.name} parent", None)
    for each in (obj, parent):
        scene_in(bpy.context).collection.objects.link(each)
    obj.parent = parent
    obj.matrix_parent_inverse = Matrix(instance.matrix.tolist())


def _mesh(mesh: Mesh) -> bpy.types.Mesh:
    made = bpy.data.meshes.new(mesh.name)
    made.from_pydata(mesh.vertices.tolist(), [], mesh.triangles.tolist(), shade_flat=mesh.normals is None)
    if mesh.uv is not None:
        made.uv_layers.new(name="UVMap").uv.foreach_set("vector", mesh.uv.reshape(-1))
    if mesh.normals is not None:
        free = cast("bpy.types.FloatVectorAttribute", made.attributes.new("custom_normal", "FLOAT_VECTOR", "CORNER"))
        free.data.foreach_set("vector", np.ascontiguousarray(mesh.normals).reshape(-1))
    made.update()
    return made


def _flatten(mesh: bpy.types.Mesh) -> None:
    """Lay a mesh flat, and let a material displace it to its heights."""
    heights = cast("bpy.types.FloatAttribute", mesh.attributes.new("height", "FLOAT", "POINT"))
    for vertex, height in zip(mesh.vertices, heights.data, strict=True):
        height.value, vertex.co.z = vertex.co.z, 0.0
    made = material("Displaced")
    made.displacement_method = "DISPLACEMENT"
    tree: Tree = made.node_tree
    attribute, displacement = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("Attribute", "Displacement"))
    attribute.attribute_name = "height"
    displacement.inputs["Midlevel"].default_value, displacement.inputs["Scale"].default_value = 0.0, 1.0
    tree.links.new(attribute.outputs["Fac"], displacement.inputs["Height"])
    tree.links.new(displacement.outputs[0], tree.get_output_node("CYCLES").inputs["Displacement"])
    mesh.materials.append(made)
