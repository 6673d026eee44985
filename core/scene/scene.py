"""What the bake is given: meshes, their places in the world, the camera, and the checks on them.

Object space is float32, as Blender stores it; object-to-world matrices are float64, so that a bake can be centred on
its object before anything is rounded (`placed`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..base.errors import InputError

if TYPE_CHECKING:
    from ..spherical.environment import Environment
    from ..texels.shading_normals import NormalMap
    from .cutout import Cutout

# Beyond these sizes the cubes of lengths leave float32's range on the way through the tracer, and it finds everything
# shut or open. Measured: wrong values come below about 2e-11 and above about 2e13.
SMALLEST, LARGEST = 1e-7, 1e10

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]
Ints = NDArray[np.int32]
_Real = TypeVar("_Real", np.float32, np.float64)


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles in object space. Instances share a mesh by holding the same `Mesh` object.

    vertices: (V, 3) float32. triangles: (T, 3) int32, counter-clockwise seen from outside.
    uv: (T, 3, 2) float32 per corner, v up, or None. normals: (T, 3, 3) float32 unit shading normals per corner, or None
    where every face is flat. corners: (T, 3) int32, which face corners of the mesh that it was made from they are,
    where that is known. tangents: (T, 3, 4) float32 per corner, along u, and the sign of the bitangent, sign · n × t
    (MikkTSpace), or None where nothing needs them.
    """

    name: str
    vertices: Floats
    triangles: Ints
    uv: Floats | None = None
    normals: Floats | None = None
    corners: Ints | None = None
    tangents: Floats | None = None

    @cached_property
    def doubled_areas(self) -> Doubles:
        """(T, 3) float64: each triangle's normal, as long as twice its area."""
        a, b, c = (self.vertices[self.triangles[:, corner]].astype(np.float64) for corner in range(3))
        vectors: Doubles = np.cross(b - a, c - a)
        return vectors

    @cached_property
    def box(self) -> tuple[Doubles, Doubles]:
        """The object-space box of its triangles: (low, high), each (3,) float64; inside out where there are none.

        Loose vertices do not count: one far off would take the frame's middle, and the precision, away from the rest.
        """
        if len(self.triangles) == 0:
            return np.full(3, np.inf), np.full(3, -np.inf)
        used = np.zeros(len(self.vertices), dtype=bool)
        used[self.triangles] = True
        corners = self.vertices if used.all() else self.vertices[used]
        return corners.min(axis=0).astype(np.float64), corners.max(axis=0).astype(np.float64)


@dataclass(frozen=True, eq=False)
class Instance:
    """A mesh somewhere in the world. matrix: (4, 4) float64, object to world, any affine map. owner: the object that it
    belongs to, which of what an object instances is that object; the name, where it is empty. cutout: where its
    materials let light through, None where they do not. normal_map: what its materials turn the normals by, None where
    they do not, or nothing needs it."""

    name: str
    mesh: Mesh
    matrix: Doubles
    owner: str = ""
    cutout: Cutout | None = None
    normal_map: NormalMap | None = None

    @property
    def belongs_to(self) -> str:
        """The name of the object that put it there."""
        return self.owner or self.name


