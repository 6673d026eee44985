"""Directional codes of a surface's texels: visibility traced in the cells of the hemisphere, and what is kept of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..base.errors import InputError
from ..rays.accumulators import Counts
from ..rays.kernel_api import Control
from ..rays.map_spec import reflection
from ..rays.tracer import Rays, TraceScene, trace_cells, trace_texels
from ..scene.scene import Floats, Ints, Placed
from ..spherical.directional_format import Code, encode, rebuild
from ..texels.rasterize import in_bands
from ..texels.tangent_space import Texture, world_tangents
from . import probes
from .probes import Error

TOLD_EXPONENT = 10.0  # of the RO whose error tells of a code's
FEWEST_RAYS, MOST_RAYS = 256, 1 << 16
_SIDE = 16  # the cells that are traced, whatever is kept: they cost nothing more
_BAND = 1 << 16  # texels at a time: 64 MB of cells
_TILE = 8  # texels along the side of what is traced together


@dataclass(frozen=True)
class Coding:
    """A code, and the rays of each texel that it is made of: a power of two. Raises InputError for another number."""

    code: Code
    rays: int = FEWEST_RAYS

    def __post_init__(self) -> None:
        if not FEWEST_RAYS <= self.rays <= MOST_RAYS or self.rays & (self.rays - 1):
            raise InputError(
                f"{self.code.name} by {self.rays} rays: give a power of two from {FEWEST_RAYS} to {MOST_RAYS}"
            )


@dataclass(frozen=True, eq=False)
class Coder:
    """What codes are traced in. rays: how, by what seed; their number is the coding's."""

    scene: TraceScene
    surface: Placed
    owner: Ints
    texture: Texture
    rays: Rays

    def values(
        self, coding: Coding, enter: Callable[[float, float], Control]
    ) -> Iterator[tuple[NDArray[np.int64], Floats]]:
        """Texels, y · W + x, and their codes, (N, count) float32, band by band.

        enter: called before each, with the shares of all that are done before and after it, for its kernel call's
        control. Raises InputError without tangents, Cancelled.
        """
        texels = _by_tile(self.owner)
        for number, these in enumerate(in_bands(texels, _BAND)):
            before = number * _BAND
            control = enter(before / len(texels), (before + len(these)) / len(texels))
            tangents = world_tangents(self.texture.frames(these), self.texture.target.matrix)
            how = replace(self.rays, count=coding.rays, seed=self.rays.seed + number * _BAND)
            cells = trace_cells(self.scene, self.surface, self.owner, these, tangents, _SIDE, how, control=control)
            yield these, encode(cells, coding.code)

    def error(self, values: Floats, coding: Coding, seed: int) -> Error:
        """That of RO about the normal, rebuilt at the told exponent from (H, W, count) values."""
        covered = self.owner >= 0
        texels, weight = probes.place(np.zeros(self.owner.shape, dtype=np.float32), covered, seed)
        estimator, draws = reflection(TOLD_EXPONENT), iter(range(2))

        def trace(listed: NDArray[np.int64], rays: int) -> Floats:
            how = replace(self.rays, count=rays, seed=seed + 1 + next(draws))
            return trace_texels(self.scene, self.surface, self.owner, listed, (estimator,), how)

        lane_rays = probes.rays_for(0.02)
        probed = probes.draw(texels, weight, lane_rays, trace, Counts.VISIBILITY.totals)
        rebuilt = np.zeros(self.owner.shape, dtype=np.float32)
        at = values.reshape(-1, coding.code.count)[probed.texels]
        upright = np.repeat(np.array([[0.0, 0.0, 1.0]]), len(at), axis=0)
        rebuilt.reshape(-1)[probed.texels] = rebuild(at, coding.code, upright, TOLD_EXPONENT)
        return probed.error(rebuilt)


def _by_tile(owner: Ints) -> NDArray[np.int64]:
    """Owned texels, those of a tile one after the other: their rays run side by side."""
    texels = np.flatnonzero(owner >= 0)
    y, x = np.divmod(texels, owner.shape[1])
    return np.ascontiguousarray(texels[np.lexsort((x, y, x // _TILE, y // _TILE))])
