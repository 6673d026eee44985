"""A scene as it renders: the depsgraph at render level.

Modifiers count at render level only in a depsgraph that Blender makes for an engine. `evaluated` gets one by a bake
with an engine of its own onto the colours of a passing triangle: unlike a render it needs no camera, leaves the Render
Result alone and calls no render handlers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any, ClassVar

import bpy

from .blender_state import bake_override, object_mode, passing_object, silenced, temporary_attributes, temporary_engine


class _Visitor(bpy.types.RenderEngine):
    """The engine that renders nothing and shows its depsgraph to `visit`. Registered only while in use."""

    bl_idname = "OCCLUSION_BAKE_VISITOR"
    bl_label = "Occlusion Bake"
    visit: ClassVar[Callable[[bpy.types.Depsgraph], None]]
    outcome: ClassVar[list[Exception | None]]  # one entry a visit

    def update(self, data: Any = None, depsgraph: Any = None) -> None:
        """Needed by Blender before `bake`; there is nothing to prepare."""

    def bake(self, depsgraph: Any, obj: Any, pass_type: Any, pass_filter: Any, width: Any, height: Any) -> None:
        """Show the depsgraph. Blender would only print an exception, so it is kept for `evaluated` to raise."""
        try:
            type(self).visit(depsgraph)
        except Exception as error:
            self.outcome.append(error)
        else:
            self.outcome.append(None)


def evaluated(
    context: bpy.types.Context, view_layer: bpy.types.ViewLayer, visit: Callable[[bpy.types.Depsgraph], None]
) -> None:
    """Call `visit` once with the view layer's depsgraph at render level; it dies when `visit` returns.

    What `visit` raises is raised here. The artist's mode, engine and handlers are back afterwards, come what may.
    """
    scene: Any = view_layer.id_data
    with ExitStack() as stack:
        stack.enter_context(object_mode(context))
        stack.enter_context(silenced("object_bake_pre", "object_bake_complete", "object_bake_cancel"))
        carrier = stack.enter_context(_carrier(scene))
        outcome = stack.enter_context(_registered(visit))
        stack.enter_context(temporary_engine(scene, _Visitor.bl_idname))
        temporary_attributes(stack, scene.render.bake, use_multires=False)
        temporary_attributes(stack, scene.render, use_bake_multires=False)
        stack.enter_context(bake_override(context, carrier, scene, view_layer))
        bpy.ops.object.bake(type="EMIT", target="VERTEX_COLORS", save_mode="INTERNAL", use_selected_to_active=False)
    if not outcome:
        raise RuntimeError("Blender did not evaluate the scene")
    if outcome[0] is not None:
        raise outcome[0]


@contextmanager
def _registered(visit: Callable[[bpy.types.Depsgraph], None]) -> Iterator[list[Exception | None]]:
    _Visitor.visit, _Visitor.outcome = staticmethod(visit), []
    bpy.utils.register_class(_Visitor)
    try:
        yield _Visitor.outcome
    finally:
        bpy.utils.unregister_class(_Visitor)
        del _Visitor.visit


@contextmanager
def _carrier(scene: bpy.types.Scene) -> Iterator[bpy.types.Object]:
    """A triangle without area that casts no shadow: what Blender is asked to bake when all we want is a depsgraph."""
    mesh = bpy.data.meshes.new("Occlusion Bake")
    mesh.from_pydata([(0.0, 0.0, 0.0)] * 3, [], [(0, 1, 2)])
    mesh.color_attributes.new("Occlusion Bake", "BYTE_COLOR", "CORNER")
    mesh.color_attributes.active_color_index = 0
    with passing_object(scene, mesh) as obj:
        obj.visible_shadow = False
        yield obj
