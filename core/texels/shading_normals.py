"""Normal maps of a target's materials: its texels' shading normals, in the place of those of its mesh.

A texel stays the piece of surface that it is; it only gets a normal of its own, the map's at its middle. Of a map that
is finer than the bake that is a mean over blocks of its texels, as mip maps have it (Williams, Pyramidal parametrics,
1983). Cycles takes the map's normal anew for each of its samples.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..base.errors import InputError
from ..base.parallel import for_each
from ..charts.polygon_charts import texels_of
from ..scene.image_texture import Picture, sampled
from ..scene.scene import Doubles, Floats, Ints, Placed, carried, unit
from .rasterize import in_bands
from .tangent_space import Texture

PLAIN = -1  # in the place of a relief's number
_BAND = 1 << 16  # texels at a time


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


def with_normals(
    normal_map: NormalMap,
    texture: Texture,
    surface: Placed,
    owner: Ints,
    *,
    threads: int = 0,
    check: Callable[[], None] = lambda: None,
) -> Placed:
    """The surface with the map's normals at its texels. texture: the target's; owner: (H, W) int32, its. check: called
    now and then, to raise Cancelled.

    Triangles whose places in a picture are no numbers keep their normals. Raises InputError for a map of another mesh.
    """
    if len(normal_map.relief) != len(surface.triangles):
        raise InputError(
            f"{texture.target.name}: a normal map of {len(normal_map.relief)} triangles is laid over a mesh of "
            f"{len(surface.triangles)}; make it anew"
        )
    if np.linalg.det(texture.target.matrix[:3, :3]) == 0.0:  # flattened: its normals are those of its faces
        return surface
    sound = np.isfinite(normal_map.uv).all(axis=(1, 2))
    laid = replace(normal_map, relief=np.where(sound, normal_map.relief, np.int32(PLAIN)))
    pictures = [_vectors(laid, number, texture) for number in range(len(laid.reliefs))]
    normals = np.zeros((owner.size, 3), dtype=np.float32)

    def turn(texels: NDArray[np.int64]) -> None:
        check()
        normals[texels] = _normals(laid, pictures, texture, texels)

    texture.normals(np.zeros(0, dtype=np.int64))  # what it keeps is made once, before threads ask for it
    for_each(turn, in_bands(np.flatnonzero(owner >= 0), _BAND), threads)
    return replace(surface, texel_normals=normals.reshape(*owner.shape, 3))


def _vectors(laid: NormalMap, number: int, texture: Texture) -> Picture:
    """A relief's colours as vectors, as coarse as the bake's texels: (h, w, 3) float32, the strength applied."""
    relief, here = laid.reliefs[number], laid.relief == number
    height, width = relief.picture.values.shape[:2]
    in_map = texels_of(laid.uv[here], width, height).sum()
    in_bake = np.nansum(texture.areas[here])
    times = int(np.clip(np.rint(np.sqrt(in_map / max(in_bake, 1e-12))), 1, max(height, width)))
    vectors = 2.0 * _coarser(relief.picture.values, times) - np.float32(1.0)
    vectors[..., :2] *= np.float32(relief.strength)
    vectors[..., 2] = 1.0 + (vectors[..., 2] - 1.0) * np.float32(min(relief.strength, 1.0))
    return replace(relief.picture, values=vectors)


def _coarser(values: Floats, times: int) -> Floats:
    """Means over blocks of so many texels a side, or one more or less where that does not go in evenly."""
    if times == 1:
        return values
    for axis in (0, 1):
        size = values.shape[axis]
        starts = np.arange(max(size // times, 1)) * size // max(size // times, 1)
        counts = np.diff(starts, append=size).astype(np.float32)
        values = (np.add.reduceat(values, starts, axis=axis) / np.expand_dims(counts, (1 - axis, 2))).astype(np.float32)
    return values


def _normals(laid: NormalMap, pictures: Sequence[Picture], texture: Texture, texels: NDArray[np.int64]) -> Doubles:
    """(N, 3) float64: unit normals of listed texels in world space."""
    triangle, weights = texture.owners(texels), texture.weights(texels)
    normals, relief = unit(texture.normals(texels)), laid.relief[triangle]
    for number, picture in enumerate(pictures):
        here = np.flatnonzero(relief == number)
        if len(here):
            frames = texture.frames_of(laid.reliefs[number].tangents, texels[here])
            place = np.einsum("nc,nca->na", weights[here], laid.uv[triangle[here]].astype(np.float64))
            x, y, z = np.moveaxis(sampled(picture, place)[:, :, np.newaxis].astype(np.float64), 1, 0)
            mapped = unit(x * frames.tangent + y * frames.bitangent + z * frames.normal)
            normals[here] = np.where(mapped.any(axis=1, keepdims=True), mapped, normals[here])
    return carried(normals, texture.target.matrix[:3, :3])
