"""What charts are asked for."""

from __future__ import annotations

from dataclasses import dataclass

from ...core.charts.udim import Udim
from .chart_marks import ATLAS_MAP, CHART_MAP

CHARTS, SMART = "charts", "smart"  # as the UV map of the options: make one, by us or by Blender
PADDING = 4  # texels between charts


@dataclass(frozen=True)
class ChartRequest:
    """What charts to make. uv: as in the job's options. atlas: its name, or empty. smart: by Blender, as ours could not
    be made. size: of the image. udim: what UVs beyond the unit square are."""

    uv: str | None = None
    atlas: str = ""
    smart: bool = False
    size: tuple[int, int] = (1024, 1024)
    udim: Udim = Udim.AUTO

    @property
    def by_blender(self) -> bool:
        """Whether Blender unwraps."""
        return self.uv == SMART or self.smart

    @property
    def anew(self) -> bool:
        """Whether new charts are asked for, of all objects, be there any UV maps or not."""
        return self.uv in (CHARTS, SMART)

    @property
    def layer(self) -> str:
        """The UV map for charts."""
        return ATLAS_MAP if self.atlas else CHART_MAP

    @property
    def accepted(self) -> list[bool]:
        """Whose charts, made before, may stay: by Blender or not."""
        if self.uv == SMART:
            return [True]
        return [False] if self.uv == CHARTS and not self.smart else [False, True]
