"""Blender's own unwrap, where ours fails or the artist prefers it: Smart UV Project on copies of the meshes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from math import radians

import bpy
import numpy as np

from ...core.base.arrays import Floats
from ..read.blender_state import object_mode, synced
from ..read.mesh_arrays import corners_of
from ..typed import mesh_of, scene_in, view_layer_in

_ANGLE = radians(66.0)  # the operator's default: faces that turn more part


def smart_unwrap(context: bpy.types.Context, objects: Sequence[bpy.types.Object], *, in_world: bool) -> list[Floats]:
    """Charts for the meshes of several objects; nothing of theirs changes.

    in_world: cut as they are in the world, not as meshes. Returns (T, 3, 2) float32 UVs for each, by the triangles of
    `base_mesh.base_triangles`. They lie side by side without any room between them, for a layout to be made of: Blender
    would let charts shrink to points where they are too many for the margin.
    """
    with object_mode(context), _copies(context, objects, in_world) as copies:
        try:
            _enter_edit_mode(context)
            bpy.ops.mesh.reveal(select=False)
            bpy.ops.mesh.select_all(action="SELECT")
            bpy.ops.uv.smart_project(
                angle_limit=_ANGLE, island_margin=0.0, margin_method="SCALED", scale_to_bounds=False
            )
        finally:
            bpy.ops.object.mode_set(mode="OBJECT")
        return [_layout(mesh_of(copy)) for copy in copies]


def _enter_edit_mode(context: bpy.types.Context) -> None:
    """With all that is selected: under a view in local mode Blender would leave out what that does not show."""
    with context.temp_override(area=None, region=None):
        bpy.ops.object.mode_set(mode="EDIT")


@contextmanager
def _copies(
    context: bpy.types.Context, objects: Sequence[bpy.types.Object], in_world: bool
) -> Iterator[list[bpy.types.Object]]:
    """Copies of objects, without modifiers, alone selected in the scene for the time."""
    scene, view_layer = scene_in(context), view_layer_in(context)
    active = view_layer.objects.active
    selected = [obj for obj in synced(view_layer) if obj.select_get()]
    copies: list[bpy.types.Object] = []
    try:
        for obj in selected:
            obj.select_set(False)
        for obj in objects:
            mesh = mesh_of(obj).copy()
            copy = bpy.data.objects.new(obj.name, mesh)
            copies.append(copy)
            if mesh.shape_keys is not None:  # or Edit Mode would show one of them
                copy.shape_key_clear()
            mesh.materials.clear()  # the operator corrects for the aspect of their textures
            if in_world:  # the operator does not look at the objects' scale
                mesh.transform(obj.matrix_world)
            _bare(mesh)
            scene.collection.objects.link(copy)
            copy.select_set(True)
        view_layer.objects.active = copies[0]
        view_layer.update()
        yield copies
    finally:
        for copy in copies:
            mesh = mesh_of(copy)
            bpy.data.objects.remove(copy)
            bpy.data.meshes.remove(mesh)
        synced(view_layer)
        for obj in selected:
            obj.select_set(True)
        view_layer.objects.active = active


def _bare(mesh: bpy.types.Mesh) -> None:
    """A copy with one UV map, and one that has room for it."""
    while mesh.uv_layers:
        mesh.uv_layers.remove(mesh.uv_layers[0])
    mesh.uv_layers.new(name="Charts")


def _layout(mesh: bpy.types.Mesh) -> Floats:
    values = np.empty((len(mesh.loops), 2), dtype=np.float32)
    mesh.uv_layers[0].uv.foreach_get("vector", values.reshape(-1))
    return values[corners_of(mesh)]
