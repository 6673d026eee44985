"""What is baked to be compared: the sample scenes, and models that stand on a ground plane."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

from ...addon.cli.import_file import load
from ...samples.scenes import SCENES, build

MODELS = {"bunny": "stanford-bunny.obj", "rocker arm": "rocker-arm.obj", "spot": "spot.obj"}
SUBJECTS = (*SCENES, *MODELS)

_GAP = 1e-3  # of the model's height, between it and the ground: faces that coincide are a question of their own
_GROUND = 8.0  # the ground's sides, in diagonals of the model


def open_subject(name: str, models: Path) -> str | None:
    """Open one. Returns the name of the object to bake; None, and a line, where a model is not in its folder."""
    if name in SCENES:
        return build(name).targets[0]
    path = models / MODELS[name]
    if not path.is_file():
        print(f"SKIPPED {name}: no {MODELS[name]} in {models}", flush=True)
        return None
    load(path)
    model = next(each for each in bpy.data.objects if each.type == "MESH")
    model.name = name
    _stand(bpy.context.scene, model)
    return str(model.name)


def _stand(scene: bpy.types.Scene, model: bpy.types.Object) -> None:
    """Put a ground plane under the model and a camera before it."""
    bpy.context.view_layer.update()
    corners = np.array([model.matrix_world @ Vector(corner) for corner in model.bound_box])
    low, high = corners.min(axis=0), corners.max(axis=0)
    middle, size = (low + high) / 2, float(np.linalg.norm(high - low))
    ground = bpy.data.meshes.new("Ground")
    square = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]) * 0.5 * _GROUND * size
    square += (middle[0], middle[1], low[2] - _GAP * (high[2] - low[2]))
    ground.from_pydata(square.tolist(), [], [(0, 1, 2, 3)])
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = middle + size * np.array([0.6, -1.5, 0.7])
    camera.rotation_euler = (Vector(middle) - camera.location).to_track_quat("-Z", "Y").to_euler()
    for thing in (bpy.data.objects.new("Ground", ground), camera):
        scene.collection.objects.link(thing)
    scene.camera = camera
    bpy.context.view_layer.update()
