"""The bake that a script would do: numpy draws the rays, a binding of Embree answers them, numpy takes the mean."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...addon.read.scene_reader import SceneRequest, read_scene
from ...core.base.arrays import Floats, Ints
from ...core.finish.image_file import write_image
from ...core.rays.texel_surface import TexelSurface
from ...core.scene.checks import zero_area
from ...core.scene.scene import Instance
from ...core.scene.world_mesh import centre_of, world_mesh, world_surface
from ...core.texels.rasterize import rasterize

CHUNK = 1 << 18  # rays at a time
LIFT = 1e-5  # of the object's diagonal: how far along the normal rays begin, against hits of the own triangle
MOST_TRIANGLES = 8_000_000  # they know no instances here: what is instanced is copied

Occluded = Callable[[Floats, Floats], NDArray[np.bool_]]  # origins, directions, (N, 3) float32 each → (N,) bool
Open = Callable[[Floats, Ints], Occluded]  # vertices, triangles → the query


def embreex_query(vertices: Floats, triangles: Ints) -> Occluded:
    """Embree by the embreex package."""
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    scene: Any = EmbreeScene()
    TriangleMesh(scene, vertices, triangles)
    nothing = np.zeros((1, 3), dtype=np.float32)
    scene.run(nothing, nothing + 1.0, query="OCCLUDED")  # the first query builds the tree, before threads ask at once
    return lambda origins, directions: scene.run(origins, directions, query="OCCLUDED") >= 0


def open3d_query(vertices: Floats, triangles: Ints) -> Occluded:
    """Embree by Open3D, which spreads a query over all threads itself."""
    import open3d

    scene = open3d.t.geometry.RaycastingScene()
    scene.add_triangles(open3d.core.Tensor(vertices), open3d.core.Tensor(triangles.astype(np.uint32)))

    def occluded(origins: Floats, directions: Floats) -> NDArray[np.bool_]:
        rays = open3d.core.Tensor(np.concatenate([origins, directions], axis=1))
        answer: NDArray[np.bool_] = scene.test_occlusions(rays).numpy()
        return answer

    return occluded


def bake_naive(
    name: str, size: int, rays: int, seed: int, path: Path, query: Open, threads: int
) -> tuple[float, Floats, NDArray[np.bool_]]:
    """AO of an object of the open file, from its scene to a PNG of 16 bits.

    threads: that draw rays and ask the query, a chunk each. Returns seconds, values and coverage, (H, W) each.
    """
    start = time.perf_counter()
    scene, _ = read_scene(bpy.context, bpy.context.view_layer, SceneRequest([name]))
    target = scene.targets[0]
    assert target.mesh.uv is not None
    owner = rasterize(name, target.mesh.uv, size, size, skip=zero_area(target.mesh)).owner
    covered = owner >= 0
    origin = centre_of(target)
    surface = world_surface(target, origin)
    texels = TexelSurface(surface, owner)
    positions, normals = (each[covered] for each in (texels.positions, texels.normals))
    diagonal = float(np.linalg.norm(np.ptp(surface.vertices, axis=0)))
    positions = positions + np.float32(LIFT * diagonal) * normals
    occluded = query(*_flat(scene.occluders, origin))
    values = np.zeros(owner.shape, dtype=np.float32)
    values[covered] = _visibility(positions, normals, rays, seed, occluded, threads)
    write_image(path, values, depth=16)
    return time.perf_counter() - start, values, covered


def _flat(occluders: Any, origin: NDArray[np.float64]) -> tuple[Floats, Ints]:
    """All that occludes as one mesh, about the origin."""
    vertices: list[Floats] = []
    triangles: list[Ints] = []
    before = 0
    instance: Instance
    for instance in occluders:
        copy = world_mesh(instance, origin)
        vertices.append(copy.vertices)
        triangles.append(copy.triangles + np.int32(before))
        before += len(copy.vertices)
    return np.concatenate(vertices), np.concatenate(triangles)


def _visibility(
    positions: Floats, normals: Floats, rays: int, seed: int, occluded: Occluded, threads: int
) -> NDArray[np.float64]:
    """The share of each point's rays that get out, (N,)."""
    step = max(CHUNK // rays, 1)
    answer = np.empty(len(positions))

    def chunk(first: int) -> None:
        there = slice(first, min(first + step, len(positions)))
        directions = cosine_directions(normals[there], rays, np.random.default_rng((seed, first)))
        hit = occluded(np.repeat(positions[there], rays, axis=0), directions)
        answer[there] = 1.0 - hit.reshape(-1, rays).mean(axis=1)

    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(chunk, range(0, len(positions), step)))
    return answer


def cosine_directions(normals: Floats, rays: int, rng: np.random.Generator) -> Floats:
    """(N · rays, 3) float32 directions about (N, 3) unit normals, by the cosine: independent, without strata."""
    count = len(normals) * rays
    turn = rng.random(count, dtype=np.float32) * np.float32(2.0 * np.pi)
    square = rng.random(count, dtype=np.float32)
    radius = np.sqrt(square)
    first, second = (np.repeat(axis, rays, axis=0) for axis in _tangents(normals))
    out = np.sqrt(1.0 - square)[:, None] * np.repeat(normals, rays, axis=0)
    out += (radius * np.cos(turn))[:, None] * first
    out += (radius * np.sin(turn))[:, None] * second
    return np.ascontiguousarray(out, dtype=np.float32)


def _tangents(normals: Floats) -> tuple[Floats, Floats]:
    """Two unit vectors square to each unit normal and to each other (Duff et al. 2017)."""
    x, y, z = normals.T
    sign = np.copysign(np.float32(1.0), z)
    a = -1.0 / (sign + z)
    b = x * y * a
    first = np.stack([1.0 + sign * x * x * a, sign * b, -sign * x], axis=1)
    return first, np.stack([b, sign + y * y * a, -y], axis=1)


def threads_of(binding: str) -> int:
    """How many threads of ours serve a binding: Open3D has its own."""
    return 1 if binding == "open3d" else os.cpu_count() or 1
