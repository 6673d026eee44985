"""Normal maps of a target's materials: its texels' shading normals, in the place of those of its mesh.

A texel stays the piece of surface that it is; it only gets a normal of its own, the map's at its middle. Of a map that
is finer than the bake that is a mean over blocks of its texels, as mip maps have it (Williams, Pyramidal parametrics,
1983). Cycles takes the map's normal anew for each of its samples.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ..base.arrays import Doubles, Floats, Longs
from ..base.errors import InputError
from ..base.parallel import for_each
from ..base.triangles import texels_of
from ..base.vectors import determinant, transformed_normals, unit, weighted
from ..rays.texel_surface import TexelSurface
from ..scene.image_texture import ImageTexture, sampled
from ..scene.normal_map import PLAIN, NormalMap
from .rasterize import in_bands
from .tangent_space import TexelFrames

_BAND = 1 << 16  # texels at a time


def with_shading_normals(
    normal_map: NormalMap,
    frames: TexelFrames,
    surface: TexelSurface,
    *,
    check: Callable[[], None] = lambda: None,
) -> TexelSurface:
    """The surface with the map's normals at its texels. frames: the target's. check: called now and then, to raise
    Cancelled.

    Triangles whose places in a texture are no numbers keep their normals. Raises InputError for a map of another mesh.
    """
    if len(normal_map.layer) != len(surface.mesh.triangles):
        raise InputError(
            f"{frames.target.name}: a normal map of {len(normal_map.layer)} triangles is laid over a mesh of "
            f"{len(surface.mesh.triangles)}; make it anew"
        )
    if determinant(frames.target.matrix[:3, :3]) == 0.0:  # flattened: its normals are those of its faces
        return surface
    sound = np.isfinite(normal_map.uv).all(axis=(1, 2))
    laid = replace(normal_map, layer=np.where(sound, normal_map.layer, np.int32(PLAIN)))
    textures = [_vectors(laid, number, frames) for number in range(len(laid.layers))]
    normals = np.zeros((surface.owner.size, 3), dtype=np.float32)

    def turn(texels: Longs) -> None:
        check()
        normals[texels] = _normals(laid, textures, frames, texels)

    frames.normals(np.zeros(0, dtype=np.int64))  # what it keeps is made once, before threads ask for it
    for_each(turn, in_bands(np.flatnonzero(surface.covered), _BAND), surface.threads)
    return replace(surface, texel_normals=normals.reshape(*surface.owner.shape, 3))


def _vectors(laid: NormalMap, number: int, frames: TexelFrames) -> ImageTexture:
    """A layer's colours as vectors, as coarse as the bake's texels: (h, w, 3) float32, the strength applied."""
    layer, here = laid.layers[number], laid.layer == number
    height, width = layer.texture.values.shape[:2]
    in_map = texels_of(laid.uv[here], width, height).sum()
    in_bake = np.nansum(frames.areas[here])
    times = int(np.clip(np.rint(np.sqrt(in_map / max(in_bake, 1e-12))), 1, max(height, width)))
    vectors = 2.0 * _coarser(layer.texture.values, times) - np.float32(1.0)
    vectors[..., :2] *= np.float32(layer.strength)
    vectors[..., 2] = 1.0 + (vectors[..., 2] - 1.0) * np.float32(min(layer.strength, 1.0))
    return replace(layer.texture, values=vectors)


def _coarser(values: Floats, times: int) -> Floats:
    """Means over blocks of so many texels a side, or one more or less where that does not go in evenly."""
    if times == 1:
        return values
    for axis in (0, 1):
        size = values.shape[axis]
        starts = np.arange(max(size // times, 1), dtype=np.int64) * size // max(size // times, 1)
        counts = np.diff(starts, append=size).astype(np.float32)
        values = (np.add.reduceat(values, starts, axis=axis) / np.expand_dims(counts, (1 - axis, 2))).astype(np.float32)
    return values


def _normals(laid: NormalMap, textures: Sequence[ImageTexture], frames: TexelFrames, texels: Longs) -> Doubles:
    """(N, 3) float64: unit normals of listed texels in world space."""
    triangle, weights = frames.owners(texels), frames.weights(texels)
    normals, layer = unit(frames.normals(texels)), laid.layer[triangle]
    for number, texture in enumerate(textures):
        here = np.flatnonzero(layer == number)
        if len(here):
            own = frames.frames_of(laid.layers[number].tangents, texels[here])
            place = weighted(weights[here], laid.uv[triangle[here]].astype(np.float64))
            x, y, z = np.moveaxis(sampled(texture, place)[:, :, np.newaxis].astype(np.float64), 1, 0)
            mapped = unit(x * own.tangent + y * own.bitangent + z * own.normal)
            normals[here] = np.where(mapped.any(axis=1, keepdims=True), mapped, normals[here])
    return transformed_normals(normals, frames.target.matrix[:3, :3])
