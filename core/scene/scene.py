"""What the bake is given: meshes, their places in the world, the camera, and the checks on them.

Object space is float32, as Blender stores it; object-to-world matrices are float64, so that a bake can be centred on
its object before anything is rounded (`world_mesh`).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ..base.arrays import Doubles, Floats, Ints

if TYPE_CHECKING:
    from ..spherical.environment import Environment
    from .cutout import Cutout
    from .normal_map import NormalMap


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles in object space. Instances share a mesh by holding the same `Mesh` object.

    vertices: (V, 3) float32. triangles: (T, 3) int32, counter-clockwise seen from outside.
    uv: (T, 3, 2) float32 per corner, v up, or None. normals: (T, 3, 3) float32 unit shading normals per corner, or None
    where every face is flat. corners: (T, 3) int32, which face corners of the mesh that it was made from they are,
    where that is known. tangents: (T, 3, 4) float32 per corner, along u, and the sign of the bitangent, sign · n × t
    (MikkTSpace), or None where nothing needs them. uv_map: what the UVs are called where they are from.
    """

    name: str
    vertices: Floats
    triangles: Ints
    uv: Floats | None = None
    normals: Floats | None = None
    corners: Ints | None = None
    tangents: Floats | None = None
    uv_map: str = ""

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
    """A mesh somewhere in the world. name: what lines and files call it; no two objects of a scene have one, and it is
    what they are told apart by. matrix: (4, 4) float64, object to world, any affine map. owner: the name of the object
    that it belongs to, which of what an object instances is that object; its own, where it is empty. cutout: where its
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
class HighPoly:
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
    they do (an occluder is a target's own geometry when it bears the target's name and mesh). private: names of
    targets, and of what they are baked from, that block light for their own target alone. highs: of the targets that
    are baked from others, by name. environment: the light from far away, where maps of light are baked.
    """

    targets: Sequence[Instance]
    occluders: Sequence[Instance]
    camera: Camera | None = None
    private: Collection[str] = ()
    highs: Mapping[str, HighPoly] = field(default_factory=dict)
    environment: Environment | None = None
