"""Suzanne at rest on a floor: the plain case, and the one to measure with."""

from __future__ import annotations

from typing import Any

import bmesh
import bpy

from . import shapes, stage


def build(scene: bpy.types.Scene) -> stage.Sample:
    """Fill an empty scene."""
    mesh = bpy.data.meshes.new("Suzanne")
    with shapes.drawn(mesh) as draft:
        draft.loops.layers.uv.new("UVMap")
        bmesh.ops.create_monkey(draft, calc_uvs=True)
        for face in draft.faces:
            face.smooth = True
    # Tilted until jaw and back of the head carry her, and a millimetre clear of the floor.
    head = stage.add(
        scene, "Suzanne", mesh, stage.material("Clay", (0.75, 0.25, 0.12)), at=(0, 0, 0.496), turn=(-36, 0, 22)
    )
    subdivision: Any = head.modifiers.new("Subdivision", "SUBSURF")
    subdivision.levels, subdivision.render_levels = 1, 3
    stage.add(scene, "Floor", shapes.plane("Floor", 9.0, 9.0), stage.material("Plaster", (0.8, 0.77, 0.72)))
    stage.light(scene, sun=(-2.0, -1.5, 3.0))
    stage.view(scene, position=(0.5, -5.0, 4.4), towards=(0.05, -0.15, 0.4))
    return stage.Sample("suzanne", "Suzanne, subdivided and smooth, resting on a floor.", ("Suzanne", "Floor"))
