"""What we change in Blender for the time, and how it comes back as it was."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from typing import Any

import bpy

from ..typed import view_layer_in


def synced(view_layer: bpy.types.ViewLayer) -> Any:
    """The view layer's objects: Blender lacks new ones and holds None for removed ones until asked for the active."""
    _ = view_layer.objects.active
    return view_layer.objects


@contextmanager
def passing_object(scene: bpy.types.Scene, mesh: bpy.types.Mesh) -> Iterator[bpy.types.Object]:
    """An object of a new mesh in the scene for the time; both are gone afterwards."""
    obj = bpy.data.objects.new(mesh.name, mesh)
    scene.collection.objects.link(obj)
    try:
        yield obj
    finally:
        bpy.data.objects.remove(obj)
        bpy.data.meshes.remove(mesh)
        for view_layer in scene.view_layers:
            synced(view_layer)


def temporary_attributes(stack: ExitStack, owner: Any, **values: Any) -> None:
    """Set attributes of `owner` until the stack closes; those that this Blender does not have are passed over."""
    for name, value in values.items():
        if hasattr(owner, name):
            stack.callback(setattr, owner, name, getattr(owner, name))
            setattr(owner, name, value)


@contextmanager
def temporary_engine(scene: bpy.types.Scene, engine: str) -> Iterator[None]:
    """Another render engine for the time. The artist's comes back even where it is not installed here, which Blender
    lets nobody set and tells to be another. Raises TypeError where `engine` itself is not there."""
    render: Any = scene.render
    before, shown = _stored(render), render.engine
    render.engine = engine
    at = _stored(render).find(f"{engine}\0".encode())
    stored = before[at:].split(b"\0")[0].decode() if at >= 0 else ""
    try:
        yield
    finally:
        _set_engine(render, stored or shown)


def _stored(render: Any) -> bytes:
    """The settings in Blender's memory, up to those of bakes, which follow the name of the engine."""
    start = render.as_pointer()
    return ctypes.string_at(start, max(render.bake.as_pointer() - start, 0))


def _set_engine(render: Any, name: str) -> None:
    with suppress(TypeError):
        render.engine = name
        return
    absent = type("OCCLUSION_BAKE_absent_engine", (bpy.types.RenderEngine,), {"bl_idname": name, "bl_label": name})
    bpy.utils.register_class(absent)
    try:
        render.engine = name
    finally:
        bpy.utils.unregister_class(absent)


@contextmanager
def silenced(*names: str) -> Iterator[None]:
    """Empty these lists of bpy.app.handlers for the time: what we do is no render or bake of the artist's."""
    lists = [getattr(bpy.app.handlers, name) for name in names if hasattr(bpy.app.handlers, name)]
    kept = [list(handlers) for handlers in lists]
    for handlers in lists:
        handlers.clear()
    try:
        yield
    finally:
        for handlers, before in zip(lists, kept, strict=True):
            handlers[:] = before


@contextmanager
def bake_override(
    context: bpy.types.Context,
    obj: bpy.types.Object,
    scene: bpy.types.Scene,
    view_layer: bpy.types.ViewLayer,
    more: Sequence[bpy.types.Object] = (),
) -> Iterator[None]:
    """Let operators take `obj` for the active object, and it and `more` alone for selected, whatever the artist has
    selected or hidden."""
    with context.temp_override(
        scene=scene, view_layer=view_layer, active_object=obj, object=obj, selected_objects=[*more, obj]
    ):
        yield


@contextmanager
def object_mode(context: bpy.types.Context) -> Iterator[None]:
    """Out of edit mode for the time, with all edits in the data; the edited objects, selection and mode come back.

    A mesh that is being edited evaluates without its modifiers, even for a render. Where edit mode was left, and only
    there, two undo steps are pushed: without them an undo to a step before the edit would leave the edit in the mesh.
    """
    objects = synced(view_layer_in(context))
    edited = [obj for obj in objects if obj.mode == "EDIT"]
    bpy.ops.ed.flush_edits()
    if not edited:
        yield
        return
    active = objects.active
    if active not in edited:  # which were entered in another scene
        objects.active = edited[0]
    bpy.ops.object.mode_set(mode="OBJECT")
    try:
        yield
    finally:
        bpy.ops.ed.undo_push(message="Leave Edit Mode")
        _edit_again(objects, edited)
        objects.active = active
        bpy.ops.ed.undo_push(message="Return to Edit Mode")


def _edit_again(objects: Any, edited: Sequence[bpy.types.Object]) -> None:
    selected = [obj for obj in objects if obj.select_get()]
    _select_only(selected, edited)
    bpy.ops.object.mode_set(mode="EDIT")
    _select_only(edited, selected)


def _select_only(before: Sequence[bpy.types.Object], after: Sequence[bpy.types.Object]) -> None:
    for obj in before:
        obj.select_set(False)
    for obj in after:
        obj.select_set(True)
