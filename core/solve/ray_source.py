"""Where a map's rays come from, as the solver sees it."""

from __future__ import annotations

from typing import Protocol

from ..base.arrays import Floats, Ints, Longs
from ..base.kernel_api import Control
from ..rays.map_spec import MapSpec
from .surface_filter import SurfaceFilter


class RaySource(Protocol):
    """What traces one map. All may raise Cancelled and MemoryError."""

    @property
    def spec(self) -> MapSpec:
        """The map's."""

    @property
    def filter(self) -> SurfaceFilter:
        """Built when first asked for."""

    def filter_of(self, owner: Ints) -> SurfaceFilter:
        """One of some of the texels, those with an owner, (H, W) int32."""

    def trace(self, blocks: Longs, before: int, rays: int) -> tuple[Floats, Floats]:
        """Trace so many rays of the texels of N blocks (blocks.py), after `before` of the sequences that they have: the
        map's rows times the rays (accumulators.py), over all, and over those of the first half of before + rays. Both
        are (R, N, 16) float32, anything where there is no texel; -1 where one faces away."""

    def probe(self, texels: Longs, rays: int) -> Floats:
        """Trace so many rays of listed texels, others at each call: sums, (images, N) float32."""

    def enter(self, stage: str) -> Control | None:
        """Begin a stage of the work; its control."""

    def show(self, values: Floats) -> None:
        """Take the map, (H, W) float32, as it is after a round."""
