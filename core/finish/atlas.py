"""Several objects in one image: their bakes put together, each as soon as it is there."""

from __future__ import annotations

import numpy as np

from ..bake import Baked
from ..scene.scene import Floats
from .map_finisher import BakedMap, with_margin


class Atlas:
    """Bakes of several objects, of one size and with the same maps, as one image; none of them is kept.

    A texel that several cover shows the last of them, and counts as overlapped. The error is that over the texels of
    all; its p99 is the largest of theirs, and so a bound.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._whole: Baked | None = None
        self._maps: dict[str, _Map] = {}

    def add(self, part: Baked) -> None:
        """The next object's bake."""
        before = self._whole
        for name, each in part.maps.items():
            self._maps.setdefault(name, _Map(each)).add(each)
        whole = before or Baked(self._name, part.width, part.height, 0, 0, {})
        texels = whole.texels + part.texels
        whole.inside = _mean(whole.inside, whole.texels, part.inside, part.texels)
        whole.turned = _mean(whole.turned, whole.texels, part.turned, part.texels)
        whole.texels = texels
        whole.rays += part.rays
        whole.overlapped += part.overlapped
        whole.warnings += part.warnings
        for stage, took in part.seconds.items():
            whole.seconds[stage] = whole.seconds.get(stage, 0.0) + took
        self._whole = whole

    def finish(self, margin: int) -> Baked:
        """All of them, after at least one. margin: texels by which the charts' borders are carried outward."""
        whole = self._whole
        assert whole is not None
        shared = next(iter(self._maps.values())).shared
        whole.maps = {name: each.finish(margin) for name, each in self._maps.items()}
        if shared:
            whole.texels -= shared
            whole.overlapped += shared
            whole.warnings.append(
                f"{self._name}: objects overlap one another in the UV map on {shared} of {whole.texels} texels; "
                "each shows one of them: bake with new charts, or move them apart"
            )
        return whole


class _Map:
    """One map of all. shared: texels that more than one object covers."""

    def __init__(self, first: BakedMap) -> None:
        self.values, self.covered = np.zeros_like(first.values), np.zeros_like(first.covered)
        self.coverage: Floats = np.zeros_like(first.coverage)
        self.shared = self.rays = self.count = 0
        self.squares = self.p99 = 0.0
        self.mixes = first.mixes

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
            mean=float(self.values[covered].mean(dtype=np.float64)) if covered.any() else 1.0,
            rays=self.rays,
            mixes=self.mixes,
        )
        return with_margin(whole, margin)


def _mean(a: float, of_a: int, b: float, of_b: int) -> float:
    return (a * of_a + b * of_b) / max(of_a + of_b, 1)
