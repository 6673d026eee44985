"""A mesh's texels and their filter."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core.base.arrays import Doubles, Floats
from ...core.rays.texel_surface import TexelSurface
from ...core.scene.scene import Mesh
from ...core.scene.world_mesh import world_surface
from ...core.solve.surface_filter import SurfaceFilter
from ...core.texels.rasterize import rasterize
from . import shapes


class Sheet:
    """Of a mesh where it is."""

    def __init__(self, mesh: Mesh, side: int = 64) -> None:
        assert mesh.uv is not None
        self.owner = rasterize(mesh.name, mesh.uv, side, side).owner
        self.owned = self.owner >= 0
        self.surface = TexelSurface(world_surface(shapes.instance(mesh), np.zeros(3)), self.owner)
        self.surface_filter = SurfaceFilter(self.surface)
        self.places = self.surface.positions.astype(np.float64)
        self.normals = self.surface.normals.astype(np.float64)
        self.face_normals: Doubles = np.where(
            self.owned[..., None], shapes.face_normals(mesh)[np.maximum(self.owner, 0)], 0.0
        )

    def filter(self, value: Doubles | Floats, noise: float, **settings: Any) -> Floats:
        """Of values that have each this variance."""
        ones = self.owned.astype(np.float32)
        filtered, _ = self.surface_filter.filter(value.astype(np.float32), np.float32(noise) * ones, ones, **settings)
        return filtered

    def noisy(self, truth: Doubles, deviation: float, seed: int) -> Doubles:
        """The values with normal noise on owned texels, not clipped."""
        noise = deviation * np.random.default_rng(seed).standard_normal(truth.shape)
        return np.where(self.owned, truth + noise, 0.0)

    def spacing(self) -> Doubles:
        """(H, W): the side of a square as large as a texel is on its triangle, its mean over blocks of 4 x 4 texels,
        which the sides of the image are multiples of."""
        mesh, (height, width) = self.surface.mesh, self.owner.shape
        assert mesh.uv is not None
        a, b, c = (mesh.vertices[mesh.triangles[:, corner]].astype(np.float64) for corner in range(3))
        place = mesh.uv.astype(np.float64) * (width, height)
        p, q = place[:, 1] - place[:, 0], place[:, 2] - place[:, 0]
        texels = np.abs(p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0])
        sides: Doubles = np.sqrt(np.linalg.norm(np.cross(b - a, c - a), axis=1) / texels)
        owned = self.owned.astype(np.float64)
        sums, counts = (
            each.reshape(height // 4, 4, width // 4, 4).sum(axis=(1, 3))
            for each in (owned * sides[np.maximum(self.owner, 0)], owned)
        )
        means: Doubles = sums / np.maximum(counts, 1.0)
        return means.repeat(4, axis=0).repeat(4, axis=1)


def ramp(sheet: Sheet) -> Doubles:
    """A function of the place alone, linear."""
    values: Doubles = 0.5 + 0.2 * sheet.places[..., 0] - 0.1 * sheet.places[..., 1] + 0.07 * sheet.places[..., 2]
    return np.where(sheet.owned, values, 0.0)


def rms(numbers: Doubles) -> float:
    return float(np.sqrt(np.mean(numbers**2)))