@dataclass(frozen=True)
class Camera:
    """Where the view comes from. position and forward: world space; orthographic cameras see along `forward` alone."""

    position: tuple[float, float, float]
    forward: tuple[float, float, float]
    orthographic: bool = False

    def about(self, origin: Doubles) -> Camera:
        """The same view in a frame with this origin ((3,) float64), subtracted in float64."""
        x, y, z = np.asarray(self.position, dtype=np.float64) - origin
        return replace(self, position=(float(x), float(y), float(z)))

    def views(self, positions: Doubles) -> Doubles:
        """From where it is to each of (..., 3) positions, of any length; all the same where it is orthographic."""
        if self.orthographic:
            return np.broadcast_to(np.asarray(self.forward, dtype=np.float64), positions.shape)
        return positions - np.asarray(self.position, dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Highs:
    """What a target is baked from in the place of its own surface (high_to_low.py). cage: the target's mesh, blown up,
    from which the high ones are looked for; else they are within `extrusion` scene units of the target, None: a part of
    its size."""

    meshes: Sequence[Instance]
    cage: Instance | None = None
    extrusion: float | None = None


@dataclass(frozen=True, eq=False)
class Scene:
    """Everything a bake may need.

    targets: the objects to bake, their meshes with UVs. occluders: all that blocks light, the targets among them where
    they do (an occluder is a target's own geometry when it bears the target's name and mesh). shared: what belongs to
    one target occludes the others, too. highs: of the targets that are baked from others, by name. environment: the
    light from far away, where maps of light are baked.
    """

    targets: Sequence[Instance]
    occluders: Sequence[Instance]
    camera: Camera | None = None
    shared: bool = True
    highs: Mapping[str, Highs] = field(default_factory=dict)
    environment: Environment | None = None


@dataclass(frozen=True, eq=False)
class Placed:
    """A mesh in world space, relative to an origin. The winding is outward even under a mirroring matrix.

    faces: (T, 3) float32 unit normals of the triangles from before their corners were rounded, which turns needles
    about themselves; zero or None where they must be taken from the corners. texel_normals: (H, W, 3) float32 unit
    normals that texels are shaded by in the place of `normals`, None where these are. spacing: (T,) float32, the side
    of a texel on each triangle, None where its corners tell.
    """

    vertices: Floats
    triangles: Ints
    uv: Floats | None = field(default=None)
    normals: Floats | None = field(default=None)
    faces: Floats | None = field(default=None)
    spacing: Floats | None = field(default=None)
    texel_normals: Floats | None = field(default=None)


def check_target(target: Instance) -> list[str]:
    """Refuse a mesh that cannot be baked and warn of one that can be in part.

    Returns the warnings, a line each. Raises InputError for no faces, arrays that do not fit one another, non-finite
    vertices or matrix, no area, or a size that cannot be traced.
    """
    mesh = target.mesh
    if len(mesh.triangles) == 0:
        raise InputError(f"{target.name}: the mesh has no faces; there is no surface to bake")
    _check_arrays(target)
    broken = int(np.count_nonzero(~np.isfinite(mesh.vertices).all(axis=1)))
    if broken:
        count = "1 vertex is" if broken == 1 else f"{broken} vertices are"
        raise InputError(f"{target.name}: {count} not finite; delete what is, or undo the modifier that made it")
    if not np.isfinite(target.matrix).all():
        raise InputError(
            f"{target.name}: its transform is not finite; clear the location, rotation or scale that is not"
        )
    if np.linalg.matrix_rank(target.matrix[:3, :3]) < 2:
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


def _check_arrays(target: Instance) -> None:
    """The tracer follows indices as they come."""
    mesh = target.mesh
    if mesh.triangles.min() < 0 or mesh.triangles.max() >= len(mesh.vertices):
        raise InputError(f"{target.name}: a triangle names a vertex that does not exist; make the mesh again")
    for kind, values in (("UVs", mesh.uv), ("normals", mesh.normals)):
        if values is not None and values.shape[:2] != mesh.triangles.shape:
            wanted = " x ".join(map(str, mesh.triangles.shape))
            raise InputError(f"{target.name}: its {kind} do not fit {wanted} triangle corners; make the mesh again")


def unit_normals(corners: Doubles) -> Doubles:
    """(N, 3) unit normals, by the right-hand rule, of triangles with (N, 3, 3) corners; zero for one without area."""
    return unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))


def unit(vectors: NDArray[_Real]) -> NDArray[_Real]:
    """(..., 3) vectors at unit length; zero, and what has no length, becomes zero."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    result: NDArray[_Real] = np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0.0)
    return result


def zero_area(mesh: Mesh) -> NDArray[np.bool_]:
    """(T,) bool: triangles whose corners lie on one line, judged in float64 in object space."""
    flat: NDArray[np.bool_] = ~(np.abs(mesh.doubled_areas).max(axis=1) > 0.0)
    return flat


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
    with np.errstate(over="ignore", invalid="ignore"):  # a box too large for float64 is not finite
        world = corners @ instance.matrix[:3, :3].T + instance.matrix[:3, 3]
    return world.min(axis=0), world.max(axis=0)


def mirrors(instance: Instance) -> bool:
    """Whether its matrix turns the mesh inside out, so that `placed` swaps its triangles' second and third corners."""
    return float(np.linalg.det(instance.matrix[:3, :3])) < 0.0


def placed(instance: Instance, origin: Doubles) -> Placed:
    """Move an instance to world space about `origin` ((3,) float64), in float64, and round to float32 only then.

    A mirroring matrix would turn the triangles inside out: their second and third corners change places. Normals go by
    the inverse transpose; a matrix that flattens the mesh has none, and the faces become flat.
    """
    mesh, linear = instance.mesh, instance.matrix[:3, :3]
    shift = instance.matrix[:3, 3] - origin
    vertices = (mesh.vertices.astype(np.float64) @ linear.T + shift).astype(np.float32)
    order = [0, 2, 1] if mirrors(instance) else [0, 1, 2]
    triangles = np.ascontiguousarray(mesh.triangles[:, order], dtype=np.int32)
    uv = None if mesh.uv is None else np.ascontiguousarray(mesh.uv[:, order], dtype=np.float32)
    normals = None
    if mesh.normals is not None and np.linalg.det(linear) != 0.0:
        normals = carried(mesh.normals, linear)[:, order]
        normals = np.ascontiguousarray(normals, dtype=np.float32)
    return Placed(vertices, triangles, uv, normals)


def surface_of(instance: Instance, origin: Doubles) -> Placed:
    """`placed`, with the faces' normals: for the surface that is baked."""
    linear = instance.matrix[:3, :3]
    if np.linalg.det(linear) == 0.0:
        return placed(instance, origin)
    faces = carried(instance.mesh.doubled_areas, linear).astype(np.float32)
    return replace(placed(instance, origin), faces=faces)


def carried(normals: NDArray[_Real], linear: Doubles) -> NDArray[_Real]:
    """Normals, (..., 3), under a linear map, by its inverse transpose, at unit length; a zero normal stays zero."""
    inverse = np.linalg.inv(linear)
    inverse /= np.abs(inverse).max()  # the length does not matter, and its square must stay within float32
    with np.errstate(over="ignore", invalid="ignore"):  # normals that are no numbers end as zero
        return unit(normals @ inverse.astype(normals.dtype))  # n·M⁻¹ = (M⁻ᵀ n)ᵀ
