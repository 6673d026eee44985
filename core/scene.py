"""What the bake is given: meshes, their places in the world, the camera, and the checks on them.

Object space is float32, as Blender stores it; object-to-world matrices are float64, so that a bake can be centred on
its object before anything is rounded (`placed`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .errors import InputError

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]
Ints = NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles in object space. Instances share a mesh by holding the same `Mesh` object.

    vertices: (V, 3) float32. triangles: (T, 3) int32, counter-clockwise seen from outside.
    uv: (T, 3, 2) float32 per corner, v up, or None. normals: (T, 3, 3) float32 unit shading normals per corner, or None
    where every face is flat.
    """

    name: str
    vertices: Floats
    triangles: Ints
    uv: Floats | None = None
    normals: Floats | None = None

    @cached_property
    def box(self) -> tuple[Doubles, Doubles]:
        """Its object-space box: (low, high), each (3,) float64; inside out where there are no vertices."""
        if len(self.vertices) == 0:
            return np.full(3, np.inf), np.full(3, -np.inf)
        return self.vertices.min(axis=0).astype(np.float64), self.vertices.max(axis=0).astype(np.float64)


@dataclass(frozen=True, eq=False)
class Instance:
    """A mesh somewhere in the world. matrix: (4, 4) float64, object to world, any affine map."""

    name: str
    mesh: Mesh
    matrix: Doubles


@dataclass(frozen=True)
class Camera:
    """Where the view comes from. position and forward: world space; orthographic cameras see along `forward` alone."""

    position: tuple[float, float, float]
    forward: tuple[float, float, float]
    orthographic: bool = False


@dataclass(frozen=True, eq=False)
class Scene:
    """Everything a bake may need.

    targets: the objects to bake, their meshes with UVs. occluders: all that blocks light, the targets among them where
    they do (an occluder is a target's own geometry when it bears the target's name and mesh).
    """

    targets: Sequence[Instance]
    occluders: Sequence[Instance]
    camera: Camera | None = None


@dataclass(frozen=True, eq=False)
class Placed:
    """A mesh in world space, relative to an origin. The winding is outward even under a mirroring matrix."""

    vertices: Floats
    triangles: Ints
    uv: Floats | None = field(default=None)
    normals: Floats | None = field(default=None)


def check_target(target: Instance) -> list[str]:
    """Refuse a mesh that cannot be baked and warn of one that can be in part.

    Returns the warnings, a line each. Raises InputError for no faces, non-finite vertices or matrix.
    """
    mesh = target.mesh
    if len(mesh.triangles) == 0:
        raise InputError(f"{target.name}: the mesh has no faces; there is no surface to bake")
    broken = int(np.count_nonzero(~np.isfinite(mesh.vertices).all(axis=1)))
    if broken:
        raise InputError(
            f"{target.name}: {broken} vertices are not finite numbers; delete them or undo the modifier that made them"
        )
    if not np.isfinite(target.matrix).all():
        raise InputError(
            f"{target.name}: its transform is not finite; clear the location, rotation or scale that is not"
        )
    flat = int(np.count_nonzero(zero_area(mesh)))
    if flat == len(mesh.triangles):
        raise InputError(f"{target.name}: every face has zero area; scale or edit the mesh so that it has a surface")
    return [f"{target.name}: {flat} triangles have zero area and are left out"] if flat else []


def zero_area(mesh: Mesh) -> NDArray[np.bool_]:
    """(T,) bool: triangles whose corners lie on one line, judged in float64 in object space."""
    a, b, c = (mesh.vertices[mesh.triangles[:, corner]].astype(np.float64) for corner in range(3))
    doubled: NDArray[np.bool_] = ~(np.abs(np.cross(b - a, c - a)).max(axis=1) > 0.0)
    return doubled


def centre_of(target: Instance) -> Doubles:
    """(3,) float64: the middle of the target's bounding box in world space."""
    low, high = bounds_of(target)
    return 0.5 * (low + high)


def bounds_of(instance: Instance) -> tuple[Doubles, Doubles]:
    """World-space box of an instance, from its object-space box's eight corners: (low, high), each (3,) float64."""
    low, high = instance.mesh.box
    if (low > high).any():
        return low, high
    corners = np.array([[(low, high)[bit][axis] for axis, bit in enumerate(bits)] for bits in np.ndindex(2, 2, 2)])
    world = corners @ instance.matrix[:3, :3].T + instance.matrix[:3, 3]
    return world.min(axis=0), world.max(axis=0)


def placed(instance: Instance, origin: Doubles) -> Placed:
    """Move an instance to world space about `origin` ((3,) float64), in float64, and round to float32 only then.

    A mirroring matrix would turn the triangles inside out: their second and third corners change places. Normals go by
    the inverse transpose; a matrix that flattens the mesh has none, and the faces become flat.
    """
    mesh, linear = instance.mesh, instance.matrix[:3, :3]
    shift = instance.matrix[:3, 3] - origin
    vertices = (mesh.vertices.astype(np.float64) @ linear.T + shift).astype(np.float32)
    determinant = float(np.linalg.det(linear))
    order = [0, 2, 1] if determinant < 0.0 else [0, 1, 2]
    triangles = np.ascontiguousarray(mesh.triangles[:, order], dtype=np.int32)
    uv = None if mesh.uv is None else np.ascontiguousarray(mesh.uv[:, order], dtype=np.float32)
    normals = None
    if mesh.normals is not None and determinant != 0.0:
        normals = _turned(mesh.normals, linear)[:, order]
        normals = np.ascontiguousarray(normals, dtype=np.float32)
    return Placed(vertices, triangles, uv, normals)


def _turned(normals: Floats, linear: Doubles) -> Floats:
    """Normals under a linear map, by its inverse transpose, at unit length; a zero normal stays zero."""
    turned = normals @ np.linalg.inv(linear).astype(np.float32)  # n·M⁻¹ = (M⁻ᵀ n)ᵀ
    length = np.linalg.norm(turned, axis=-1, keepdims=True)
    unit: Floats = np.divide(turned, length, out=np.zeros_like(turned), where=length > 0.0)
    return unit
