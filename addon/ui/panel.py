"""What the artist sees: a tab in the 3D view's sidebar."""

from __future__ import annotations

from itertools import islice
from textwrap import wrap
from typing import Any, ClassVar

import bpy

from ...core.maps.registry import MAPS
from ...core.options.table import by_rays
from ..job.outcome import BAKING, DONE, REFUSED, WAITING
from ..output.ownership import told
from ..read.occluder_filter import may_occlude
from ..typed import PanelMixin, layout_of, view_layer_in
from .engine_operator import OCCLUSION_BAKE_OT_for_engine
from .missing_libraries import missing_libraries
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
from .properties import draw_options, result_in, settings_in
from .request import chosen_occluders, is_ours
from .translate import say

# At a scale of 1, in pixels: what the sidebar's tabs and margins take, and an average letter.
_FRAME, _LETTER = 56.0, 5.7
_OF_ICON = 4  # letters
_LISTED = 8  # occluders by name: a scene may hold thousands, and panels are drawn often


class _Sidebar(PanelMixin):
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Occlusion"


class _Settings(_Sidebar):
    """Mixed into a panel of settings below the first, closed until it is asked for."""

    bl_parent_id = "OCCLUSION_BAKE_PT_bake"
    bl_options = {"DEFAULT_CLOSED"}


class _Listed(_Settings):
    """Of nothing but rows of the table of options."""

    options: ClassVar[str]  # their key there
    switch: ClassVar[str] = ""  # the setting without which they do not count

    def draw(self, context: bpy.types.Context) -> None:
        layout, chosen = _begin(self, context)
        if self.switch:
            layout.active = getattr(chosen, self.switch)
        draw_options(layout, chosen, self.options)


class _Switched(_Listed):
    """With a box in its head that switches what is below on."""

    def draw_header(self, context: bpy.types.Context) -> None:
        layout_of(self).prop(settings_in(context), self.switch, text="")


def _begin(panel: bpy.types.Panel, context: bpy.types.Context) -> tuple[bpy.types.UILayout, Any]:
    """A panel's layout, names beside values as Blender has it, and the settings."""
    layout = layout_of(panel)
    layout.use_property_split = True
    layout.use_property_decorate = False
    return layout, settings_in(context)


class OCCLUSION_BAKE_PT_bake(_Sidebar, bpy.types.Panel):
    """What to bake, and the button."""

    bl_idname = "OCCLUSION_BAKE_PT_bake"
    bl_label = "Occlusion Bake"

    def draw_header_preset(self, context: bpy.types.Context) -> None:
        OCCLUSION_BAKE_PT_presets.draw_panel_header(self.layout)

    def draw(self, context: bpy.types.Context) -> None:
        layout, chosen = _begin(self, context)
        for line in missing_libraries():
            _draw_wrapped(layout.column(align=True), context, line, icon="ERROR")
        maps = layout.column(heading="Maps")
        for entry in MAPS:
            if entry.switch and entry.listed:
                maps.prop(chosen, entry.switch)
        size = layout.column(align=True)
        size.prop(chosen, "width", text="Size X")
        size.prop(chosen, "height", text="Y")
        layout.prop(chosen, "quality")
        if by_rays(chosen):
            layout.prop(chosen, "rays")
        layout.prop(result_in(context), "show")
        draw_button(layout, OCCLUSION_BAKE_OT_bake.bl_idname, "RENDER_STILL")


def draw_button(layout: bpy.types.UILayout, operator: str, icon: Any) -> None:
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


_STATES: dict[str, Any] = {WAITING: "RADIOBUT_OFF", BAKING: "RADIOBUT_ON", DONE: "CHECKMARK", REFUSED: "ERROR"}


