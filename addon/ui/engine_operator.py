"""The panel set as an engine takes textures (engine_presets.py)."""

from __future__ import annotations

from typing import Any

import bpy

from ..typed import Ended, props
from .engine_presets import PRESETS, panel_settings
from .properties import settings_in
from .translate import say

_ITEMS = [(each.name, each.label, f"Set maps, files and normals as {each.label} takes them") for each in PRESETS]


class OCCLUSION_BAKE_OT_for_engine(bpy.types.Operator):
    """Set maps, files and the way of normals as an engine takes them; all else stays as it is"""

    bl_idname = "occlusion_bake.for_engine"
    bl_label = "For an Engine"
    bl_options = {"REGISTER", "UNDO"}

    __annotations__ = {
        "engine": props.EnumProperty(name="Engine", items=_ITEMS),
        "packed": props.BoolProperty(
            name="Packed", description="AO goes into the channel of an image that is there, as of an ORM", default=False
        ),
    }

    def execute(self: Any, context: bpy.types.Context) -> Ended:
        preset = next(each for each in PRESETS if each.name == self.engine)
        for name, value in panel_settings(preset, packed=self.packed).items():
            setattr(settings_in(context), name, value)
        self.report({"INFO"}, say("Set for {}", preset.label))
        return {"FINISHED"}


CLASSES = (OCCLUSION_BAKE_OT_for_engine,)
