"""Several objects in one image: their bakes put together, each as soon as it is there."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..base.arrays import Floats
from ..base.digest import digest
from .baked import Baked, BakedMap, SurfaceReport
from .map_finisher import with_margin
from .margin import covered_mean


class Atlas:
    """Bakes of several objects, of one size and with the same maps, as one image; none of them is kept.

    A texel that several cover shows the last of them, and counts as overlapped. The error is that over the texels of
    all; its p99 is the largest of theirs, and so a bound.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._whole: Baked | None = None
        self._maps: dict[str, _Map] = {}
        self._inputs: list[str] = []

    def add(self, part: Baked) -> None:
        """The next object's bake."""
        for name, each in part.maps.items():
            self._maps.setdefault(name, _Map(each)).add(each)
        self._inputs.append(part.inputs)
        whole = self._whole or Baked(self._name, part.size, SurfaceReport(), 0, {})
        whole.surface = _together(whole.surface, part.surface)
        whole.rays += part.rays
        whole.warnings += part.warnings
        for stage, took in part.seconds.items():
            whole.seconds[stage] = whole.seconds.get(stage, 0.0) + took
        self._whole = whole

    def finish(self, margin: int) -> Baked:
        """All of them, after at least one. margin: texels by which the charts' borders are carried outward."""
        whole = self._whole
        assert whole is not None
        shared = next(iter(self._maps.values())).shared
        whole.inputs = atlas_inputs(self._inputs, margin)
        whole.maps = {name: each.finish(margin) for name, each in self._maps.items()}
        if shared:
            whole.surface.texels -= shared
            whole.surface.overlapped += shared
            whole.warnings.append(
                f"{self._name}: objects overlap one another in the UV map on {shared} of {whole.texels} texels; "
                "each shows one of them: bake with new charts, or move them apart"
            )
        return whole


def atlas_inputs(parts: Sequence[str], margin: int) -> str:
    """The hash of what an atlas depends on, by those of its parts in order; empty where one is."""
    return digest(parts, margin).hex() if all(parts) else ""


class _Map:
    """One map of all. shared: texels that more than one object covers."""

    def __init__(self, first: BakedMap) -> None:
        self.values, self.covered = np.zeros_like(first.values), np.zeros_like(first.covered)
        self.coverage: Floats = np.zeros_like(first.coverage)
        self.shared = self.rays = self.count = 0
        self.squares = self.p99 = 0.0
        self.kind = first.kind

    def add(self, part: BakedMap) -> None:
        count = int(np.count_nonzero(part.covered))
        self.shared += int(np.count_nonzero(self.covered & part.covered))
        self.values[part.covered] = part.values[part.covered]
        self.covered |= part.covered
        self.coverage += part.coverage
        self.squares += count * part.error**2
        self.count += count
        self.p99 = max(self.p99, part.p99)
        self.rays += part.rays

    def finish(self, margin: int) -> BakedMap:
        covered = self.covered
        whole = BakedMap(
            values=self.values,
            covered=covered,
            coverage=np.minimum(self.coverage, np.float32(1.0)),
            error=float(np.sqrt(self.squares / max(self.count, 1))),
            p99=self.p99,
            mean=covered_mean(self.values, covered),
            rays=self.rays,
            kind=self.kind,
        )
        return with_margin(whole, margin)


def _together(a: SurfaceReport, b: SurfaceReport) -> SurfaceReport:
    """Of both; shares count by their texels."""

    def mean(of_a: float, of_b: float) -> float:
        return (of_a * a.texels + of_b * b.texels) / max(a.texels + b.texels, 1)

    return SurfaceReport(
        a.texels + b.texels,
        a.overlapped + b.overlapped,
        mean(a.interior, b.interior),
        {sight: mean(a.sights.get(sight, 0.0), b.sights.get(sight, 0.0)) for sight in {**a.sights, **b.sights}},
    )
