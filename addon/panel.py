"""What the artist sees: a tab in the 3D view's sidebar."""

from __future__ import annotations

import bpy

from .operators import OCCLUSION_BAKE_OT_bake, OCCLUSION_BAKE_OT_compare, OCCLUSION_BAKE_OT_unwrap


class _Sidebar:
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Occlusion"


class OCCLUSION_BAKE_PT_bake(_Sidebar, bpy.types.Panel):
    """What to bake, the button, and what came of it."""

    bl_idname = "OCCLUSION_BAKE_PT_bake"
    bl_label = "Occlusion Bake"

    def draw(self, context: bpy.types.Context) -> None:
        layout, chosen = self.layout, context.scene.occlusion_bake
        layout.use_property_split = True
        layout.use_property_decorate = False
        maps = layout.column(heading="Maps")
        maps.prop(chosen, "use_ao")
        maps.prop(chosen, "use_ro")
        size = layout.column(align=True)
        size.prop(chosen, "width", text="Size X")
        size.prop(chosen, "height", text="Y")
        layout.prop(chosen, "rays")
        layout.prop(chosen, "use_material")
        self._draw_button(context)

    def _draw_button(self, context: bpy.types.Context) -> None:
        shown = context.window_manager.occlusion_bake
        layout = self.layout
        if shown.running:
            layout.progress(factor=shown.fraction, text=shown.stage)
            layout.label(text="Esc cancels", icon="EVENT_ESC")
        else:
            row = layout.row()
            row.scale_y = 1.6
            row.operator(OCCLUSION_BAKE_OT_bake.bl_idname, icon="RENDER_STILL")
        for line in filter(None, shown.lines.split("\n")):
            layout.label(text=line)


class OCCLUSION_BAKE_PT_reflection(_Sidebar, bpy.types.Panel):
    """Exponents and direction of RO."""

    bl_parent_id = OCCLUSION_BAKE_PT_bake.bl_idname
    bl_label = "Reflection"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        layout, chosen = self.layout, context.scene.occlusion_bake
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.active = chosen.use_ro
        layout.prop(chosen, "exponents")
        layout.prop(chosen, "direction")


class OCCLUSION_BAKE_PT_options(_Sidebar, bpy.types.Panel):
    """Distance, UVs, margin, and what is seldom changed."""

    bl_parent_id = OCCLUSION_BAKE_PT_bake.bl_idname
    bl_label = "Options"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        layout, chosen = self.layout, context.scene.occlusion_bake
        layout.use_property_split = True
        layout.use_property_decorate = False
        row = layout.row(heading="Distance")
        row.prop(chosen, "use_distance", text="")
        value = row.row()
        value.active = chosen.use_distance
        value.prop(chosen, "distance", text="")
        layout.prop(chosen, "uv")
        layout.operator(OCCLUSION_BAKE_OT_unwrap.bl_idname, icon="UV")
        layout.prop(chosen, "margin")
        layout.prop(chosen, "seed")
        layout.prop(chosen, "threads")


class OCCLUSION_BAKE_PT_cycles(_Sidebar, bpy.types.Panel):
    """The comparison."""

    bl_parent_id = OCCLUSION_BAKE_PT_bake.bl_idname
    bl_label = "Compare with Cycles"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(context.scene.occlusion_bake, "cycles_samples")
        layout.operator(OCCLUSION_BAKE_OT_compare.bl_idname, icon="MOD_OPACITY")


CLASSES = (
    OCCLUSION_BAKE_PT_bake,
    OCCLUSION_BAKE_PT_reflection,
    OCCLUSION_BAKE_PT_options,
    OCCLUSION_BAKE_PT_cycles,
)
