"""Several objects in one image: their bakes put together."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .bake import Baked, BakedMap
from .finish import fill_margin
from .scene import Floats


def in_one(name: str, parts: Sequence[Baked], margin: int) -> Baked:
    """The bakes of several objects, of one size and with the same maps, as one image. margin: texels, filled anew.

    A texel that several cover shows the last of them, and counts as overlapped. The error is that over the texels of
    all; its p99 is the largest of theirs, and so a bound.
    """
    first = parts[0]
    maps = {key: _map_of([each.maps[key] for each in parts], margin) for key in first.maps}
    texels = int(np.count_nonzero(next(iter(maps.values())).covered))
    shared = sum(each.texels for each in parts) - texels if len(parts) > 1 else 0
    overlapped = sum(each.overlapped for each in parts) + shared
    weights = [each.texels / max(sum(each.texels for each in parts), 1) for each in parts]
    inside, turned = (
        sum(weight * float(getattr(each, share)) for weight, each in zip(weights, parts, strict=True))
        for share in ("inside", "turned")
    )
    seconds: dict[str, float] = {}
    for each in parts:
        for stage, took in each.seconds.items():
            seconds[stage] = seconds.get(stage, 0.0) + took
    warnings = [line for each in parts for line in each.warnings]
    if shared > 0:
        warnings.append(
            f"{name}: objects overlap one another in the UV map on {shared} of {texels} texels; "
            "each shows one of them: bake with new charts, or move them apart"
        )
    rays = sum(each.rays for each in parts)
    return Baked(name, first.width, first.height, texels, rays, maps, inside, overlapped, turned, seconds, warnings)


def _map_of(parts: Sequence[BakedMap], margin: int) -> BakedMap:
    values, covered = np.zeros_like(parts[0].values), np.zeros_like(parts[0].covered)
    coverage: Floats = np.zeros_like(parts[0].coverage)
    for each in parts:
        values[each.covered] = each.values[each.covered]
        covered |= each.covered
        coverage += each.coverage
    counts = [int(np.count_nonzero(each.covered)) for each in parts]
    squares = sum(count * each.error**2 for count, each in zip(counts, parts, strict=True))
    return BakedMap(
        values=fill_margin(values, covered, margin),
        covered=covered,
        coverage=np.minimum(coverage, np.float32(1.0)),
        error=float(np.sqrt(squares / max(sum(counts), 1))),
        p99=max(each.p99 for each in parts),
        mean=float(values[covered].mean(dtype=np.float64)) if covered.any() else 1.0,
        rays=sum(each.rays for each in parts),
    )
