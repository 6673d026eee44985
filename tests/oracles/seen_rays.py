"""RO of any view, from what 16,384 rays of a point see: one in each of 128 x 128 cells of equal solid angle."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from ...core.base.arrays import Doubles, Flags, Floats, Ints, Reals
from ...core.base.vectors import unit
from ...core.rays.embree import open_device
from ...core.rays.occluders import Occluders
from ...core.rays.texel_surface import TexelSurface
from ...core.scene.scene import Scene
from ...core.scene.world_mesh import world_surface
from ...core.spherical.hemisphere_cells import directions
from ...core.spherical.lobe import open_horizon

RAYS_A_SIDE = 128
_LIFT = 2.0**-18  # of the largest coordinate: how far above the surface rays start


@dataclass(frozen=True, eq=False)
class Seen:
    """N surface points. frames: (N, 3, 3) float64, rows tangent, bitangent and normal. visible: (N, R²) bool, V along
    `ray_ways` in each frame."""

    frames: Doubles
    visible: Flags

    @property
    def cells(self) -> Floats:
        """(N, 16, 16) float32: the means of the rays in each cell."""
        within = RAYS_A_SIDE // 16
        means: Floats = self.visible.reshape(-1, 16, within, 16, within).mean(axis=(2, 4), dtype=np.float32)
        return means

    def truth(self, views: Doubles, exponent: float) -> Doubles:
        """RO of each point and view: the sum over the rays, weighted by the lobe. (N, V) float64."""
        lobes = np.maximum(views @ ray_ways().T, 0.0) ** exponent
        lobes *= (open_horizon(exponent, views[:, 2]) / lobes.sum(axis=1))[:, None]
        ro: Doubles = np.stack([lobes @ row for row in self.visible])
        return ro


@cache
def ray_ways() -> Doubles:
    """(R², 3): the directions in which every point is looked from, one by chance in each cell of the finest grid."""
    rng = np.random.default_rng(0)
    row, column = np.indices((RAYS_A_SIDE, RAYS_A_SIDE), dtype=np.int64)
    places = [(each + rng.random(each.shape)) / RAYS_A_SIDE for each in (column, row)]
    return directions(*places).reshape(-1, 3)


def seen_by(scene: Scene, owner: Ints, points: int) -> Seen:
    """Random texels of the scene's first target, by the tracer. owner: (H, W) int32 triangles."""
    target = scene.targets[0]
    frame = Occluders(open_device(), scene.occluders).frame_for(target)
    mesh = world_surface(target, frame.origin)
    surface = TexelSurface(mesh, owner)
    chosen = np.random.default_rng(0).choice(np.flatnonzero(owner >= 0), points, replace=False)
    places, normals = (each.reshape(-1, 3)[chosen].astype(np.float64) for each in (surface.positions, surface.normals))
    corners = mesh.vertices[mesh.triangles[owner.reshape(-1)[chosen]]].astype(np.float64)
    faces = unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    starts = (places + _LIFT * np.abs(corners).max(axis=(1, 2))[:, None] * faces).astype(np.float32)
    frames = frames_about(normals)
    ways = (np.ascontiguousarray(ray_ways() @ axes, dtype=np.float32) for axes in frames)
    seen = [frame.scene.visible(np.tile(start, (len(way), 1)), way) for start, way in zip(starts, ways, strict=True)]
    return Seen(frames, np.array(seen))


def frames_about(normals: Reals) -> Doubles:
    """(N, 3) unit normals → (N, 3, 3): rows tangent, bitangent and normal; any tangent will do."""
    helper = np.where(np.abs(normals[:, :1]) < 0.7, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    tangent = unit(np.cross(helper, normals))
    return np.stack([tangent, np.cross(normals, tangent), normals], axis=1)
