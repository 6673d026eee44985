"""Meshes as they are instanced: in pieces that are compact, each a tree about its own middle, made when first needed.

A piece is stored once, however many instances and targets there are. A ray is turned into the piece's own space in
float32, so a small piece is exact where a whole landscape about its middle would not be.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..base.arrays import Doubles, Flags, Floats, Ints, Longs
from ..base.kernel_api import Control
from ..scene.cutout import Cutout
from ..scene.scene import Mesh
from .embree import Device
from .trace_scene import Geometry, RayFilter

LARGEST = 1 << 13  # triangles of a piece


@dataclass(eq=False)
class Piece:
    """Some of a mesh's triangles. mesh: these alone; cutout: what of them is cut out."""

    mesh: Mesh
    cutout: Cutout | None

    @cached_property
    def middle(self) -> Doubles:
        """(3,) float64: of the piece's box, in object space."""
        middle: Doubles = np.mean(self.mesh.box, axis=0)
        return middle

    @cached_property
    def half(self) -> Doubles:
        """(3,) float64: half the sides of its box."""
        low, high = self.mesh.box
        return 0.5 * (high - low)

    def geometry(self, device: Device, front_only: bool, control: Control | None) -> Geometry:
        """Its tree, about its middle. Raises Cancelled, MemoryError."""
        if self._geometry is None:
            vertices: Floats = (self.mesh.vertices - self.middle).astype(np.float32)
            ray_filter = RayFilter(self.cutout, front_only)
            self._geometry = Geometry(device, vertices, self.mesh.triangles, control, ray_filter)
        return self._geometry

    _geometry: Geometry | None = None


def pieces_of(mesh: Mesh, cutout: Cutout | None) -> list[Piece]:
    """The mesh cut up; itself where it is small."""
    if len(mesh.triangles) <= LARGEST:
        return [Piece(mesh, cutout)]
    return [_piece(mesh, cutout, which) for which in _cut(mesh)]


def _cut(mesh: Mesh) -> Iterator[Longs]:
    """Which triangles each piece has: halves of halves, across the longest side of what their middles take up."""
    middles = np.ascontiguousarray(mesh.vertices[mesh.triangles].mean(axis=1).T)  # a row an axis
    waiting = [np.arange(len(mesh.triangles), dtype=np.int64)]
    while waiting:
        here = waiting.pop()
        if len(here) <= LARGEST:
            yield here
            continue
        places = np.take(middles, here, axis=1)
        longest = int(np.argmax(np.ptp(places, axis=1)))
        below = _lower_half(places[longest])
        waiting += [here[below], here[~below]]


def _lower_half(places: Floats) -> Flags:
    """(N,) bool: of those in the very middle the first ones, for each processor's partition leaves another order."""
    half = len(places) // 2
    middle = np.partition(places, half)[half]
    below: Flags = places < middle
    below[np.flatnonzero(places == middle)[: half - np.count_nonzero(below)]] = True
    return below


def _piece(mesh: Mesh, cutout: Cutout | None, which: Longs) -> Piece:
    used, triangles = np.unique(mesh.triangles[which], return_inverse=True)
    corners: Ints = triangles.reshape(-1, 3).astype(np.int32)
    part = Mesh(mesh.name, mesh.vertices[used], corners)
    return Piece(part, cutout and replace(cutout, alpha=cutout.alpha[which], uv=cutout.uv[which]))
