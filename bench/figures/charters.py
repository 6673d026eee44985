"""Who makes charts: ours, Blender's Smart UV Project, and xatlas at its defaults, in a process that it may crash."""

from __future__ import annotations

import hashlib
import subprocess
import sys
import time
from dataclasses import dataclass
from importlib.metadata import version
from math import radians
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...addon.cli.hard_exit import leave
from ...addon.materials.mesh_layers import values_of
from ...addon.read.mesh_arrays import corners_of
from ...addon.typed import mesh_of
from ...core.base.arrays import Floats
from ...core.charts.unwrap import unwrap
from ...tests.oracles.blender import select
from ...tests.oracles.charts.polygon_mesh import PolygonMesh
from ..pages import ROOT

SIZE, PADDING = 1024, 4  # texels
_ANGLE = radians(66.0)  # of Smart UV Project: faces that turn more part
LIMIT = 600.0  # seconds that xatlas may take
ACROSS = 100.0  # units that xatlas is given a mesh in: with smaller ones it cuts smaller
_KEPT = ROOT / "build" / "figures" / "xatlas"


@dataclass(frozen=True, eq=False)
class Layout:
    """uv: (T, 3, 2), for an image of `size` texels."""

    uv: Floats
    size: tuple[int, int]
    seconds: float


def by_us(mesh: PolygonMesh) -> Layout:
    """The product's."""
    start = time.perf_counter()
    charts = unwrap("mesh", *mesh, size=SIZE, padding=PADDING)
    return Layout(charts.uv, (SIZE, SIZE), time.perf_counter() - start)


def by_smart_project(obj: bpy.types.Object) -> Layout:
    """Blender's, at its default angle, with as much between islands; the object keeps no UV map of it."""
    mesh = mesh_of(obj)
    layer = mesh.uv_layers.new(name="Smart")
    layer.active = True
    select(obj)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    start = time.perf_counter()
    bpy.ops.uv.smart_project(angle_limit=_ANGLE, island_margin=PADDING / SIZE, margin_method="FRACTION")
    seconds = time.perf_counter() - start
    bpy.ops.object.mode_set(mode="OBJECT")
    layer = mesh.uv_layers["Smart"]
    uv = values_of(layer.uv, "vector", len(mesh.loops), 2)[corners_of(mesh)]
    mesh.uv_layers.remove(layer)
    return Layout(uv, (SIZE, SIZE), seconds)


def by_xatlas(mesh: PolygonMesh) -> Layout | str:
    """xatlas at its defaults, or why it gave none. It gives the same again and may take minutes, so that what it gave
    is kept."""
    asked = f"{SIZE} {PADDING} {ACROSS} {LIMIT} {version('xatlas')}".encode()
    digest = hashlib.blake2b(mesh.vertices.tobytes() + mesh.triangles.tobytes() + asked, digest_size=8).hexdigest()
    given, made, why = (_KEPT / f"{digest}{suffix}" for suffix in (".in.npz", ".npz", ".txt"))
    _KEPT.mkdir(parents=True, exist_ok=True)
    if not made.exists() and not why.exists():
        np.savez(given, vertices=mesh.vertices, triangles=mesh.triangles)
        if fault := _ask(given, made):
            why.write_text(fault, encoding="utf-8")
        given.unlink()
    if why.exists():
        return why.read_text(encoding="utf-8")
    with np.load(made) as found:
        return Layout(found["uv"], tuple(found["size"].tolist()), float(found["seconds"]))


def _ask(given: Path, made: Path) -> str:
    """Run xatlas in a process of its own; why that gave nothing."""
    command = [sys.executable, "-m", __name__, str(given), str(made)]
    try:
        status = subprocess.run(command, timeout=LIMIT, check=False).returncode
    except subprocess.TimeoutExpired:
        return f"no end in {LIMIT:.0f} s"
    return "" if status == 0 else "crashed"


def _main(given: Path, made: Path) -> None:
    """That process: chart the mesh of one file into another."""
    import xatlas  # not in all environments

    with np.load(given) as mesh:
        vertices, triangles = mesh["vertices"], mesh["triangles"]
    points = vertices * (ACROSS / float(np.ptp(vertices[triangles].reshape(-1, 3), axis=0).max()))
    start = time.perf_counter()
    atlas: Any = xatlas.Atlas()
    atlas.add_mesh(points.astype(np.float32), triangles.astype(np.uint32))
    packing = xatlas.PackOptions()
    packing.resolution, packing.padding = SIZE, PADDING
    atlas.generate(xatlas.ChartOptions(), packing, False)
    seconds = time.perf_counter() - start
    _, indices, uv = atlas[0]
    np.savez(made, uv=uv[indices].astype(np.float32), size=(atlas.width, atlas.height), seconds=seconds)


if __name__ == "__main__":
    _main(Path(sys.argv[1]), Path(sys.argv[2]))
    leave(0)
