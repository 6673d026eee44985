"""From solved rows to finished images: what all maps of one object have in common."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..base.arrays import Doubles, Flags, Floats, Longs
from ..rays.map_spec import Axis, MapSpec
from ..rays.texel_surface import TexelSurface
from ..scene.scene import Camera
from ..solve.probes import Error
from ..spherical.environment import Environment, open_light
from ..texels.rasterize import in_bands
from ..texels.tangent_space import TexelFrames
from .baked import BakedMap, MapKind
from .margin import covered_mean, fill_margins

_BAND = 1 << 18  # texels that are worked on at a time


@dataclass(frozen=True, eq=False)
class MapFinisher:
    """surface: as it was traced; frames: as the images lie on the target. camera, environment: None where there are
    none."""

    surface: TexelSurface
    frames: TexelFrames
    coverage: Floats
    margin: int
    camera: Camera | None
    environment: Environment | None

    def finished(self, kind: MapKind, values: Floats, covered: Flags, error: Error, rays: int) -> BakedMap:
        """A map with its margin, written into `values`. covered: (H, W) bool, texels with a value."""
        coverage = np.where(covered, self.coverage, np.float32(0.0))
        mean = covered_mean(values, covered)
        made = BakedMap(values, covered, coverage, error.rmse, error.p99, mean, rays, kind)
        return with_margin(made, self.margin)

    def open_light(self, spec: MapSpec, covered: Flags) -> Floats:
        """(H, W, 3) float32: the light that an open surface would get, by a map's lobe."""
        assert self.environment is not None
        normals, light = self.surface.normals.reshape(-1, 3), np.zeros((*covered.shape, 3), dtype=np.float32)
        flat = light.reshape(-1, 3)
        for these in in_bands(np.flatnonzero(covered), _BAND):
            axes = normal = normals[these].astype(np.float64)
            if spec.axis is Axis.REFLECTED:
                axes = self._reflected(these, normal)
            flat[these] = open_light(self.environment, axes, normal, spec.exponent, threads=self.surface.threads)
        return light

    def _reflected(self, texels: Longs, normal: Doubles) -> Doubles:
        """(N, 3): where the camera's view of listed texels is mirrored to."""
        assert self.camera is not None
        view = self.camera.views(self.surface.positions.reshape(-1, 3)[texels].astype(np.float64))
        view = view / np.linalg.norm(view, axis=-1, keepdims=True)
        mirrored: Doubles = view - 2.0 * (view * normal).sum(axis=-1, keepdims=True) * normal
        return mirrored


def with_margin(made: BakedMap, margin: int) -> BakedMap:
    """The map with its charts' borders carried outward by so many texels, where its values may be averaged."""
    return replace(made, values=fill_margins(made.values, made.covered, margin)) if made.kind.mixes else made
