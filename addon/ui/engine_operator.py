"""The panel set as an engine takes textures (engine_presets.py)."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, EnumProperty

from .engine_presets import EXPORTS, panel_settings
from .translate import say

_ITEMS = [(each.name, each.label, f"Set maps, files and normals as {each.label} takes them") for each in EXPORTS]


class OCCLUSION_BAKE_OT_for_engine(bpy.types.Operator):
    """Set maps, files and the way of normals as an engine takes them; all else stays as it is"""

    bl_idname = "occlusion_bake.for_engine"
    bl_label = "For an Engine"
    bl_options = {"REGISTER", "UNDO"}

    engine: EnumProperty(name="Engine", items=_ITEMS)  # type: ignore[valid-type]
    packed: BoolProperty(  # type: ignore[valid-type]
        name="Packed", description="AO goes into the channel of an image that is there, as of an ORM", default=False
    )

    def execute(self, context: bpy.types.Context) -> set[str]:
        export = next(each for each in EXPORTS if each.name == self.engine)
        for name, value in panel_settings(export, packed=self.packed).items():
            setattr(context.scene.occlusion_bake, name, value)
        self.report({"INFO"}, say("Set for {}", export.label))
        return {"FINISHED"}


CLASSES = (OCCLUSION_BAKE_OT_for_engine,)
