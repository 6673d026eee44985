"""Baked maps as colour attributes of a mesh."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from ...core.base.arrays import Ints
from ...core.base.errors import InputError
from ...core.finish.baked import Baked
from ...core.finish.map_images import title
from ...core.scene.scene import Instance
from ...core.texels.vertex_bake import corner_values
from ..read.blender_state import synced
from ..typed import found_in, mesh_of


def check_colours(view_layer: bpy.types.ViewLayer, target: Instance) -> None:
    """Refuse, before a bake, a mesh whose corners could not take its values. Raises InputError."""
    obj = synced(view_layer)[target.name]
    if obj.data.library is not None:
        raise InputError(f"{obj.name}: its mesh is linked from {obj.data.library.filepath}; make it local first")
    _check_corners(obj, target)


def store_colours(obj: bpy.types.Object, target: Instance, baked: Baked) -> list[str]:
    """Put every map into a colour attribute of the mesh named after it, in the place of an earlier bake's.

    Float, a colour for each face corner. Returns the attributes' names. Raises InputError where the mesh is another by
    now, or holds an attribute of that name and of another kind; nothing is changed then.
    """
    _check_corners(obj, target)
    mesh, names = mesh_of(obj), [title(name) for name in baked.maps]
    for name in names:
        there = found_in(mesh.attributes, name)
        if there is not None and (there.data_type, there.domain) != ("FLOAT_COLOR", "CORNER"):
            raise InputError(f"{obj.name}: it has an attribute {name} of another kind; rename or remove that")
    for name, made in zip(names, baked.maps.values(), strict=True):
        attribute: Any = mesh.color_attributes.get(name) or mesh.color_attributes.new(name, "FLOAT_COLOR", "CORNER")
        colours = np.ones((len(mesh.loops), 4), dtype=np.float32)
        colours[_corners(target).reshape(-1), :3] = corner_values(made.values, target.mesh).reshape(-1, 1)
        attribute.data.foreach_set("color", colours.reshape(-1))
    mesh.color_attributes.active_color_name = names[0]
    mesh.update()
    return names


def _check_corners(obj: bpy.types.Object, target: Instance) -> None:
    """Whether the corners that were baked are those of the mesh itself, not of what modifiers made of it."""
    corners, mesh = _corners(target), mesh_of(obj)
    vertices = np.empty(len(mesh.loops), dtype=np.int32)
    mesh.loops.foreach_get("vertex_index", vertices)
    if corners.max(initial=-1) >= len(vertices) or not np.array_equal(vertices[corners], target.mesh.triangles):
        raise InputError(f"{obj.name}: its modifiers make other faces than the mesh has; apply them, or bake a texture")


def _corners(target: Instance) -> Ints:
    assert target.mesh.corners is not None  # it was read from Blender
    return target.mesh.corners
