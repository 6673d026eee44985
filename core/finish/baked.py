"""What a bake brings: finished maps, and what is known of the surface that they are of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

from ..base.arrays import Flags, Floats
from ..spherical.directional_format import DirectionalFormat
from ..texels.flipped_faces import Sight

Metadata = Mapping[str, str | int | float]


class MapKind(Protocol):
    """What finished maps are told apart by (core/maps)."""

    @property
    def name(self) -> str:
        """What files and reports call it: ao, ro_10, …"""

    @property
    def mixes(self) -> bool:
        """Whether values of texels may be averaged, as bytes of masks may not, which therefore have no margin."""

    @property
    def directional(self) -> DirectionalFormat | None:
        """The code that it is, in which it is stored; None for another map."""

    def description(self) -> Metadata:
        """What it is, for those who read the image."""


@dataclass(frozen=True, eq=False)
class BakedMap:
    """One finished image. values: (H, W) float32, or (H, W, C), with margins; covered: (H, W) bool; coverage: (H, W)
    float32, 0 in margins; error: measured RMSE over the covered texels, and p99 the error that 99 of 100 stay within
    (probes.py); mean: theirs, of all channels; rays: all that made it, but for those that measured its error. Values
    are 0 to 1, but for noise above 1 where the horizon was divided out and nothing filtered, and but for light.

    Of bent normals the error is the length of the difference, of small angles these in radians, each texel counted by
    its AO. Of light it is that of the share that gets through, as of its ratio."""

    values: Floats
    covered: Flags
    coverage: Floats
    error: float
    p99: float
    mean: float
    rays: int
    kind: MapKind

    @property
    def is_grey(self) -> bool:
        """Whether it is one number a texel."""
        return self.values.ndim == 2


@dataclass
class SurfaceReport:
    """texels: those with an owner. overlapped: those that show one of several faces. interior: the share of them, 0 to
    1, that lies inside other meshes (interior.py); their values are as traced. sights: shares by what their faces see
    (flipped_faces.py)."""

    texels: int = 0
    overlapped: int = 0
    interior: float = 0.0
    sights: Mapping[Sight, float] = field(default_factory=dict)

    @property
    def flipped(self) -> float:
        """The share that sees the backs of its own faces alone."""
        return self.sights.get(Sight.FLIPPED, 0.0)

    @property
    def buried(self) -> float:
        """The share of which the backs see such, too."""
        return self.sights.get(Sight.BURIED, 0.0)


@dataclass(eq=False)
class Baked:
    """One baked object, or an atlas of several. size: width and height. rays: those of all its maps. maps: by name.
    seconds: by stage. tile: of a UDIM layout, None where there is none. inputs: the hash of what it depends on
    (input_hash.py), empty where that was not asked for."""

    name: str
    size: tuple[int, int]
    surface: SurfaceReport
    rays: int
    maps: dict[str, BakedMap]
    seconds: dict[str, float] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)
    tile: int | None = None
    inputs: str = ""

    @property
    def texels(self) -> int:
        """Those with an owner."""
        return self.surface.texels
