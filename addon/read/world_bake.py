"""The World's light by Cycles, for parts of the octahedral map, in a scene of our own.

A bake of the environment gives each point of a mesh the World's light from its direction, seen from the origin. So the
faces of an octahedron, with the octahedral map for their UVs, are filled with the very map that is wanted, and any
square of it can be filled by as many points as are needed. Unlike a render, a bake leaves the Render Result alone and
calls no render handlers.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

import bpy
import numpy as np

from ...core.base.arrays import Doubles, Floats
from ...core.spherical.octahedral_map import on_octahedron
from ..typed import mesh_of, pixels_in
from .bake_operator import INTO_IMAGE, run_operator, with_texture
from .blender_state import bake_override, passing_object, silenced
from .cycles_scene import passing_scene
from .world_nodes import show_to_surfaces

_NAME = "Occlusion Bake"
_SAMPLES = 4  # of each point of a square


@contextmanager
def world_scene(scene: bpy.types.Scene, world: bpy.types.World) -> Iterator[bpy.types.Scene]:
    """A scene without objects at the same frame, with a copy of the World as surfaces see it, for the time.

    Raises InputError where Cycles is not enabled.
    """
    with ExitStack() as stack:
        passing: Any = stack.enter_context(passing_scene(scene, f"{world.name}:", _SAMPLES))
        passing.world = world.copy()
        stack.callback(bpy.data.worlds.remove, passing.world)
        passing.world.cycles.sampling_method = "NONE"  # nothing is lit by it
        show_to_surfaces(stack, passing.world)
        yield passing


def light_of_squares(scene: bpy.types.Scene, corners: Doubles, count: int, width: float = 1.0) -> Floats:
    """The means of light over the count × count parts of Q squares of the octahedral map: (Q, count, count, 3) float32.

    scene: a passing one. corners: (Q, 2), where the squares begin; none lies across an axis of the map. count: a power
    of two. Rows go by y. Raises InputError where Cycles gives up.
    """
    blocks = 1 << int(np.ceil(0.5 * np.log2(len(corners))))
    with ExitStack() as stack:
        stack.enter_context(silenced("object_bake_pre", "object_bake_complete", "object_bake_cancel"))
        obj = stack.enter_context(passing_object(scene, _mesh(corners, width, blocks)))
        image = stack.enter_context(_image_on(obj, blocks * count))
        stack.enter_context(bake_override(bpy.context, obj, scene, scene.view_layers[0]))
        _bake(scene.world)
        pixels = np.empty((blocks, count, blocks, count, 4), dtype=np.float32)
        pixels_in(image).foreach_get(pixels.reshape(-1))
    return pixels[..., :3].swapaxes(1, 2).reshape(-1, count, count, 3)[: len(corners)]


def _mesh(corners: Doubles, width: float, blocks: int) -> bpy.types.Mesh:
    """Each square as two triangles on the octahedron, cut where it folds, with a block of the picture for its UVs."""
    steps = np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
    falling = (corners + 0.5 * width).prod(axis=1) > 0.0  # the fold goes from the second corner to the fourth
    steps = np.where(falling[:, np.newaxis, np.newaxis], steps, np.roll(steps, -1, axis=0))  # (Q, 4, 2)
    triangles = [0, 1, 3, 1, 2, 3]
    numbers = np.arange(len(corners), dtype=np.int64)
    uv = (np.stack([numbers % blocks, numbers // blocks], axis=1)[:, np.newaxis] + steps) / blocks
    places = on_octahedron(corners[:, np.newaxis] + width * steps)[:, triangles].reshape(-1, 3)
    mesh = bpy.data.meshes.new(_NAME)
    mesh.from_pydata(places, [], np.arange(len(places), dtype=np.int64).reshape(-1, 3))
    layer = mesh.uv_layers.new(name=_NAME)
    layer.uv.foreach_set("vector", uv[:, triangles].astype(np.float32).reshape(-1))
    return mesh


@contextmanager
def _image_on(obj: bpy.types.Object, side: int) -> Iterator[bpy.types.Image]:
    """A square float image of plain data that a bake of the object fills."""
    with ExitStack() as stack:
        image = bpy.data.images.new(_NAME, side, side, alpha=True, float_buffer=True, is_data=True)
        stack.callback(bpy.data.images.remove, image)
        material = with_texture(None, image)
        stack.callback(bpy.data.materials.remove, material)
        mesh_of(obj).materials.append(material)
        yield image


def _bake(world: Any) -> None:
    run_operator(world.name, "evaluate it", "its evaluation", type="ENVIRONMENT", **INTO_IMAGE)
