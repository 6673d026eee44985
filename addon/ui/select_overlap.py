"""The faces that overlap in a UV map, selected by Blender's own means."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from ..typed import view_layer_in


def select_overlap(context: bpy.types.Context) -> int:
    """Go into the active mesh's Edit Mode, faces, with those selected that overlap in its active UV map; how many.

    Blender selects in the UV map; with UV and mesh selection in sync, which is left on, the 3D view shows it, too.
    """
    obj: Any = view_layer_in(context).objects.active
    if obj.mode != "EDIT":
        bpy.ops.object.mode_set(mode="EDIT")
    tools: Any = context.tool_settings
    tools.mesh_select_mode = (False, False, True)
    tools.use_uv_select_sync = True
    bpy.ops.mesh.reveal(select=False)
    bpy.ops.mesh.select_all(action="DESELECT")
    bpy.ops.uv.select_overlap()
    obj.update_from_editmode()
    chosen = np.zeros(len(obj.data.polygons), dtype=np.bool_)
    obj.data.polygons.foreach_get("select", chosen)
    return int(np.count_nonzero(chosen))
