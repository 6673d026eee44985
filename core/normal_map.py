"""Normal maps of a target's materials: its texels' shading normals, in the place of those of its mesh.

A texel stays the piece of surface that it is; it only gets a normal of its own, the mean of the map's over it, as a
mip map has it. Cycles takes the map's normal anew for each of its samples.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .errors import InputError
from .frames import Texture
from .mending import uv_area_of
from .picture import Picture, sampled
from .scene import Doubles, Floats, Ints, Placed, carried, unit
from .texels import in_bands

PLAIN = -1  # in the place of a relief's number
_BAND = 1 << 18  # texels at a time
_MOST_LOOKS = 4  # along a texel's side, into a map that is finer than the bake


@dataclass(frozen=True, eq=False)
class Relief:
    """One material's normal map in tangent space.

    picture: (h, w, 3) values as colours, 0.5 for 0, the third along the normal. tangents: (T, 3, 4) float32, of the UV
    map that the map is made for, as those of `Mesh`. strength: what its first two are multiplied by.
    """

    picture: Picture
    tangents: Floats
    strength: float = 1.0


@dataclass(frozen=True, eq=False)
class NormalMap:
    """What lies on the triangles of one mesh. relief: (T,) int32, which of `reliefs`, PLAIN for none. uv: (T, 3, 2)
    float32 per corner, v up, places in the pictures. Raises InputError for arrays that do not fit one another."""

    reliefs: Sequence[Relief]
    relief: Ints
    uv: Floats

    def __post_init__(self) -> None:
        if self.uv.shape != (len(self.relief), 3, 2):
            raise InputError(
                f"normal map: UVs of shape {self.uv.shape} do not fit {len(self.relief)} triangles; give (T, 3, 2)"
            )
        if len(self.relief) and not PLAIN <= self.relief.min() <= self.relief.max() < len(self.reliefs):
            raise InputError(
                f"normal map: a triangle names a relief that does not exist; there are {len(self.reliefs)}"
            )


def with_normals(normal_map: NormalMap, texture: Texture, surface: Placed, owner: Ints) -> Placed:
    """The surface with the map's normals at its texels. texture: the target's; owner: (H, W) int32, its.

    Raises InputError for a map of another mesh.
    """
    if len(normal_map.relief) != len(surface.triangles):
        raise InputError(
            f"{texture.target.name}: a normal map of {len(normal_map.relief)} triangles is laid over a mesh of "
            f"{len(surface.triangles)}; make it anew"
        )
    if np.linalg.det(texture.target.matrix[:3, :3]) == 0.0:  # flattened: its normals are those of its faces
        return surface
    normals = np.zeros((owner.size, 3), dtype=np.float32)
    for texels in in_bands(np.flatnonzero(owner >= 0), _BAND):
        normals[texels] = _normals(normal_map, texture, texels)
    return replace(surface, texel_normals=normals.reshape(*owner.shape, 3))


def _normals(normal_map: NormalMap, texture: Texture, texels: NDArray[np.int64]) -> Doubles:
    """(N, 3) float64: unit normals of listed texels in world space."""
    normals, relief = unit(texture.normals(texels)), normal_map.relief[texture.owners(texels)]
    for number, each in enumerate(normal_map.reliefs):
        here = np.flatnonzero(relief == number)
        if len(here):
            mapped = _mean(each, normal_map.uv, texture, texels[here], _looks(normal_map, number, texture))
            normals[here] = np.where(mapped.any(axis=1, keepdims=True), mapped, normals[here])
    return carried(normals, texture.target.matrix[:3, :3])


def _looks(normal_map: NormalMap, number: int, texture: Texture) -> int:
    """How often a side of a texel is looked at: once for each texel of the map along it, at most."""
    here = normal_map.relief == number
    height, width = normal_map.reliefs[number].picture.values.shape[:2]
    in_map = np.abs(uv_area_of(normal_map.uv[here].astype(np.float64) * (width, height))).sum()
    in_bake = texture.areas[here].sum()
    return int(np.clip(np.rint(np.sqrt(in_map / max(in_bake, 1e-12))), 1, _MOST_LOOKS))


def _mean(relief: Relief, uv: Floats, texture: Texture, texels: NDArray[np.int64], looks: int) -> Doubles:
    """(N, 3) float64: the mean of a relief's normals over texels, in object space; zero where there are none."""
    frames = texture.frames_of(relief.tangents, texels)
    corners = uv[texture.owners(texels)].astype(np.float64)
    whole = np.zeros((len(texels), 3))
    for look in np.ndindex(looks, looks):
        shift = (look[0] + 0.5) / looks - 0.5, (look[1] + 0.5) / looks - 0.5
        place = np.einsum("nc,nca->na", _within(texture.weights(texels, shift)), corners)
        along = 2.0 * sampled(relief.picture, place).astype(np.float64) - 1.0
        along[:, :2] *= relief.strength
        along[:, 2] = 1.0 + (along[:, 2] - 1.0) * min(relief.strength, 1.0)
        x, y, z = (along[:, axis, np.newaxis] for axis in range(3))
        whole += unit(x * frames.tangent + y * frames.bitangent + z * frames.normal)
    return unit(whole)


def _within(weights: Doubles) -> Doubles:
    """Weights of places that are kept from leaving their triangles: beyond an edge may lie another chart."""
    inside = np.maximum(weights, 0.0)
    kept: Doubles = inside / inside.sum(axis=1, keepdims=True)
    return kept
