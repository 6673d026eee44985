"""Meshes as they stand flat about a part's origin, in float32: large triangles that pass near by are split.

The corners of a plate that is 10^6 parts wide are rounded by a twentieth of a part, and with them the plate: where it
leans, what stands on it sinks in. So edges are halved until they are no longer than they are far off; then what is
rounded is a share of the distance.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..base.arrays import Doubles, Flags, Floats, Ints, Longs
from ..base.vectors import mapped, weighted
from ..scene.cutout import Cutout
from ..scene.parts import Part
from ..scene.scene import Instance
from ..scene.world_mesh import WorldMesh, mirrors, world_shape, world_surface

_LONGEST = 8.0  # radii of the part: edges up to here are left as they are


@dataclass(frozen=True, eq=False)
class FlatMesh:
    """vertices (V, 3) float32, triangles (T, 3) int32. whole: (T,) int32, which triangle of the mesh each is, or is a
    piece of; None where they are the same. weights: (P, 3, 3) float64, the corners of the last P triangles in weights
    of those of the whole; all others are whole."""

    vertices: Floats
    triangles: Ints
    whole: Ints | None = None
    weights: Doubles | None = None

    def of_corners(self, values: Floats) -> Floats:
        """(T', 3, C) float32 of the mesh's corners → (T, 3, C) of these triangles'."""
        if self.whole is None or self.weights is None:
            return values
        count = len(self.whole) - len(self.weights)
        pieces = weighted(self.weights, values[self.whole[count:], np.newaxis].astype(np.float64))
        return np.concatenate([values[self.whole[:count]], pieces.astype(np.float32)])


def flat_mesh(instance: Instance, part: Part) -> FlatMesh:
    """About the part's origin; outward even under a mirroring matrix."""
    return _flattened(world_shape(instance, part.origin), instance, part, level=False)


def flat_cutout(instance: Instance, flat: FlatMesh) -> Cutout | None:
    """What of an instance's flat mesh is cut out."""
    cutout = instance.cutout
    if cutout is None:
        return None
    uv = cutout.uv[:, [0, 2, 1]] if mirrors(instance) else cutout.uv  # corners have changed places
    alpha = cutout.alpha if flat.whole is None else cutout.alpha[flat.whole]
    return replace(cutout, alpha=alpha, uv=np.ascontiguousarray(flat.of_corners(uv)))


def flat_surface(instance: Instance, part: Part) -> WorldMesh:
    """A surface to take points from, without its UVs."""
    surface = world_surface(instance, part.origin)
    flat = _flattened(surface, instance, part, level=True)
    return WorldMesh(
        flat.vertices,
        flat.triangles,
        normals=None if surface.normals is None else flat.of_corners(surface.normals),
        faces=surface.faces if surface.faces is None or flat.whole is None else surface.faces[flat.whole],
    )


def _flattened(copy: WorldMesh, instance: Instance, part: Part, *, level: bool) -> FlatMesh:
    """Of the instance's world mesh about the part's origin. level: split triangles along two axes, too: they stay in
    their plane however they are rounded, but a point on them is lifted by what they might be."""
    flat = FlatMesh(copy.vertices, copy.triangles)
    if np.abs(copy.vertices).max(initial=0.0) <= _LONGEST * part.radius:
        return flat
    corners = copy.vertices[copy.triangles].astype(np.float64)
    long = (_long_edges(corners, part) > 0.0).any(axis=1)
    if not long.any() or (not level and (np.ptp(corners[long], axis=1) == 0.0).any(axis=1).all()):
        return flat
    exact = mapped(instance.mesh.vertices[copy.triangles[long]].astype(np.float64), instance.matrix[:3, :3])
    return _with_split(flat, long, exact + (instance.matrix[:3, 3] - part.origin), part)


def _with_split(flat: FlatMesh, long: Flags, corners: Doubles, part: Part) -> FlatMesh:
    """With some triangles split, (T,) bool, whose exact corners are (N, 3, 3); all others as they were."""
    weights = np.broadcast_to(np.eye(3), corners.shape)
    pieces, whole = _split(np.concatenate([corners, weights], axis=2), np.flatnonzero(long), part)
    places, weights = pieces[:, :, :3].reshape(-1, 3), pieces[:, :, 3:]
    return FlatMesh(
        np.concatenate([flat.vertices, places.astype(np.float32)]),
        np.concatenate(
            [flat.triangles[~long], len(flat.vertices) + np.arange(len(places), dtype=np.int32).reshape(-1, 3)]
        ),
        np.concatenate([np.flatnonzero(~long), whole]).astype(np.int32),
        weights,
    )


def _split(corners: Doubles, whole: Longs, part: Part) -> tuple[Doubles, Longs]:
    """Triangles, (N, 3, 6) with weights, and which each is, (N,), split until no edge is long.

    It depends on an edge alone whether and where it is halved, so that neighbours stay closed to the bit.
    """
    done: list[tuple[Doubles, Longs]] = []
    while len(corners):
        long = _long_edges(corners[:, :, :3], part)
        ready = ~(long > 0.0).any(axis=1)
        done.append((corners[ready], whole[ready]))
        corners, whole, edge = corners[~ready], whole[~ready], long[~ready].argmax(axis=1)  # the longest: no slivers
        order = (edge[:, np.newaxis] + np.arange(3, dtype=np.int64)) % 3
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
