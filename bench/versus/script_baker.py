"""The bake that a script would do: numpy draws the rays, a binding of Embree answers them, numpy takes the mean."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from ...core.base.arrays import Doubles, Flags, Floats, Ints
from ...core.finish.image_file import write_image
from ...core.rays.texel_surface import TexelSurface
from ...core.scene.scene import Instance
from ...core.scene.world_mesh import centre_of, world_mesh, world_surface
from ...tests.oracles.seen_rays import frames_about
from ..subject import subject_of

CHUNK = 1 << 18  # rays at a time
LIFT = 1e-5  # of the object's diagonal: how far along the normal rays begin, against hits of the own triangle
MOST_TRIANGLES = 8_000_000  # they know no instances here: what is instanced is copied

Occluded = Callable[[Floats, Floats], Flags]  # origins, directions, (N, 3) float32 each → (N,) bool
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

    def occluded(origins: Floats, directions: Floats) -> Flags:
        rays = open3d.core.Tensor(np.concatenate([origins, directions], axis=1))
        answer: Flags = scene.test_occlusions(rays).numpy()
        return answer

    return occluded


def bake_by_script(
    names: Sequence[str], size: int, rays: int, seed: int, query: Open, threads: int | None
) -> tuple[float, Floats, Flags]:
    """Bake AO of objects of the open file into PNGs that are thrown away. Returns seconds, and values and coverage,
    (N * size, size), one object below the other. threads: None for as many as there are processors."""
    with TemporaryDirectory() as folder:
        start = time.perf_counter()
        subject = subject_of(names, size)
        targets, covered = subject.scene.targets, subject.covered
        origin = np.mean([centre_of(target) for target in targets], axis=0)
        occluded = query(*_flat(subject.scene.occluders, origin))
        values = np.zeros(covered.shape, dtype=np.float32)
        with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
            for number, target in enumerate(targets):
                there = slice(number * size, (number + 1) * size)
                points = _points(target, origin, subject.owner[there])
                values[there][covered[there]] = _visibility(*points, rays, seed, occluded, pool)
                write_image(Path(folder) / f"ao {number}.png", values[there], depth=16)
        return time.perf_counter() - start, values, covered


def _points(target: Instance, origin: Doubles, owner: Ints) -> tuple[Floats, Floats]:
    """The middles of a target's covered texels, lifted, and their normals."""
    mesh = world_surface(target, origin)
    texels = TexelSurface(mesh, owner)
    covered = owner >= 0
    normals = texels.normals[covered]
    lift = np.float32(LIFT * float(np.linalg.norm(np.ptp(mesh.vertices, axis=0))))
    return texels.positions[covered] + lift * normals, normals


def _flat(occluders: Iterable[Instance], origin: Doubles) -> tuple[Floats, Ints]:
    """All that occludes as one mesh, about the origin."""
    copies = [world_mesh(instance, origin) for instance in occluders]
    before = np.cumsum([0, *(len(copy.vertices) for copy in copies)])
    triangles = [copy.triangles + np.int32(first) for copy, first in zip(copies, before, strict=False)]
    return np.concatenate([copy.vertices for copy in copies]), np.concatenate(triangles)


def _visibility(
    points: Floats, normals: Floats, rays: int, seed: int, occluded: Occluded, pool: ThreadPoolExecutor
) -> Doubles:
    """The share of each point's rays that get out, (N,), a chunk a thread."""
    step = max(CHUNK // rays, 1)
    answer = np.empty(len(points))

    def chunk(first: int) -> None:
        there = slice(first, first + step)
        directions = cosine_directions(normals[there], rays, np.random.default_rng((seed, first)))
        hit = occluded(np.repeat(points[there], rays, axis=0), directions)
        answer[there] = 1.0 - hit.reshape(-1, rays).mean(axis=1)

    list(pool.map(chunk, range(0, len(points), step)))
    return answer


def cosine_directions(normals: Floats, rays: int, rng: np.random.Generator) -> Floats:
    """(N · rays, 3) float32 directions about (N, 3) unit normals, by the cosine: independent, without strata."""
    count = len(normals) * rays
    turn = rng.random(count, dtype=np.float32) * np.float32(2.0 * np.pi)
    square = rng.random(count, dtype=np.float32)
    radius = np.sqrt(square)
    frames = frames_about(normals).astype(np.float32)
    first, second = (np.repeat(frames[:, axis], rays, axis=0) for axis in (0, 1))
    out = np.sqrt(1.0 - square)[:, None] * np.repeat(normals, rays, axis=0)
    out += (radius * np.cos(turn))[:, None] * first
    out += (radius * np.sin(turn))[:, None] * second
    return np.ascontiguousarray(out, dtype=np.float32)
