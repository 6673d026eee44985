"""What every sample scene needs around its meshes: objects, materials, light, a camera, UVs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import radians
from typing import Any

import bpy
from mathutils import Vector

Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Sample:
    """A built scene. targets: names of the objects to bake. size: a texture edge, in texels, that suits them. highs:
    names of the meshes that the one target is baked from, where it is not its own surface."""

    name: str
    description: str
    targets: tuple[str, ...]
    size: int = 1024
    highs: tuple[str, ...] = ()


def add(
    scene: bpy.types.Scene,
    name: str,
    data: Any,
    *materials: bpy.types.Material,
    at: Triple = (0.0, 0.0, 0.0),
    turn: Triple = (0.0, 0.0, 0.0),
    scale: Triple = (1.0, 1.0, 1.0),
) -> bpy.types.Object:
    """Put `data`, a mesh, a light, … or None, into the scene as an object; turn is in degrees about x, y, z. Materials
    go to the data's slots."""
    thing = bpy.data.objects.new(name, data)
    thing.location, thing.scale = at, scale
    thing.rotation_euler = [radians(angle) for angle in turn]
    for material in materials:
        data.materials.append(material)
    scene.collection.objects.link(thing)
    return thing


def material(name: str, colour: Triple, roughness: float = 0.6, **inputs: float) -> bpy.types.Material:
    """A Principled material; `inputs` are further sockets by name, underscores for spaces (Transmission_Weight=1)."""
    made = bpy.data.materials.new(name)
    shader = _nodes(made)["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*colour, 1.0)
    shader.inputs["Roughness"].default_value = roughness
    for socket, value in inputs.items():
        shader.inputs[socket.replace("_", " ")].default_value = value
    return made


def light(scene: bpy.types.Scene, sun: Triple, strength: float = 2.2, sky: float = 0.55, blur: float = 6.0) -> None:
    """A sun shining from `sun` (a direction, any length), `blur` degrees wide, and an even sky."""
    lamp: Any = bpy.data.lights.new("Sun", "SUN")
    lamp.energy, lamp.angle, lamp.color = strength, radians(blur), (1.0, 0.93, 0.82)
    add(scene, "Sun", lamp).rotation_euler = Vector(sun).to_track_quat("Z", "Y").to_euler()
    scene.world = bpy.data.worlds.new("Sky")
    shade = _nodes(scene.world)["Background"]
    shade.inputs["Color"].default_value, shade.inputs["Strength"].default_value = (0.75, 0.85, 1.0, 1.0), sky


def view(scene: Any, position: Triple, towards: Triple, lens: float = 50.0) -> None:
    """The camera, and settings under which a Cycles render of the scene looks as meant. lens: mm on a 36 mm sensor."""
    camera = bpy.data.cameras.new("Camera")
    camera.lens = lens
    scene.camera = add(scene, "Camera", camera, at=position)
    scene.camera.rotation_euler = (Vector(towards) - Vector(position)).to_track_quat("-Z", "Y").to_euler()
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = 1280, 800
    scene.view_settings.look = "AgX - Medium High Contrast"


def unwrap(scene: bpy.types.Scene, thing: bpy.types.Object, margin: float = 0.004) -> None:
    """Charts by projection for a mesh object, `margin` (of the texture's edge) apart."""
    layer = scene.view_layers[0]
    layer.update()
    for other in layer.objects:
        other.select_set(other == thing, view_layer=layer)
    layer.objects.active = thing
    with bpy.context.temp_override(scene=scene, view_layer=layer, object=thing, active_object=thing, edit_object=thing):
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_all(action="SELECT")
        bpy.ops.uv.smart_project(angle_limit=radians(60.0), island_margin=margin, margin_method="FRACTION")
        bpy.ops.object.mode_set(mode="OBJECT")


def bevel(thing: bpy.types.Object, width: float, segments: int = 3) -> None:
    """Round the object's sharp edges by a modifier, left live."""
    modifier: Any = thing.modifiers.new("Bevel", "BEVEL")
    modifier.width, modifier.segments = width, segments
    modifier.limit_method, modifier.angle_limit = "ANGLE", radians(35.0)


def tube(name: str, lines: Sequence[Sequence[Triple]], radius: float) -> bpy.types.Curve:
    """Round wires along `lines` of points, thinner towards their ends."""
    curve = bpy.data.curves.new(name, "CURVE")
    curve.dimensions, curve.bevel_depth, curve.bevel_resolution, curve.use_fill_caps = "3D", radius, 3, True
    for line in lines:
        spline = curve.splines.new("POLY")
        spline.points.add(len(line) - 1)
        for place, (point, position) in enumerate(zip(spline.points, line, strict=True)):
            point.co = (*position, 1.0)
            point.radius = 1.0 - 0.5 * place / len(line)
    return curve


def _nodes(data: Any) -> Any:
    """The node tree's nodes; from Blender 5.0 on there is always a tree, and asking for one warns."""
    if bpy.app.version < (5, 0):
        data.use_nodes = True
    return data.node_tree.nodes
