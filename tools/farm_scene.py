"""Runs inside Blender, or Blender as a module, for try_farm.py: `-- FILE`, a scene to share out.

A row of heads that shade one another, some without UVs, and a wall of two UDIM tiles behind them.
"""

from __future__ import annotations

import os
import sys
from typing import Any

import bpy

HEADS, BARE = 18, 6  # every so manieth has no UVs


def heads() -> None:
    for number in range(HEADS):
        bpy.ops.mesh.primitive_monkey_add(location=(2.2 * (number % 6), 2.5 * (number // 6), 1.0))
        head: Any = bpy.context.object
        head.name, head.rotation_euler.z = f"Head {number}", 0.7 * number
        if number % BARE == 0:
            head.data.uv_layers.remove(head.data.uv_layers[0])


def wall() -> None:
    """Its UVs reach over two tiles."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=8, y_subdivisions=4, size=14.0, location=(5.5, 8.0, 1.0))
    made: Any = bpy.context.object
    made.name, made.rotation_euler.x = "Wall", 1.5707963
    for corner in made.data.uv_layers.active.data:
        corner.uv.x *= 2.0


bpy.ops.wm.read_factory_settings(use_empty=True)
heads()
wall()
bpy.ops.wm.save_as_mainfile(filepath=sys.argv[-1])
sys.stdout.flush()
os._exit(0)  # Blender as a module now and then hangs in its destructors
