"""Bent normals: the mean direction in which a texel is open, as a texture.

The mean of V times the direction over the cosine lobe, ∫ V ω max(n·ω, 0)/π dω at unit length (Landis, "Production-ready
global illumination", SIGGRAPH 2002 course 16): from the rays of AO, within its distance. A texel that is closed
altogether gets its normal.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from ..scene.scene import Doubles, Floats, unit
from ..texels.rasterize import in_bands
from ..texels.tangent_space import Texture, in_frames, to_object

_BAND = 1 << 18  # texels that are worked on at a time


class Space(Enum):
    """What a bent normal is told by."""

    TANGENT = "tangent"  # MikkTSpace of the UV map
    OBJECT = "object"
    WORLD = "world"


@dataclass(frozen=True)
class Bent:
    """How bent normals are written. y_down: green is turned about, as in DirectX. with_ao: AO is in alpha."""

    space: Space = Space.TANGENT
    y_down: bool = False
    with_ao: bool = False


def encoded(vectors: Floats, bent: Bent, texture: Texture, covered: NDArray[np.bool_]) -> Floats:
    """Colours, (H, W, 3) float32, 0 to 1: (b + 1) / 2, as of normal maps; 0.5, 0.5, 1 where nothing is covered.

    vectors: (3, H, W) float32, of any length, in world space. covered: (H, W) bool. Raises InputError for tangent space
    without tangents.
    """
    colours = np.empty((*covered.shape, 3), dtype=np.float32)
    colours[:] = 0.5, 0.5, 1.0
    flat = colours.reshape(-1, 3)
    for texels in in_bands(np.flatnonzero(covered), _BAND):
        world = vectors.reshape(3, -1)[:, texels].T.astype(np.float64)
        local = _in_space(world, bent.space, texture, texels)
        if bent.y_down:
            local[:, 1] = -local[:, 1]
        flat[texels] = 0.5 * local + 0.5
    return colours


def _in_space(world: Doubles, space: Space, texture: Texture, texels: NDArray[np.int64]) -> Doubles:
    matrix, normals = texture.target.matrix, unit(texture.normals(texels))
    if space is Space.WORLD:
        return _or(unit(world), unit(normals @ np.linalg.pinv(matrix[:3, :3])))
    local = _or(to_object(world, matrix), normals)
    if space is Space.OBJECT:
        return local
    return _or(in_frames(local, texture.frames(texels)), np.array([[0.0, 0.0, 1.0]]))


def _or(directions: Doubles, instead: Doubles) -> Doubles:
    """Where a direction is zero, the other."""
    return np.where(np.any(directions != 0.0, axis=1, keepdims=True), directions, instead)
