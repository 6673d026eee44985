"""Directional codes of a surface's texels: visibility traced in the cells of the hemisphere, and what is kept of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from ..base.arrays import Floats, Ints, Longs
from ..base.errors import InputError
from ..base.kernel_api import Control
from ..rays.map_spec import reflection
from ..rays.texel_surface import TexelSurface
from ..rays.trace_scene import TraceScene
from ..rays.tracer import TraceOptions, trace_cells, trace_texels
from ..spherical.directional_format import DirectionalFormat, encode, rebuild
from ..texels.rasterize import in_bands
from ..texels.tangent_space import TexelFrames, world_tangents
from . import probes
from .probes import Error

TOLD_EXPONENT = 10.0  # of the RO whose error tells of a code's
FEWEST_RAYS, MOST_RAYS = 256, 1 << 16
_SIDE = 16  # the cells that are traced, whatever is kept: they cost nothing more
_BAND = 1 << 16  # texels at a time: 64 MB of cells
_TILE = 8  # texels along the side of what is traced together


@dataclass(frozen=True)
class DirectionalSettings:
    """A code, and the rays of each texel that it is made of: a power of two. Raises InputError for another number."""

    format: DirectionalFormat
    rays: int = FEWEST_RAYS

    def __post_init__(self) -> None:
        if not FEWEST_RAYS <= self.rays <= MOST_RAYS or self.rays & (self.rays - 1):
            raise InputError(
                f"{self.format.name} by {self.rays} rays: give a power of two from {FEWEST_RAYS} to {MOST_RAYS}"
            )


@dataclass(frozen=True, eq=False)
class DirectionalBaker:
    """What codes are traced in. options: how, by what seed; their number of rays is the settings'."""

    scene: TraceScene
    surface: TexelSurface
    frames: TexelFrames
    options: TraceOptions

    def values(
        self, settings: DirectionalSettings, enter: Callable[[float, float], Control]
    ) -> Iterator[tuple[Longs, Floats]]:
        """Texels, y · W + x, and their codes, (N, count) float32, band by band.

        enter: called before each, with the shares of all that are done before and after it, for its kernel call's
        control. Raises InputError without tangents, Cancelled.
        """
        texels = _by_tile(self.surface.owner)
        for number, these in enumerate(in_bands(texels, _BAND)):
            before = number * _BAND
            control = enter(before / len(texels), (before + len(these)) / len(texels))
            tangents = world_tangents(self.frames.frames(these), self.frames.target.matrix)
            how = replace(self.options, count=settings.rays, seed=self.options.seed + number * _BAND)
            cells = trace_cells(self.scene, self.surface, these, tangents, _SIDE, how, control=control)
            yield these, encode(cells, settings.format)

    def error(self, values: Floats, settings: DirectionalSettings, seed: int) -> Error:
        """That of RO about the normal, rebuilt at the told exponent from (H, W, count) values."""
        shape = self.surface.owner.shape
        texels, weight = probes.place(np.zeros(shape, dtype=np.float32), self.surface.covered, seed)
        spec, draws = reflection(TOLD_EXPONENT), iter(range(2))

        def trace(listed: Longs, rays: int) -> Floats:
            how = replace(self.options, count=rays, seed=seed + 1 + next(draws))
            return trace_texels(self.scene, self.surface, listed, (spec,), how).all

        lane_rays = probes.rays_for(0.02)
        probed = probes.draw(texels, weight, lane_rays, trace, spec.accumulator.totals)
        rebuilt = np.zeros(shape, dtype=np.float32)
        at = values.reshape(-1, settings.format.count)[probed.texels]
        upright = np.repeat(np.array([[0.0, 0.0, 1.0]]), len(at), axis=0)
        rebuilt.reshape(-1)[probed.texels] = rebuild(at, settings.format, upright, TOLD_EXPONENT)
        return probed.error(rebuilt)


def _by_tile(owner: Ints) -> Longs:
    """Owned texels, those of a tile one after the other: their rays run side by side."""
    texels = np.flatnonzero(owner >= 0)
    y, x = np.divmod(texels, owner.shape[1])
    return np.ascontiguousarray(texels[np.lexsort((x, y, x // _TILE, y // _TILE))])
