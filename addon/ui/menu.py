"""The same buttons in Blender's menus, where its search finds them, too."""

from __future__ import annotations

from typing import Any

import bpy

from ..typed import layout_of
from .operators import (
    OCCLUSION_BAKE_OT_again,
    OCCLUSION_BAKE_OT_bake,
    OCCLUSION_BAKE_OT_compare,
    OCCLUSION_BAKE_OT_select_overlap,
    OCCLUSION_BAKE_OT_unhook,
    OCCLUSION_BAKE_OT_unwrap,
)


class OCCLUSION_BAKE_MT_object(bpy.types.Menu):
    """Object > Occlusion Bake."""

    bl_idname = "OCCLUSION_BAKE_MT_object"
    bl_label = "Occlusion Bake"

    def draw(self, context: bpy.types.Context) -> None:
        layout = layout_of(self)
        layout.operator_context = "INVOKE_DEFAULT"  # or the window would wait for the bake
        layout.operator(OCCLUSION_BAKE_OT_bake.bl_idname, icon="RENDER_STILL")
        layout.operator(OCCLUSION_BAKE_OT_compare.bl_idname, icon="MOD_OPACITY")
        layout.separator()
        layout.operator(OCCLUSION_BAKE_OT_unwrap.bl_idname, icon="UV")
        layout.operator(OCCLUSION_BAKE_OT_select_overlap.bl_idname, icon="RESTRICT_SELECT_OFF")
        layout.operator(OCCLUSION_BAKE_OT_unhook.bl_idname, icon="X")


def _in_object_menu(self: Any, context: bpy.types.Context) -> None:
    self.layout.separator()
    self.layout.menu(OCCLUSION_BAKE_MT_object.bl_idname)


def _in_image_menu(self: Any, context: bpy.types.Context) -> None:
    self.layout.separator()
    self.layout.operator_context = "INVOKE_DEFAULT"
    self.layout.operator(OCCLUSION_BAKE_OT_again.bl_idname, icon="FILE_REFRESH")


CLASSES = (OCCLUSION_BAKE_MT_object,)
_PLACES = (("VIEW3D_MT_object", _in_object_menu), ("IMAGE_MT_image", _in_image_menu))


def add_to_menus() -> None:
    """After the classes are registered."""
    for menu, draw in _PLACES:
        getattr(bpy.types, menu).append(draw)


def remove_from_menus() -> None:
    """Before they are unregistered."""
    for menu, draw in _PLACES:
        getattr(bpy.types, menu).remove(draw)