def _draw_queue(column: bpy.types.UILayout) -> None:
    """Where several objects are baked, each with its state: of many those about the one that is being baked."""
    states = list(queue().items())
    if len(states) < 2:
        return
    done = sum(state in (DONE, REFUSED) for _, state in states)
    first = max(min(done - _LISTED // 2, len(states) - _LISTED), 0)
    column.separator()
    column.label(text=say("{} of {} objects done", done, len(states)), translate=False)
    for ref, state in states[first : first + _LISTED]:
        column.label(text=ref.label, icon=_STATES[state], translate=False)


class OCCLUSION_BAKE_PT_result(_Sidebar, bpy.types.Panel):
    """What came of it, in lines as wide as the sidebar."""

    bl_parent_id = OCCLUSION_BAKE_PT_bake.bl_idname
    bl_label = "Result"

    def draw(self, context: bpy.types.Context) -> None:
        column = layout_of(self).column(align=True)
        column.scale_y = 0.8
        lines = result_in(context).lines or say("None yet")
        for line in lines.split("\n"):
            _draw_wrapped(column, context, line)
        if result_in(context).overlapping:
            layout_of(self).operator(OCCLUSION_BAKE_OT_select_overlap.bl_idname, icon="RESTRICT_SELECT_OFF")


def _draw_wrapped(column: bpy.types.UILayout, context: bpy.types.Context, line: str, icon: Any = "NONE") -> None:
    """A line in as many as the sidebar's width asks for; the icon stands before the first."""
    beside = _OF_ICON if icon != "NONE" else 0
    for part in wrap(line, _letters(context) - beside, subsequent_indent="   "):
        column.label(text=part, icon=icon, translate=False)
        icon = "BLANK1" if icon != "NONE" else icon


def _letters(context: Any) -> int:
    """How many letters of ordinary text a line holds, as the sidebar is wide now."""
    width = context.region.width / context.preferences.system.ui_scale
    return max(int((width - _FRAME) / _LETTER), 16)


class OCCLUSION_BAKE_PT_reflection(_Listed, bpy.types.Panel):
    """Exponents and direction of RO."""

    bl_label = "Reflection"
    options, switch = "reflection", "use_ro"


class OCCLUSION_BAKE_PT_bent(_Listed, bpy.types.Panel):
    """How bent normals are written."""

    bl_label = "Bent Normals"
    options, switch = "bent", "use_bent"


class OCCLUSION_BAKE_PT_code(_Switched, bpy.types.Panel):
    """What reflections are rebuilt from in any view."""

    bl_label = "Directional Code"
    options, switch = "code", "use_code"


class OCCLUSION_BAKE_PT_light(_Switched, bpy.types.Panel):
    """Light of the World."""

    bl_label = "World Light"
    options, switch = "light", "use_light"


class OCCLUSION_BAKE_PT_occluders(_Settings, bpy.types.Panel):
    """Who blocks light, by choice and by name."""

    bl_label = "Occluders"

    def draw(self, context: bpy.types.Context) -> None:
        draw_options(*_begin(self, context), "occluders")
        self._draw_list(context)

    def _draw_list(self, context: bpy.types.Context) -> None:
        column = layout_of(self).column(align=True)
        column.active = False
        found = chosen_occluders(context)
        objects = view_layer_in(context).objects if found is None else found
        names = [obj.name for obj in islice(filter(may_occlude, objects), _LISTED + 1)]
        for name in names[:_LISTED]:
            column.label(text=name, icon="OBJECT_DATA", translate=False)
        if len(names) > _LISTED:
            column.label(text="and more")
        if settings_in(context).occluders in ("SELF", "COLLECTION"):
            column.label(text="Each baked object itself", icon="OBJECT_DATA")


class OCCLUSION_BAKE_PT_highs(_Listed, bpy.types.Panel):
    """What surface is baked."""

    bl_label = "High to Low"
    options = "highs"


class OCCLUSION_BAKE_PT_output(_Settings, bpy.types.Panel):
    """Where the images go."""

    bl_label = "Output"

    def draw(self, context: bpy.types.Context) -> None:
        layout, chosen = _begin(self, context)
        layout.operator_menu_enum(OCCLUSION_BAKE_OT_for_engine.bl_idname, "engine", icon="EXPORT")
        draw_options(layout, chosen, "output")


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
        image: Any = context.edit_image
        layout_of(self).label(text=told(image), icon="OBJECT_DATA", translate=False)
        draw_button(layout_of(self), OCCLUSION_BAKE_OT_again.bl_idname, "FILE_REFRESH")


class OCCLUSION_BAKE_PT_material(_Settings, bpy.types.Panel):
    """The baked images in the objects' materials."""

    bl_label = "Material"

    def draw(self, context: bpy.types.Context) -> None:
        layout, chosen = _begin(self, context)
        draw_options(layout, chosen, "material")
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
        draw_options(layout, chosen, "options")
        layout.operator(OCCLUSION_BAKE_OT_unwrap.bl_idname, icon="UV")
        draw_options(layout, chosen, "options_end")


class OCCLUSION_BAKE_PT_cycles(_Settings, bpy.types.Panel):
    """The comparison."""

    bl_label = "Compare with Cycles"

    def draw(self, context: bpy.types.Context) -> None:
        layout, chosen = _begin(self, context)
        draw_options(layout, chosen, "cycles")
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
