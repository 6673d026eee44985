"""Charts of very many pieces, and of very many triangles: how long they take, and how much memory."""

from __future__ import annotations

import resource
import time
from pathlib import Path
from typing import Any

import numpy as np

from ...core.charts.unwrap import unwrap
from ...samples.bench_scenes import MODELS
from ...tests.oracles.charts.polygon_mesh import PolygonMesh
from .chart_meshes import mesh_named
from .charters import PADDING, SIZE

# By what `mesh_named` knows them; FINER: each triangle in four.
CROWDS = {
    "20,000 quads": "quads:20000",
    "20,000 triangles": "triangles:20000",
    "20,000 leaves of 16 triangles": "leaves:20000",
    "20,000 faces of voxels": "voxels:13500",
    "200,000 quads": "quads:200000",
    "a terrain": "terrain:1024",
    "igea, each triangle in four": "igea",
}
FINER = ("igea",)


def crowd_names(models: Path) -> list[str]:
    """Of CROWDS, without models whose files are not there."""
    return [name for name, mesh in CROWDS.items() if mesh not in MODELS or (models / MODELS[mesh]).is_file()]


def crowd(name: str, models: str) -> dict[str, Any]:
    """One of CROWDS, in a process of its own: triangles, seconds, gigabytes at the peak of the process, charts."""
    mesh = mesh_named(CROWDS[name], Path(models))
    if CROWDS[name] in FINER:
        mesh = _finer(mesh)
    start = time.perf_counter()
    charts = unwrap(name, *mesh, size=SIZE, padding=PADDING)
    seconds = time.perf_counter() - start
    return {
        "triangles": len(mesh.triangles),
        "seconds": seconds,
        "gigabytes": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6,
        "charts": charts.count,
        "used": charts.utilisation,
        "padding": charts.padding,
    }


def _finer(mesh: PolygonMesh) -> PolygonMesh:
    """Each triangle cut into four at the middles of its edges."""
    triangles, count = mesh.triangles.astype(np.int64), len(mesh.vertices)
    ends = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2), axis=2)
    edges, number = np.unique(ends[..., 0] * count + ends[..., 1], return_inverse=True)
    middles = 0.5 * (mesh.vertices[edges // count] + mesh.vertices[edges % count])
    a, b, c = triangles.T
    ab, bc, ca = count + number.reshape(-1, 3).T
    parts = [np.stack(part, axis=1) for part in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
    finer = np.concatenate(parts).astype(np.int32)
    vertices = np.concatenate([mesh.vertices, middles]).astype(np.float32)
    return PolygonMesh(vertices, finer, np.arange(len(finer), dtype=np.int32))
