"""Presets of the panel's settings, in Blender's own menu of presets."""

from __future__ import annotations

import bpy
from bl_operators.presets import AddPresetBase
from bl_ui.utils import PresetPanel

from .properties import plain_names

_FOLDER = "occlusion_bake"  # in Blender's own for presets


class OCCLUSION_BAKE_PT_presets(PresetPanel, bpy.types.Panel):
    """Settings by name."""

    bl_label = "Occlusion Bake Presets"
    preset_subdir = _FOLDER
    preset_operator = "script.execute_preset"
    preset_add_operator = "occlusion_bake.add_preset"


class OCCLUSION_BAKE_OT_add_preset(AddPresetBase, bpy.types.Operator):  # type: ignore[misc] # no answers in the stubs
    """Keep the settings under a name, or remove those of a name"""

    bl_idname = "occlusion_bake.add_preset"
    bl_label = "Add Occlusion Bake Preset"
    preset_menu = OCCLUSION_BAKE_PT_presets.__name__
    preset_defines = ("chosen = bpy.context.scene.occlusion_bake",)
    preset_values = tuple(f"chosen.{name}" for name in plain_names())
    preset_subdir = _FOLDER


CLASSES = (OCCLUSION_BAKE_PT_presets, OCCLUSION_BAKE_OT_add_preset)
