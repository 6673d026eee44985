"""Looking the measured curves up."""

from __future__ import annotations

from collections.abc import Sequence

from .convergence import Curve


class Figures:
    """The curves of a study by what they are of."""

    def __init__(self, curves: Sequence[Curve]) -> None:
        self.curves = list(curves)

    def of(self, point: str, exponent: float, tilt: float) -> list[Curve]:
        """All estimators and both sets of one map at one point."""
        return [c for c in self.curves if (c.case.point, c.case.exponent, c.case.tilt) == (point, exponent, tilt)]

    def one(self, point: str, exponent: float, tilt: float, name: str, kind: str) -> Curve:
        """A single curve."""
        return next(c for c in self.of(point, exponent, tilt) if c.case.name == name and c.set == kind)
