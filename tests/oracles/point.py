"""Occlusion at a point, by the bake's own way: texels of a patch over which nothing changes, and the kernel."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from ...core.base.arrays import Doubles
from ...core.rays.embree import open_device
from ...core.rays.map_spec import MapSpec
from ...core.rays.occluders import Occluders
from ...core.rays.ray_options import RayOptions
from ...core.rays.texel_surface import TexelSurface
from ...core.rays.tracer import TraceOptions, trace
from ...core.scene.scene import Camera, Instance
from ...core.scene.world_mesh import world_surface
from ...core.texels.rasterize import rasterize

TEXELS = 8  # along a side: one tile, whose texels complete one another's rays


class Point:
    """The texels of a small receiver among occluders, ready to be traced again and again.

    The receiver blocks nothing unless it is one of the occluders. distance: scene units, None for no limit. camera:
    world space.
    """

    def __init__(
        self,
        receiver: Instance,
        occluders: Sequence[Instance],
        *,
        distance: float | None = None,
        camera: Camera | None = None,
        texels: int = TEXELS,
    ) -> None:
        assert receiver.mesh.uv is not None
        self._limits = RayOptions(distance)
        built = Occluders(open_device(), occluders, self._limits)
        assert not any("it does not occlude" in line for line in built.warnings), built.warnings
        frame = built.frame_for(receiver)
        self._scene = frame.scene
        owner = rasterize(receiver.name, receiver.mesh.uv, texels, texels).owner
        self._surface = TexelSurface(world_surface(receiver, frame.origin), owner)
        self._camera = camera and camera.about(frame.origin)

    def values(self, estimators: Sequence[MapSpec], rays: int, seed: int = 0, packet_width: int = 0) -> Doubles:
        """(M, H, W) float64: each texel's estimate with that many rays; NaN where it faces away from the camera."""
        options = TraceOptions(rays, seed, self._limits, packet_width=packet_width, camera=self._camera)
        sums = trace(self._scene, self._surface, estimators, options, halves=False).all
        return np.where(sums < 0.0, np.nan, sums.astype(np.float64) / rays)

    def means(self, estimators: Sequence[MapSpec], rays: int, seeds: Iterable[int] = range(16)) -> Doubles:
        """(S, M) float64: the mean over the texels, a row a seed. Seeds are independent; texels of one are not."""
        return np.array([self.values(estimators, rays, seed).mean(axis=(1, 2)) for seed in seeds])
