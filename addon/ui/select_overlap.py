"""The faces that overlap in a UV map, selected by Blender's own means."""

from __future__ import annotations

import bpy
import numpy as np


def select_overlap(context: bpy.types.Context) -> int:
    """Go into the active mesh's Edit Mode, faces, with those selected that overlap in its active UV map; how many.

    Blender selects in the UV map; with UV and mesh selection in sync, which is left on, the 3D view shows it, too.
    """
    obj = context.view_layer.objects.active
    if obj.mode != "EDIT":
        bpy.ops.object.mode_set(mode="EDIT")
    context.tool_settings.mesh_select_mode = (False, False, True)
    context.tool_settings.use_uv_select_sync = True
    bpy.ops.mesh.reveal(select=False)
    bpy.ops.mesh.select_all(action="DESELECT")
    bpy.ops.uv.select_overlap()
    obj.update_from_editmode()
    chosen = np.zeros(len(obj.data.polygons), dtype=bool)
    obj.data.polygons.foreach_get("select", chosen)
    return int(np.count_nonzero(chosen))
