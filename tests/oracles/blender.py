"""What tests do in the open file: objects from a few numbers, buttons pressed, pixels read."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import bpy
import numpy as np

from ...addon.read.block_ref import BlockRef, refs_of_words
from ...addon.read.mesh_arrays import corners_of
from ...addon.read.scene_reader import SceneRequest, read_scene
from ...addon.typed import Node, Socket, mesh_of, pixels_in, scene_in, view_layer_in
from ...core.base.arrays import Floats
from ...core.scene.scene import Scene

UNIT_SQUARE = ((0, 0), (1, 0), (1, 1), (0, 1))


def mesh(
    name: str,
    vertices: Sequence[Sequence[float]],
    faces: Sequence[Sequence[int]],
    uv: Any = None,
    location: Sequence[float] = (0.0, 0.0, 0.0),
) -> Any:
    """An object of its own mesh. uv: two numbers for each corner of each face, None for no UV map."""
    made = bpy.data.meshes.new(name)
    made.from_pydata(vertices, [], faces)
    if uv is not None:
        made.uv_layers.new(name="UVMap").uv.foreach_set("vector", np.asarray(uv, np.float32).reshape(-1))
    made.update()
    obj = bpy.data.objects.new(name, made)
    obj.location = location
    scene_in(bpy.context).collection.objects.link(obj)
    return obj


def plane(name: str = "Plane", uv: Any = UNIT_SQUARE, location: Sequence[float] = (0.0, 0.0, 0.0)) -> Any:
    """A square of side 2 that faces up; by default its UVs are the whole square, u along x and v along y."""
    corners = ((-1.0, -1.0, 0.0), (1.0, -1.0, 0.0), (1.0, 1.0, 0.0), (-1.0, 1.0, 0.0))
    return mesh(name, corners, ((0, 1, 2, 3),), uv, location)


def wall(name: str = "Wall", x: float = 1.0, y: tuple[float, float] = (0.0, 1.0)) -> Any:
    """A wall that stands at x over a part of the floor's edge, and has no UVs."""
    corners = ((x, y[0], 0.0), (x, y[1], 0.0), (x, y[1], 2.0), (x, y[0], 2.0))
    return mesh(name, corners, ((0, 1, 2, 3),))


def cube(name: str = "Cube", **options: Any) -> Any:
    """Blender's own, with its UV map."""
    bpy.ops.mesh.primitive_cube_add(**options)
    made: Any = bpy.context.object
    made.name = name
    return made


def bare_cube(name: str = "Bare", **options: Any) -> Any:
    """A cube without a UV map."""
    obj = cube(name, calc_uvs=False, **options)
    while layers := mesh_of(obj).uv_layers:
        layers.remove(layers[0])
    return obj


def material(name: str = "Paint") -> Any:
    """A new one, with nodes: a Principled BSDF and the output."""
    made = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0):
        made.use_nodes = True
    return made


def principled(of: Any) -> Node:
    """The material's Principled BSDF."""
    return next(node for node in of.node_tree.nodes if node.type == "BSDF_PRINCIPLED")


def base_colour(of: Any) -> Socket:
    """Of the material's Principled BSDF."""
    return principled(of).inputs["Base Color"]


def refs(*names: str) -> tuple[BlockRef, ...]:
    """The objects of these names, as the command means them."""
    return tuple(refs_of_words(bpy.data.objects, names))


def read(names: Sequence[str], uv: str | None = None, **request: Any) -> tuple[Scene, list[str]]:
    """These objects as targets, by `read_scene`. uv: the UV map of all; request: other fields of its SceneRequest."""
    targets = refs(*names)
    maps = {} if uv is None else dict.fromkeys(targets, uv)
    return read_scene(bpy.context, view_layer_in(bpy.context), SceneRequest(targets, maps, **request))


def set_panel(**values: Any) -> Any:
    """Set what is named in the panel, all else as it is; returns the settings."""
    scene: Any = scene_in(bpy.context)
    chosen = scene.occlusion_bake
    for name, value in values.items():
        setattr(chosen, name, value)
    return chosen


def select(*objects: Any) -> None:
    """These alone, the first of them active."""
    bpy.ops.object.select_all(action="DESELECT")
    for obj in objects:
        obj.select_set(True)
    view_layer_in(bpy.context).objects.active = objects[0]


def press(button: str = "bake") -> set[str]:
    """A button of ours."""
    operators: Any = bpy.ops
    pressed: set[str] = getattr(operators.occlusion_bake, button)()
    return pressed


def bake_onto(*names: str) -> set[str]:
    """Bake these objects by the button, the last of them active."""
    select(*(bpy.data.objects[name] for name in reversed(names)))
    return press()


def uv_of(meant: bpy.types.Mesh, name: str | None = None) -> Floats:
    """(L, 2) float32 of a UV map, by default the active one: a pair for each corner of each polygon."""
    layer: Any = meant.uv_layers.active if name is None else meant.uv_layers[name]
    uv = np.empty((len(meant.loops), 2), np.float32)
    layer.uv.foreach_get("vector", uv.reshape(-1))
    return uv


def triangle_uv(meant: bpy.types.Mesh, name: str | None = None) -> Floats:
    """(T, 3, 2) float32 of a UV map, by default the active one."""
    return uv_of(meant, name)[corners_of(meant)]


def pixels(image: bpy.types.Image | str) -> Floats:
    """(H, W, 4) float32 of an image or the one of that name, row 0 at the top."""
    found = bpy.data.images[image] if isinstance(image, str) else image
    width, height = found.size
    values = np.empty(4 * width * height, np.float32)
    pixels_in(found).foreach_get(values)
    return values.reshape(height, width, 4)[::-1]
