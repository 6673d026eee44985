"""What of a mesh cannot be baked, found before anything is traced."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..base.arrays import Doubles, Flags
from ..base.errors import InputError
from ..base.singular_values import NEGLIGIBLE, singular_values
from ..base.vectors import determinant
from .scene import Instance, Mesh
from .world_mesh import bounds_of

# Beyond these sizes the cubes of lengths leave float32's range on the way through the tracer, and it finds everything
# shut or open. Measured: wrong values come below about 2e-11 and above about 2e13.
SMALLEST, LARGEST = 1e-7, 1e10
_SURELY_SOLID = 1e-6


def check_target(target: Instance) -> list[str]:
    """Refuse a mesh that cannot be baked and warn of one that can be in part.

    Returns the warnings, a line each. Raises InputError for no faces, arrays that do not fit one another, non-finite
    vertices or matrix, no area, or a size that cannot be traced.
    """
    mesh = target.mesh
    if len(mesh.triangles) == 0:
        raise no_faces(target.name)
    _check_arrays(target)
    broken = int(np.count_nonzero(~np.isfinite(mesh.vertices).all(axis=1)))
    if broken:
        count = "1 vertex is" if broken == 1 else f"{broken} vertices are"
        raise InputError(f"{target.name}: {count} not finite; delete what is, or undo the modifier that made it")
    if not np.isfinite(target.matrix).all():
        raise InputError(
            f"{target.name}: its transform is not finite; clear the location, rotation or scale that is not"
        )
    if _flattens(target.matrix[:3, :3]):
        raise InputError(f"{target.name}: its scale leaves it no area; give at least two axes a scale other than 0")
    flat = int(np.count_nonzero(zero_area(mesh)))
    if flat == len(mesh.triangles):
        raise InputError(f"{target.name}: every face has zero area; scale or edit the mesh so that it has a surface")
    low, high = bounds_of(target)
    size = float((high - low).max())
    if not SMALLEST <= size <= LARGEST:
        raise InputError(
            f"{target.name}: it is {size:.3g} units across, and rays need {SMALLEST:g} to {LARGEST:g}; scale the scene"
        )
    return [f"{target.name}: {flat} triangles have zero area and are left out"] if flat else []


def _flattens(linear: Doubles) -> bool:
    """Whether a matrix leaves no area: its second singular value is as good as zero."""
    scaled = linear / max(float(np.abs(linear).max()), 1e-300)
    # Its determinant is the product of all three, and the greatest is below 3.
    if abs(determinant(scaled)) > _SURELY_SOLID:
        return False
    greatest, second, _ = singular_values(linear[np.newaxis])[0]
    return not second > NEGLIGIBLE * greatest


def no_faces(name: str) -> InputError:
    """What is said of an object whose mesh has none."""
    return InputError(f"{name}: the mesh has no faces; there is no surface to bake")


def _check_arrays(target: Instance) -> None:
    """What is worked out of them follows their indices, and their lengths, as they come."""
    mesh, corners = target.mesh, (len(target.mesh.triangles), 3)
    for kind, values, dtype, shape in (
        ("vertices", mesh.vertices, np.float32, (len(mesh.vertices), 3)),
        ("triangles", mesh.triangles, np.int32, corners),
        ("UVs", mesh.uv, np.float32, (*corners, 2)),
        ("normals", mesh.normals, np.float32, (*corners, 3)),
        ("tangents", mesh.tangents, np.float32, (*corners, 4)),
    ):
        if values is not None and (values.shape != shape or values.dtype != dtype):
            raise InputError(
                f"{target.name}: its {kind} are {_described(values.shape, values.dtype)} and must be "
                f"{_described(shape, np.dtype(dtype))}; make the mesh again"
            )
    if mesh.triangles.min() < 0 or mesh.triangles.max() >= len(mesh.vertices):
        raise InputError(f"{target.name}: a triangle names a vertex that does not exist; make the mesh again")


def _described(shape: tuple[int, ...], dtype: np.dtype[Any]) -> str:
    return f"{' x '.join(map(str, shape))} of {dtype}"


def zero_area(mesh: Mesh) -> Flags:
    """(T,) bool: triangles whose corners lie on one line, judged in float64 in object space."""
    flat: Flags = ~(np.abs(mesh.doubled_areas).max(axis=1) > 0.0)
    return flat
