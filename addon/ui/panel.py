"""What the artist sees: a tab in the 3D view's sidebar."""

from __future__ import annotations

from itertools import islice
from textwrap import wrap
from typing import ClassVar

import bpy

from ..job.bake_job import BAKING, DONE, REFUSED, WAITING
from ..output.blender_images import MARK
from ..output.destination import CHANNEL, PACKED, SAVED
from ..read.occluder_filter import may_occlude
from .engine_operator import OCCLUSION_BAKE_OT_for_engine
from .modal_operator import percent, progress_words, queue, running
from .operators import (
    OCCLUSION_BAKE_OT_again,
    OCCLUSION_BAKE_OT_bake,
    OCCLUSION_BAKE_OT_cancel,
    OCCLUSION_BAKE_OT_compare,
    OCCLUSION_BAKE_OT_select_overlap,
    OCCLUSION_BAKE_OT_unhook,
    OCCLUSION_BAKE_OT_unwrap,
)
from .presets import OCCLUSION_BAKE_PT_presets
from .properties import OcclusionBakeSettings, by_rays
from .request import chosen_occluders, is_ours
from .translate import say

# At a scale of 1, in pixels: what the sidebar's tabs and margins take, and an average letter.
_FRAME, _LETTER = 56.0, 5.7
_LISTED = 8  # occluders by name: a scene may hold thousands, and panels are drawn often


class _Sidebar:
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Occlusion"


class _Settings(_Sidebar):
    """Mixed into a panel of settings below the first, closed until it is asked for."""

    bl_parent_id = "OCCLUSION_BAKE_PT_bake"
    bl_options: ClassVar = {"DEFAULT_CLOSED"}


class _Switched(_Settings):
    """With a box in its head that switches what is below on."""

    switch: ClassVar[str]  # the setting's name

    def draw_header(self, context: bpy.types.Context) -> None:
        self.layout.prop(context.scene.occlusion_bake, self.switch, text="")


def _begin(panel: bpy.types.Panel, context: bpy.types.Context) -> tuple[bpy.types.UILayout, OcclusionBakeSettings]:
    """A panel's layout, names beside values as Blender has it, and the settings."""
    panel.layout.use_property_split = True
    panel.layout.use_property_decorate = False
    return panel.layout, context.scene.occlusion_bake


class OCCLUSION_BAKE_PT_bake(_Sidebar, bpy.types.Panel):
    """What to bake, and the button."""

    bl_idname = "OCCLUSION_BAKE_PT_bake"
    bl_label = "Occlusion Bake"

    def draw_header_preset(self, context: bpy.types.Context) -> None:
        OCCLUSION_BAKE_PT_presets.draw_panel_header(self.layout)

    def draw(self, context: bpy.types.Context) -> None:
        layout, chosen = _begin(self, context)
        maps = layout.column(heading="Maps")
        maps.prop(chosen, "use_ao")
        maps.prop(chosen, "use_ro")
        maps.prop(chosen, "use_bent")
        size = layout.column(align=True)
        size.prop(chosen, "width", text="Size X")
        size.prop(chosen, "height", text="Y")
        layout.prop(chosen, "quality")
        if by_rays(chosen):
            layout.prop(chosen, "rays")
        layout.prop(context.window_manager.occlusion_bake, "show")
        draw_button(layout, OCCLUSION_BAKE_OT_bake.bl_idname, "RENDER_STILL")


def draw_button(layout: bpy.types.UILayout, operator: str, icon: str) -> None:
    """The button that bakes; while it does, how far it is, and the way out."""
    row = layout.row(align=True)
    row.scale_y = 1.6
    progress = running()
    if progress is None:
        row.operator(operator, icon=icon)
        return
    row.progress(factor=progress.fraction, text=percent(progress))
    row.operator(OCCLUSION_BAKE_OT_cancel.bl_idname, text="", icon="X")
    column = layout.column(align=True)
    for words in progress_words(progress):
        column.label(text=words, translate=False)
    _draw_queue(column)


_STATES = {WAITING: "RADIOBUT_OFF", BAKING: "RADIOBUT_ON", DONE: "CHECKMARK", REFUSED: "ERROR"}


