"""A surface with the texels of one image on it: what rays start from."""

from __future__ import annotations

from ctypes import byref
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..base import kernel_api as api
from ..base.arrays import Flags, Floats, Ints
from ..scene.world_mesh import WorldMesh


@dataclass(frozen=True, eq=False)
class TexelSurface:
    """mesh: about the origin that rays are traced in. owner: (H, W) int32, the triangle that each texel belongs to, -1
    none. texel_normals: (H, W, 3) float32 unit normals that texels are shaded by in the place of the mesh's, None where
    those are. threads: for what is worked out of it, 0 all.

    What is worked out is kept, for it is asked for by several.
    """

    mesh: WorldMesh
    owner: Ints
    texel_normals: Floats | None = None
    threads: int = 0

    @cached_property
    def covered(self) -> Flags:
        """(H, W) bool: texels that some triangle covers in part; conservative, none is left out."""
        mask: Flags = self.owner >= 0
        mask.setflags(write=False)  # it is handed on
        return mask

    @property
    def positions(self) -> Floats:
        """(H, W, 3) float32, mid-footprint of each owned texel; 0 elsewhere."""
        return self._points[0]

    @property
    def normals(self) -> Floats:
        """(H, W, 3) float32: unit shading normals there."""
        return self._points[1]

    @cached_property
    def _points(self) -> tuple[Floats, Floats]:
        positions, normals = (np.zeros((*self.owner.shape, 3), dtype=np.float32) for _ in range(2))
        places = (api.address(each, np.float32, *self.owner.shape, 3) for each in (positions, normals))
        api.check(api.library().ob_surface_points(byref(self.described()), self.threads, *places))
        return positions, normals

    def part(self, owner: Ints) -> TexelSurface:
        """The same surface with other owners: some of its texels."""
        return replace(self, owner=owner)

    def coarser(self) -> TexelSurface:
        """The same surface on an image half as wide and half as high, of even sizes. Of the four texels that one of its
        stands for the first that has an owner gives it its own."""
        mesh, owner = self.mesh, np.full_like(self.owner[::2, ::2], -1)
        for down, right in ((0, 0), (1, 1), (0, 1), (1, 0)):
            np.copyto(owner, self.owner[down::2, right::2], where=owner < 0)
        if mesh.spacing is not None:
            mesh = replace(mesh, spacing=np.float32(2.0) * mesh.spacing)
        return replace(self, mesh=mesh, owner=owner)

    def described(self) -> api.Surface:
        """As the kernel takes it; the caller keeps this surface alive."""
        mesh = self.mesh
        vertices, triangles, (height, width) = len(mesh.vertices), len(mesh.triangles), self.owner.shape
        return api.Surface(
            api.address(mesh.vertices, np.float32, vertices, 3),
            api.address(mesh.triangles, np.int32, triangles, 3),
            api.address(mesh.uv, np.float32, triangles, 3, 2),
            api.address(mesh.normals, np.float32, triangles, 3, 3),
            api.address(self.texel_normals, np.float32, height, width, 3),
            api.address(mesh.faces, np.float32, triangles, 3),
            api.address(mesh.spacing, np.float32, triangles),
            api.address(self.owner, np.int32, height, width),
            vertices,
            triangles,
            width,
            height,
        )
