"""Bent normals: the mean direction in which a texel is open, as a texture.

The mean of V times the direction over the cosine lobe, ∫ V ω max(n·ω, 0)/π dω at unit length (Landis, "Production-ready
global illumination", SIGGRAPH 2002 course 16): from the rays of AO, within its distance. A texel that is closed
altogether gets its normal.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from ..base.arrays import Doubles, Flags, Floats, Longs
from ..base.singular_values import pseudo_inverse_transposed
from ..base.vectors import determinant, mapped, transformed_normals, unit
from ..finish.baked import BakedMap, Metadata
from ..finish.map_finisher import MapFinisher
from ..rays.accumulators import bent_vectors
from ..rays.map_spec import bent
from ..solve.solver import Solved
from ..texels.rasterize import in_bands
from ..texels.tangent_space import TexelFrames, in_frames, to_object
from .map import Map

_BAND = 1 << 18  # texels that are worked on at a time


class Space(Enum):
    """What a bent normal is told by."""

    TANGENT = "tangent"  # MikkTSpace of the UV map
    OBJECT = "object"
    WORLD = "world"


@dataclass(frozen=True)
class BentNormalMap(Map):
    """space: what directions are told by. y_down: green is turned about, as in DirectX. with_ao: AO is in alpha."""

    space: Space = Space.TANGENT
    y_down: bool = False
    with_ao: bool = False

    spec = bent()

    @property
    def name(self) -> str:
        return "bent"

    @property
    def needs_tangents(self) -> bool:
        return self.space is Space.TANGENT

    def description(self) -> Metadata:
        return {"map": "bent normal", "space": self.space.value, "green": "down" if self.y_down else "up"}

    def finish(self, solved: Solved, finisher: MapFinisher) -> BakedMap:
        assert solved.more is not None and solved.more_error is not None
        colours = encoded(bent_vectors(solved.more), self, finisher.frames, solved.covered)
        values = np.dstack([colours, solved.values]) if self.with_ao else colours
        return finisher.finished(self, values, solved.covered, solved.more_error, solved.rays)


def encoded(vectors: Floats, written: BentNormalMap, frames: TexelFrames, covered: Flags) -> Floats:
    """Colours, (H, W, 3) float32, 0 to 1: (b + 1) / 2, as of normal maps; 0.5, 0.5, 1 where nothing is covered.

    vectors: (3, H, W) float32, of any length, in world space. covered: (H, W) bool. Raises InputError for tangent space
    without tangents.
    """
    colours = np.empty((*covered.shape, 3), dtype=np.float32)
    colours[:] = 0.5, 0.5, 1.0
    flat = colours.reshape(-1, 3)
    for texels in in_bands(np.flatnonzero(covered), _BAND):
        world = vectors.reshape(3, -1)[:, texels].T.astype(np.float64)
        local = _in_space(world, written.space, frames, texels)
        if written.y_down:
            local[:, 1] = -local[:, 1]
        flat[texels] = 0.5 * local + 0.5
    return colours


def _in_space(world: Doubles, space: Space, frames: TexelFrames, texels: Longs) -> Doubles:
    matrix, normals = frames.target.matrix, unit(frames.normals(texels))
    if space is Space.WORLD:
        return _or(unit(world), _world_normals(normals, matrix[:3, :3]))
    local = _or(to_object(world, matrix), normals)
    if space is Space.OBJECT:
        return local
    return _or(in_frames(local, frames.frames(texels)), np.array([[0.0, 0.0, 1.0]]))


def _world_normals(normals: Doubles, linear: Doubles) -> Doubles:
    """Object-space normals in world space; of a mesh that is flattened there as near to it as can be."""
    if determinant(linear) == 0.0:
        return unit(mapped(normals, pseudo_inverse_transposed(linear)))
    return transformed_normals(normals, linear)


def _or(directions: Doubles, instead: Doubles) -> Doubles:
    """Where a direction is zero, the other."""
    return np.where(np.any(directions != 0.0, axis=1, keepdims=True), directions, instead)