def _draw_queue(column: bpy.types.UILayout) -> None:
    """Where several objects are baked, each with its state: of many those about the one that is being baked."""
    states = list(queue().items())
    if len(states) < 2:
        return
    done = sum(state in (DONE, REFUSED) for _, state in states)
    first = max(min(done - _LISTED // 2, len(states) - _LISTED), 0)
    column.separator()
    column.label(text=say("{} of {} objects done", done, len(states)), translate=False)
    for name, state in states[first : first + _LISTED]:
        column.label(text=name, icon=_STATES[state], translate=False)


class OCCLUSION_BAKE_PT_result(_Sidebar, bpy.types.Panel):
    """What came of it, in lines as wide as the sidebar."""

    bl_parent_id = OCCLUSION_BAKE_PT_bake.bl_idname
    bl_label = "Result"

    def draw(self, context: bpy.types.Context) -> None:
        column = self.layout.column(align=True)
        column.scale_y = 0.8
        lines = context.window_manager.occlusion_bake.lines or say("None yet")
        for line in lines.split("\n"):
            for part in wrap(line, _letters(context), subsequent_indent="   "):
                column.label(text=part, translate=False)
        if context.window_manager.occlusion_bake.overlapping:
            self.layout.operator(OCCLUSION_BAKE_OT_select_overlap.bl_idname, icon="RESTRICT_SELECT_OFF")


def _letters(context: bpy.types.Context) -> int:
    """How many letters of ordinary text a line holds, as the sidebar is wide now."""
    width = context.region.width / context.preferences.system.ui_scale
    return max(int((width - _FRAME) / _LETTER), 16)


class OCCLUSION_BAKE_PT_reflection(_Settings, bpy.types.Panel):
    """Exponents and direction of RO."""

    bl_label = "Reflection"

    def draw(self, context: bpy.types.Context) -> None:
        layout, chosen = _begin(self, context)
        layout.active = chosen.use_ro
        layout.prop(chosen, "exponents")
        layout.prop(chosen, "direction")
        horizon = layout.row()
        horizon.active = chosen.direction == "CAMERA"
        horizon.prop(chosen, "divide_horizon")


class OCCLUSION_BAKE_PT_bent(_Settings, bpy.types.Panel):
    """How bent normals are written."""

    bl_label = "Bent Normals"

    def draw(self, context: bpy.types.Context) -> None:
        layout, chosen = _begin(self, context)
        layout.active = chosen.use_bent
        layout.prop(chosen, "bent_space")
        layout.prop(chosen, "bent_y", expand=True)
        layout.prop(chosen, "bent_alpha")


class OCCLUSION_BAKE_PT_code(_Switched, bpy.types.Panel):
    """What reflections are rebuilt from in any view."""

    bl_label = "Directional Code"
    switch = "use_code"

    def draw(self, context: bpy.types.Context) -> None:
        layout, chosen = _begin(self, context)
        layout.active = chosen.use_code
        layout.prop(chosen, "code")
        if chosen.code == "SH":
            layout.prop(chosen, "code_degree")
        layout.prop(chosen, "code_rays")


class OCCLUSION_BAKE_PT_light(_Switched, bpy.types.Panel):
    """Light of the World."""

    bl_label = "World Light"
    switch = "use_light"

    def draw(self, context: bpy.types.Context) -> None:
        layout, chosen = _begin(self, context)
        layout.active = chosen.use_light
        layout.prop(chosen, "light_picture")
        layout.prop(chosen, "use_light_lobe")


class OCCLUSION_BAKE_PT_occluders(_Settings, bpy.types.Panel):
    """Who blocks light, by choice and by name."""

    bl_label = "Occluders"

    def draw(self, context: bpy.types.Context) -> None:
        layout, chosen = _begin(self, context)
        layout.prop(chosen, "occluders", text="Objects")
        if chosen.occluders == "COLLECTION":
            layout.prop(chosen, "collection")
        layout.prop(chosen, "use_ground")
        layout.prop(chosen, "use_front_only")
        self._draw_list(context)

    def _draw_list(self, context: bpy.types.Context) -> None:
        column = self.layout.column(align=True)
        column.active = False
        found = chosen_occluders(context)
        objects = context.view_layer.objects if found is None else found
        names = [obj.name for obj in islice(filter(may_occlude, objects), _LISTED + 1)]
        for name in names[:_LISTED]:
            column.label(text=name, icon="OBJECT_DATA", translate=False)
        if len(names) > _LISTED:
            column.label(text="and more")
        if context.scene.occlusion_bake.occluders in ("SELF", "COLLECTION"):
            column.label(text="Each baked object itself", icon="OBJECT_DATA")


class OCCLUSION_BAKE_PT_highs(_Settings, bpy.types.Panel):
    """What surface is baked."""

    bl_label = "High to Low"

    def draw(self, context: bpy.types.Context) -> None:
        layout, chosen = _begin(self, context)
        layout.prop(chosen, "source")
        more = layout.column()
        more.active = chosen.source != "SELF"
        if chosen.source == "SELECTED":
            more.prop(chosen, "cage")
        more.prop(chosen, "extrusion")


class OCCLUSION_BAKE_PT_output(_Settings, bpy.types.Panel):
    """Where the images go."""

    bl_label = "Output"

    def draw(self, context: bpy.types.Context) -> None:
        layout, chosen = _begin(self, context)
        layout.operator_menu_enum(OCCLUSION_BAKE_OT_for_engine.bl_idname, "engine", icon="EXPORT")
        layout.prop(chosen, "layout", text="Images Of")
        if chosen.layout == "ATLAS":
            layout.prop(chosen, "atlas")
        layout.prop(chosen, "output", text="To")
        if chosen.output == SAVED:
            layout.prop(chosen, "path")
            layout.prop(chosen, "format")
            layout.prop(chosen, "depth", expand=True)
            dither = layout.row()
            dither.active = chosen.depth == "8"
            dither.prop(chosen, "use_dither")
        if chosen.output == CHANNEL:
            layout.prop(chosen, "image")
            layout.prop(chosen, "channel", expand=True)
            layout.prop(chosen, "use_dither")
        if chosen.layout == "EACH" and chosen.output in (PACKED, SAVED):
            layout.prop(chosen, "use_udim")


class OCCLUSION_BAKE_PT_image(bpy.types.Panel):
    """What an image of ours says of itself, beside it."""

    bl_space_type = "IMAGE_EDITOR"
    bl_region_type = "UI"
    bl_category = "Occlusion"
    bl_idname = "OCCLUSION_BAKE_PT_image"
    bl_label = "Occlusion Bake"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return is_ours(context.edit_image)

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.label(text=context.edit_image[MARK].replace("/", ", "), icon="OBJECT_DATA", translate=False)
        draw_button(self.layout, OCCLUSION_BAKE_OT_again.bl_idname, "FILE_REFRESH")


class OCCLUSION_BAKE_PT_material(_Settings, bpy.types.Panel):
    """The baked images in the objects' materials."""

    bl_label = "Material"

    def draw(self, context: bpy.types.Context) -> None:
        layout, chosen = _begin(self, context)
        layout.prop(chosen, "use_material")
        layout.prop(chosen, "use_gltf")
        layout.operator(OCCLUSION_BAKE_OT_unhook.bl_idname, icon="X")


class OCCLUSION_BAKE_PT_options(_Settings, bpy.types.Panel):
    """Distance, filter, UVs, margin, and what is seldom changed."""

    bl_label = "Options"

    def draw(self, context: bpy.types.Context) -> None:
        layout, chosen = _begin(self, context)
        row = layout.row(heading="Distance")
        row.prop(chosen, "use_distance", text="")
        value = row.row()
        value.active = chosen.use_distance
        value.prop(chosen, "distance", text="")
        falloff = layout.row()
        falloff.active = chosen.use_distance
        falloff.prop(chosen, "falloff")
        layout.prop(chosen, "nearest")
        layout.prop(chosen, "spread")
        layout.prop(chosen, "use_normal_maps")
        smooth = layout.row()
        smooth.active = not by_rays(chosen)
        smooth.prop(chosen, "use_filter")
        layout.prop(chosen, "uv")
        layout.operator(OCCLUSION_BAKE_OT_unwrap.bl_idname, icon="UV")
        layout.prop(chosen, "margin")
        layout.prop(chosen, "seed")
        layout.prop(chosen, "threads")


class OCCLUSION_BAKE_PT_cycles(_Settings, bpy.types.Panel):
    """The comparison."""

    bl_label = "Compare with Cycles"

    def draw(self, context: bpy.types.Context) -> None:
        layout, chosen = _begin(self, context)
        layout.prop(chosen, "cycles_samples", text="Samples")
        layout.operator(OCCLUSION_BAKE_OT_compare.bl_idname, text="Compare", icon="MOD_OPACITY")


CLASSES = (
    OCCLUSION_BAKE_PT_bake,
    OCCLUSION_BAKE_PT_result,
    OCCLUSION_BAKE_PT_reflection,
    OCCLUSION_BAKE_PT_bent,
    OCCLUSION_BAKE_PT_code,
    OCCLUSION_BAKE_PT_light,
    OCCLUSION_BAKE_PT_occluders,
    OCCLUSION_BAKE_PT_highs,
    OCCLUSION_BAKE_PT_output,
    OCCLUSION_BAKE_PT_material,
    OCCLUSION_BAKE_PT_options,
    OCCLUSION_BAKE_PT_cycles,
    OCCLUSION_BAKE_PT_image,
)
