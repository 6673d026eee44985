"""Baked maps as colour attributes of a mesh."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager, nullcontext
from typing import Any

import bpy
import numpy as np

from ...core.base.arrays import Ints
from ...core.base.errors import InputError
from ...core.finish.baked import Baked
from ...core.finish.map_images import title
from ...core.scene.scene import Instance
from ...core.texels.vertex_bake import corner_values
from ..read.blender_state import object_mode
from ..read.writable_mesh import check_local, check_writable
from ..typed import found_in, mesh_of

_KIND: Any = ("FLOAT_COLOR", "CORNER")


def check_colours(obj: bpy.types.Object, target: Instance, names: Iterable[str]) -> None:
    """Refuse, before a bake, a mesh that could not take its values. names: of the maps. Raises InputError."""
    check_local(obj, obj.name)
    if not _has_corners(mesh_of(obj), target):
        raise InputError(f"{obj.name}: its modifiers make other faces than the mesh has; apply them, or bake a texture")
    _check_names(obj, map(title, names))


def store_colours(context: bpy.types.Context, obj: bpy.types.Object, target: Instance, baked: Baked) -> list[str]:
    """Put every map into a colour attribute of the mesh named after it, in the place of an earlier bake's.

    Float, a colour for each face corner. Returns the attributes' names. Raises InputError where the mesh is another by
    now, cannot be written to, or holds something else of that name; nothing is changed then.
    """
    mesh, names = mesh_of(obj), [title(name) for name in baked.maps]
    with _written_to(context, obj):
        if not _has_corners(mesh, target):
            raise InputError(f"{obj.name}: its faces were changed during the bake; bake again")
        _check_names(obj, names)
        for name, made in zip(names, baked.maps.values(), strict=True):
            attribute: Any = mesh.color_attributes.get(name) or mesh.color_attributes.new(name, *_KIND)
            colours = np.ones((len(mesh.loops), 4), dtype=np.float32)
            colours[_corners(target).reshape(-1), :3] = corner_values(made.values, target.mesh).reshape(-1, 1)
            attribute.data.foreach_set("color", colours.reshape(-1))
        mesh.color_attributes.active_color_name = names[0]
        mesh.update()
    return names


@contextmanager
def _written_to(context: bpy.types.Context, obj: bpy.types.Object) -> Iterator[None]:
    """Out of Edit Mode for the time, where the mesh is in it. Raises InputError as `check_writable`."""
    with object_mode(context) if mesh_of(obj).is_editmode else nullcontext():
        check_writable(obj, obj.name)
        yield


def _has_corners(mesh: bpy.types.Mesh, target: Instance) -> bool:
    """Whether the corners that are baked are those of the mesh itself, not of what modifiers made of it."""
    corners, vertices = _corners(target), np.empty(len(mesh.loops), dtype=np.int32)
    mesh.loops.foreach_get("vertex_index", vertices)
    return corners.max(initial=-1) < len(vertices) and np.array_equal(vertices[corners], target.mesh.triangles)


def _check_names(obj: bpy.types.Object, names: Iterable[str]) -> None:
    """Whether attributes of these names can be had. Blender gives none the name of a vertex group."""
    for name in names:
        there: Any = found_in(mesh_of(obj).attributes, name)
        if there is not None and (there.data_type, there.domain) != _KIND:
            raise InputError(f"{obj.name}: it has an attribute {name} of another kind; rename or remove that")
        if there is None and name in obj.vertex_groups:
            raise InputError(f"{obj.name}: it has a vertex group {name}, as its colors would be called; rename that")


def _corners(target: Instance) -> Ints:
    assert target.mesh.corners is not None  # it was read from Blender
    return target.mesh.corners
