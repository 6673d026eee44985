"""Meshes where they stand in the world, in float32 about an origin: what is traced."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..base.arrays import Doubles, Floats, Ints
from ..base.vectors import determinant, dot, mapped, transformed_normals
from .scene import Instance

_CORNERS = np.array(list(np.ndindex(2, 2, 2)), dtype=np.bool_)  # (8, 3): low or high


@dataclass(frozen=True, eq=False)
class WorldMesh:
    """A mesh in world space, relative to an origin. The winding is outward even under a mirroring matrix.

    faces: (T, 3) float32 unit normals of the triangles from before their corners were rounded, which turns needles
    about themselves; zero or None where they must be taken from the corners. spacing: (T,) float32, the side of a texel
    on each triangle, None where its corners tell.
    """

    vertices: Floats
    triangles: Ints
    uv: Floats | None = None
    normals: Floats | None = None
    faces: Floats | None = None
    spacing: Floats | None = None


def centre_of(target: Instance) -> Doubles:
    """(3,) float64: the middle of the target's bounding box in world space."""
    low, high = bounds_of(target)
    return 0.5 * (low + high)


def bounds_of(instance: Instance) -> tuple[Doubles, Doubles]:
    """World-space box of an instance, from its object-space box's eight corners: (low, high), each (3,) float64."""
    low, high = boxes_of([instance])[0]
    return low, high


def boxes_of(instances: Sequence[Instance]) -> Doubles:
    """(N, 2, 3) float64: the same of many."""
    if not instances:
        return np.zeros((0, 2, 3))
    boxes = np.array([instance.mesh.box for instance in instances])
    filled = (boxes[:, 0] <= boxes[:, 1]).all(axis=1)  # the others are inside out
    low, high = boxes[filled, 0, np.newaxis], boxes[filled, 1, np.newaxis]
    matrices = np.array([instance.matrix for instance, here in zip(instances, filled, strict=True) if here])
    if len(matrices):
        corners = np.where(_CORNERS, high, low)
        with np.errstate(over="ignore", invalid="ignore"):  # a box too large for float64 is not finite
            world = dot(matrices[:, np.newaxis, :3, :3], corners[:, :, np.newaxis]) + matrices[:, np.newaxis, :3, 3]
        boxes[filled] = np.stack([world.min(axis=1), world.max(axis=1)], axis=1)
    return boxes


def mirrors(instance: Instance) -> bool:
    """Whether its matrix turns the mesh inside out: `world_mesh` then swaps its triangles' second and third corners."""
    return determinant(instance.matrix[:3, :3]) < 0.0


def world_mesh(instance: Instance, origin: Doubles) -> WorldMesh:
    """Move an instance to world space about `origin` ((3,) float64), in float64, and round to float32 only then.

    A mirroring matrix would turn the triangles inside out: their second and third corners change places. Normals go by
    the inverse transpose; a matrix that flattens the mesh has none, and the faces become flat.
    """
    mesh, linear = instance.mesh, instance.matrix[:3, :3]
    bare, order = world_shape(instance, origin), _order(instance)
    uv = None if mesh.uv is None else np.ascontiguousarray(mesh.uv[:, order], dtype=np.float32)
    normals = None
    if mesh.normals is not None and determinant(linear) != 0.0:
        normals = transformed_normals(mesh.normals, linear)[:, order]
        normals = np.ascontiguousarray(normals, dtype=np.float32)
    return replace(bare, uv=uv, normals=normals)


def world_shape(instance: Instance, origin: Doubles) -> WorldMesh:
    """The same without UVs and normals: what an occluder is."""
    mesh, linear = instance.mesh, instance.matrix[:3, :3]
    shift = instance.matrix[:3, 3] - origin
    vertices = (mapped(mesh.vertices.astype(np.float64), linear) + shift).astype(np.float32)
    return WorldMesh(vertices, np.ascontiguousarray(mesh.triangles[:, _order(instance)], dtype=np.int32))


def _order(instance: Instance) -> list[int]:
    """Of a triangle's corners."""
    return [0, 2, 1] if mirrors(instance) else [0, 1, 2]


def world_surface(instance: Instance, origin: Doubles) -> WorldMesh:
    """`world_mesh`, with the faces' normals: for the surface that is baked."""
    linear = instance.matrix[:3, :3]
    if determinant(linear) == 0.0:
        return world_mesh(instance, origin)
    faces = transformed_normals(instance.mesh.doubled_areas, linear).astype(np.float32)
    return replace(world_mesh(instance, origin), faces=faces)
