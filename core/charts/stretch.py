"""How much a chart layout distorts a surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.arrays import Doubles
from ..base.triangles import area_of, square, tangents, uv_area_of


@dataclass(frozen=True)
class Stretch:
    """Distortion of a chart layout; 1 is none. Weighted by area on the surface, after one scale for the whole layout.

    l2 and p95: root mean square and 95th percentile of the L2 stretch of Sander et al. 2001, "Texture Mapping
    Progressive Meshes". area: mean of max(a, 1/a), a a triangle's share of the surface over its share of the layout.
    angle: mean of (s + 1/s)/2, s the ratio of the singular values of the map.
    """

    l2: float
    p95: float
    area: float
    angle: float


def stretch_of(corners: Doubles, uv: Doubles) -> Stretch:
    """Of triangles on the surface (T, 3, 3) and in the layout (T, 3, 2), in units that are as long across as up; those
    without an area or mirrored there are left out. All infinite where none is left."""
    surface, drawn = area_of(corners), uv_area_of(uv)
    good = (drawn > 0.0) & (surface > 0.0)
    if not good.any():
        return Stretch(np.inf, np.inf, np.inf, np.inf)
    area, flat = surface[good], drawn[good]
    along_u, along_v = tangents(corners[good], uv[good])
    energy = 0.5 * (square(along_u) + square(along_v))  # half the sum of the singular values' squares
    product = area / flat  # of the singular values
    scale = area.sum() / flat.sum()
    l2 = np.sqrt(energy / scale)
    order = np.argsort(l2, kind="stable")
    rank = np.searchsorted(np.cumsum(area[order]), 0.95 * area.sum())
    ratio = product / scale
    return Stretch(
        l2=float(np.sqrt(np.average(l2**2, weights=area))),
        p95=float(l2[order][min(rank, len(order) - 1)]),
        area=float(np.average(np.maximum(ratio, 1.0 / ratio), weights=area)),
        angle=float(np.average(energy / product, weights=area)),
    )
