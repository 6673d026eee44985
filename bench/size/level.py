"""A level of many small objects, each of a mesh of its own, and our command on it in processes of its own."""

from __future__ import annotations

import json
import math
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.random import default_rng

from ...addon.typed import mesh_of, scene_in
from ...core.base.arrays import Doubles
from ...samples.bench_scenes import empty_scene
from ..sweep import peak_memory

STEP = 2.0  # metres from one object to the next
_PRIMITIVES = ("cube", "cylinder", "cone", "uv_sphere", "torus")
_COARSE: dict[str, dict[str, int]] = {
    "cylinder": {"vertices": 16},
    "cone": {"vertices": 16},
    "uv_sphere": {"segments": 12, "ring_count": 8},
    "torus": {"major_segments": 16, "minor_segments": 8},
}


def build(file: str, count: int) -> None:
    """Objects of some metre, in a square, with UVs, and save them."""
    scene, rng = empty_scene(), default_rng(1)
    shapes = [_shape(name) for name in _PRIMITIVES]
    side = math.isqrt(count - 1) + 1
    for number in range(count):
        mesh = shapes[number % len(shapes)].copy()
        mesh.vertices.foreach_set("co", _jittered(mesh, rng).ravel())
        mesh.update()
        made = bpy.data.objects.new(f"Prop {number}", mesh)
        made.location = STEP * (number % side), STEP * (number // side), 0.0
        made.rotation_euler = rng.uniform(0.0, 2.0 * np.pi, 3).tolist()
        scene.collection.objects.link(made)
    bpy.ops.wm.save_as_mainfile(filepath=file)


def move_some(file: str, target: str, count: int) -> None:
    """Turn so many objects, spread over the level, and save the file as another."""
    bpy.ops.wm.open_mainfile(filepath=file)
    objects = list(scene_in(bpy.context).objects)
    for place in default_rng(2).choice(len(objects), count, replace=False):
        objects[int(place)].rotation_euler[2] += 0.5
    bpy.ops.wm.save_as_mainfile(filepath=target)


def _shape(name: str) -> bpy.types.Mesh:
    getattr(bpy.ops.mesh, f"primitive_{name}_add")(**_COARSE.get(name, {}))
    made: Any = bpy.context.object
    mesh = mesh_of(made)
    bpy.data.objects.remove(made)
    return mesh


def _jittered(mesh: bpy.types.Mesh, rng: np.random.Generator) -> Doubles:
    """Its vertices, within half a metre or so, no two meshes alike."""
    flat = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", flat)
    points = flat.reshape(-1, 3).astype(np.float64)
    reach = np.abs(points).max()
    jittered: Doubles = points * (0.5 / reach) * rng.uniform(0.7, 1.3, 3) + rng.normal(0.0, 0.01, points.shape)
    return jittered


@dataclass(frozen=True)
class Ran:
    """seconds: on the clock. peak: memory, GB."""

    seconds: float
    peak: float


def command(*words: object) -> Ran:
    """Run ours in a process of its own. Raises CalledProcessError where it fails."""
    start, peak = time.perf_counter(), 0.0
    called = [sys.executable, "-m", __package__.partition(".")[0], *map(str, words)]
    with subprocess.Popen(called, stdout=subprocess.DEVNULL) as process:
        while process.poll() is None:
            peak = max(peak, peak_memory(process.pid))
            time.sleep(0.02)
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, called)
    return Ran(time.perf_counter() - start, peak)


def manifest_of(folder: Path) -> Any:
    return json.loads((folder / "manifest.json").read_text(encoding="utf-8"))


def size_of(folder: Path) -> int:
    """Bytes of all files in a folder."""
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
