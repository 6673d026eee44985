"""Tangent frames of texels, for textures that tell directions by the surface.

As MikkTSpace has it (M. Mikkelsen, "Simulation of Wrinkled Surfaces Revisited", 2008), and Blender and engines too:
normal and tangent are interpolated from the corners without being made unit vectors or upright again, and the
bitangent is the sign times normal x tangent. All is in object space; directions go there and back as normals do.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..base.arrays import Doubles, Floats, Ints, Longs, Reals
from ..base.errors import InputError
from ..base.triangles import texels_of, unit_normals
from ..base.vectors import determinant, dot, mapped, unit, weighted
from ..rays.texel_surface import TexelSurface
from ..scene.scene import Instance
from ..scene.world_mesh import WorldMesh


@dataclass(frozen=True, eq=False)
class TangentFrames:
    """Of N texels: tangent, bitangent, normal, each (N, 3) float64, in object space; sign: (N,) float64, 1 or -1."""

    tangent: Doubles
    bitangent: Doubles
    normal: Doubles
    sign: Doubles


def check_tangents(target: Instance) -> None:
    """Raises InputError where the target's mesh has no tangents."""
    if target.mesh.tangents is None:
        raise InputError(
            f"{target.name}: it has no tangents, for its mesh has no UV map to take them from; unwrap it, or bake "
            "neither a directional code nor bent normals in tangent space"
        )


class TexelFrames:
    """A target's texels in its texture. owner: (H, W) int32, a triangle of its mesh."""

    def __init__(self, target: Instance, owner: Ints) -> None:
        assert target.mesh.uv is not None
        self.target = target
        self._owner, self._size, self._uv = owner.reshape(-1), owner.shape[::-1], target.mesh.uv

    @cached_property
    def _places(self) -> Floats:
        """(H · W, 3): the middles of the footprints, in UVs."""
        flat = TexelSurface(_flat(self._uv), self._owner.reshape(self._size[::-1]))
        return flat.positions.reshape(-1, 3)

    @cached_property
    def _normals(self) -> Reals:
        """(T, 3, 3): shading normals, of flat faces their own."""
        mesh = self.target.mesh
        if mesh.normals is not None:
            return mesh.normals
        faces = unit_normals(mesh.vertices[mesh.triangles].astype(np.float64))
        return np.repeat(faces[:, np.newaxis], 3, axis=1)

    def frames(self, texels: Longs) -> TangentFrames:
        """At the middles of the footprints of listed texels, y · W + x. Raises InputError as `check_tangents`."""
        check_tangents(self.target)
        tangents = self.target.mesh.tangents
        assert tangents is not None
        return self.frames_of(tangents, texels)

    def frames_of(self, tangents: Floats, texels: Longs) -> TangentFrames:
        """`frames` by other tangents, (T, 3, 4), as those of another UV map."""
        triangle, weights = self._owner[texels], self.weights(texels)
        normal = weighted(weights, self._normals[triangle].astype(np.float64))
        tangent = weighted(weights, tangents[triangle, :, :3].astype(np.float64))
        sign: Doubles = np.where(tangents[triangle, 0, 3] < 0.0, -1.0, 1.0)
        bitangent: Doubles = sign[:, np.newaxis] * np.cross(normal, tangent)
        return TangentFrames(tangent, bitangent, normal, sign)

    @cached_property
    def areas(self) -> Doubles:
        """(T,) float64: how many texels each triangle is as large as."""
        return texels_of(self._uv, *self._size)

    def owners(self, texels: Longs) -> Ints:
        """(N,) int32: the triangles of listed texels."""
        return self._owner[texels]

    def normals(self, texels: Longs) -> Doubles:
        """The frames' normals alone, (N, 3) float64."""
        return weighted(self.weights(texels), self._normals[self._owner[texels]].astype(np.float64))

    def weights(self, texels: Longs) -> Doubles:
        """(N, 3) float64: barycentric weights of the footprints' middles, by the UVs' own plane."""
        triangle = self._owner[texels]
        place = self._places[texels, :2].astype(np.float64)
        a, b, c = (self._uv[triangle, corner].astype(np.float64) for corner in range(3))
        edge1, edge2, to_place = b - a, c - a, place - a
        area = edge1[:, 0] * edge2[:, 1] - edge1[:, 1] * edge2[:, 0]
        area = np.where(area == 0.0, 1.0, area)
        second = (to_place[:, 0] * edge2[:, 1] - to_place[:, 1] * edge2[:, 0]) / area
        third = (edge1[:, 0] * to_place[:, 1] - edge1[:, 1] * to_place[:, 0]) / area
        return np.stack([1.0 - second - third, second, third], axis=1)


def to_object(directions: Doubles, matrix: Doubles) -> Doubles:
    """Directions of world space that are read as normals, (N, 3), in object space: unit, zero where they are."""
    return unit(mapped(directions, matrix[:3, :3].T))


def in_frames(directions: Doubles, frames: TangentFrames) -> Doubles:
    """Object-space directions, (N, 3), told by frames: what times tangent, bitangent and normal gives them. Unit."""
    axes = (frames.tangent, frames.bitangent, frames.normal)
    across = np.stack([np.cross(axes[(i + 1) % 3], axes[(i + 2) % 3]) for i in range(3)], axis=1)  # Cramer's rule
    volume = dot(frames.tangent, across[:, 0])
    parts = np.sign(volume)[:, np.newaxis] * dot(across, directions[:, np.newaxis])
    return unit(np.where(np.abs(volume)[:, np.newaxis] < 1e-9, directions, parts))


def world_tangents(frames: TangentFrames, matrix: Doubles) -> Floats:
    """(N, 4) float32: the tangents in world space, and the bitangents' signs there, as the kernel takes them."""
    linear = matrix[:3, :3]
    flipped = -1.0 if determinant(linear) < 0.0 else 1.0
    rows = np.concatenate([unit(mapped(frames.tangent, linear)), flipped * frames.sign[:, np.newaxis]], axis=1)
    return np.ascontiguousarray(rows, dtype=np.float32)


def _flat(uv: Floats) -> WorldMesh:
    """The layout as a surface in the plane: its points are UVs."""
    corners = np.concatenate([uv, np.zeros((*uv.shape[:2], 1), dtype=np.float32)], axis=2).reshape(-1, 3)
    triangles = np.arange(len(corners), dtype=np.int32).reshape(-1, 3)
    return WorldMesh(np.ascontiguousarray(corners), triangles, np.ascontiguousarray(uv))
