"""Meshes as they stand flat about a part's origin, in float32: large triangles that pass near by are split.

The corners of a plate that is 10^6 parts wide are rounded by a twentieth of a part, and with them the plate: where it
leans, what stands on it sinks in. So edges are halved until they are no longer than they are far off; then what is
rounded is a share of the distance.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..base.arrays import Doubles, Floats, Ints, Longs
from ..scene.cutout import Cutout
from ..scene.parts import Part
from ..scene.scene import Instance
from ..scene.world_mesh import mirrors, world_mesh

_LONGEST = 8.0  # radii of the part: edges up to here are left as they are


@dataclass(frozen=True, eq=False)
class FlatMesh:
    """vertices (V, 3) float32, triangles (T, 3) int32, and what of them is cut out. whole: (T,) int32, which triangle
    of the mesh each is, or is split from; None where they are the same."""

    vertices: Floats
    triangles: Ints
    cutout: Cutout | None
    whole: Ints | None = None


def flat_mesh(instance: Instance, part: Part) -> FlatMesh:
    """About the part's origin; outward even under a mirroring matrix."""
    copy, cutout = world_mesh(instance, part.origin), instance.cutout
    if cutout is not None and mirrors(instance):  # corners have changed places
        cutout = replace(cutout, uv=np.ascontiguousarray(cutout.uv[:, [0, 2, 1]]))
    flat = FlatMesh(copy.vertices, copy.triangles, cutout)
    if np.abs(copy.vertices).max(initial=0.0) <= _LONGEST * part.radius:
        return flat
    corners = copy.vertices[copy.triangles].astype(np.float64)
    long = (_long_edges(corners, part) > 0.0).any(axis=1)
    if (np.ptp(corners[long], axis=1) == 0.0).any(axis=1).all():
        return flat  # nothing, or level ones, which rounding leaves in their plane
    exact = instance.mesh.vertices[copy.triangles[long]].astype(np.float64) @ instance.matrix[:3, :3].T
    return _with_split(flat, np.flatnonzero(long), exact + (instance.matrix[:3, 3] - part.origin), part)


def _with_split(flat: FlatMesh, those: Longs, corners: Doubles, part: Part) -> FlatMesh:
    """With these triangles split, (N,), whose exact corners are (N, 3, 3); all others as they were."""
    kept = np.ones(len(flat.triangles), dtype=np.bool_)
    kept[those] = False
    uv = np.zeros((len(those), 3, 2)) if flat.cutout is None else flat.cutout.uv[those].astype(np.float64)
    pieces, whole = _split(np.concatenate([corners, uv], axis=2), those, part)
    vertices = np.concatenate([flat.vertices, pieces[:, :, :3].reshape(-1, 3).astype(np.float32)])
    more = len(flat.vertices) + np.arange(3 * len(pieces), dtype=np.int32).reshape(-1, 3)
    triangles = np.concatenate([flat.triangles[kept], more])
    whole = np.concatenate([np.flatnonzero(kept), whole])
    cutout = flat.cutout
    if cutout is not None:
        laid = np.concatenate([cutout.uv[kept], pieces[:, :, 3:].astype(np.float32)])
        cutout = replace(cutout, alpha=cutout.alpha[whole], uv=laid)
    return FlatMesh(vertices, triangles, cutout, whole.astype(np.int32))


def _split(corners: Doubles, whole: Longs, part: Part) -> tuple[Doubles, Longs]:
    """Triangles, (N, 3, 5) with UVs, and which each is, (N,), split until no edge is long.

    It depends on an edge alone whether and where it is halved, so that neighbours stay closed to the bit.
    """
    done: list[tuple[Doubles, Longs]] = []
    while len(corners):
        long = _long_edges(corners[:, :, :3], part)
        ready = ~(long > 0.0).any(axis=1)
        done.append((corners[ready], whole[ready]))
        corners, whole, edge = corners[~ready], whole[~ready], long[~ready].argmax(axis=1)  # the longest: no slivers
        order = (edge[:, np.newaxis] + np.arange(3)) % 3
        a, b, c = np.moveaxis(np.take_along_axis(corners, order[:, :, np.newaxis], axis=1), 1, 0)
        middle = 0.5 * (a + b)
        halves = [np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)]
        corners, whole = np.concatenate(halves), np.concatenate([whole, whole])
    return np.concatenate([each for each, _ in done]), np.concatenate([each for _, each in done])


def _long_edges(corners: Doubles, part: Part) -> Doubles:
    """(N, 3): squared lengths of the edges of (N, 3, 3) corners, each from its corner to the next, that are longer than
    their middles are far from the origin; 0 of the others. The longest edge of a triangle over the origin is one."""
    following = corners[:, [1, 2, 0]]
    lengths = ((following - corners) ** 2).sum(axis=2)
    away = ((0.5 * (following + corners)) ** 2).sum(axis=2)
    long: Doubles = np.where(lengths > np.maximum(away, (_LONGEST * part.radius) ** 2), lengths, 0.0)
    return long
