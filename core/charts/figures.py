"""What there is to say of a chart layout that was made."""

from __future__ import annotations

import math
from dataclasses import dataclass

from .stretch import Stretch


@dataclass(frozen=True)
class ChartFigures:
    """count: of charts. used: the share of the image that they cover. padding: texels kept free between them, of so
    many wanted."""

    count: int
    stretch: Stretch
    used: float
    padding: int
    wanted: int

    def in_words(self) -> str:
        """For a line, after the number of charts: "stretch 1.012 (95 % within 1.047), 64 % of the image used"."""
        parts = [f"{100.0 * self.used:.0f} % of the image used"]
        if math.isfinite(self.stretch.l2):
            parts.insert(0, f"stretch {self.stretch.l2:.3f} (95 % within {self.stretch.p95:.3f})")
        if self.padding < self.wanted:
            parts.append(f"{self.padding} of {self.wanted} texels between charts")
        return ", ".join(parts)

    def as_json(self, uv_map: str) -> dict[str, str | int | float | None]:
        """For a report. uv_map: where they are."""
        measured = math.isfinite(self.stretch.l2)
        return {
            "uv_map": uv_map,
            "count": self.count,
            "stretch": self.stretch.l2 if measured else None,
            "stretch_p95": self.stretch.p95 if measured else None,
            "used": self.used,
            "padding": self.padding,
        }
