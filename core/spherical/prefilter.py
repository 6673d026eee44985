"""Sums of light from far away over lobes, with nothing in the way: the light of open surfaces.

The light is a number of points (light_clusters.py), the more the narrower the lobe. Of a point that the horizon cuts,
what is above it counts, at the middle of that. Surfaces of like axes are taken together, and of the points those that
their lobes reach.

Lobes about the normal are a smooth function of it, but for the edges that a sun gives it: where many are asked for, the
brightest points are summed for each, and the others come from a table.

Measured, against sums over 512 × 512 points and more, in skies with and without a sun: about the normal within 2e-5 of
the value for exponent 1, 2e-4 for 10, and from 100 on 2e-3 beside a sun; about other axes, which the horizon cuts, 4e-3
at most and 8e-4 in the root mean square.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from ..base import elementary
from ..base.arrays import Doubles, Floats, Longs, Reals
from ..base.elementary import arccos
from ..base.parallel import for_each
from ..base.vectors import dot, length_of
from .direction_table import SphereTable
from .light_clusters import LightClusters, light_clusters, products
from .octahedral_map import cell_of, octahedral

_COARSEST, _FINEST = 64, 1024  # points along the map's side; twice as many about the normal, where a table is made
_POINTS = 8.0  # along the map's side, times the root of the exponent
_NARROWEST = 2e4  # narrower lobes are taken for this one: it is within half a degree
_NOTHING = 1e-5  # of a lobe's height
_BINS = 16  # along the map's side, of like axes
_TOGETHER = 1 << 16  # surfaces times points at a time, which the processor's cache holds
_ROWS = 20.0  # of the table, times the root of the exponent
_FEWEST_ROWS = 64
_BRIGHT = 16.0  # times the mean of the points


class PrefilteredEnvironment:
    """radiance: (n, n, 3), luminance: (n, n), of an octahedral map."""

    def __init__(self, radiance: Floats, luminance: Doubles) -> None:
        self._radiance, self._luminance = radiance, luminance
        self._points: dict[int, LightClusters] = {}
        self._tables: dict[float, tuple[LightClusters, SphereTable]] = {}

    def gathered(self, axes: Doubles, normals: Doubles, exponent: float, threads: int = 0) -> Doubles:
        """∫ L (e+1)/(2π) max(a·ω, 0)^e dω over the hemisphere of each normal: axes, normals (N, 3) → (N, 3) float64."""
        exponent = min(exponent, _NARROWEST)
        if axes is not normals:
            return _sums(self._fit_for(exponent, _COARSEST), axes, normals, exponent, threads)
        rows = _power_of_two(_ROWS * np.sqrt(exponent), _FEWEST_ROWS)
        if exponent < 1.0 or len(axes) < 2 * rows * rows:
            return _sums(self._fit_for(exponent, 2 * _COARSEST), axes, axes, exponent, threads)
        bright, table = self._table(exponent, rows, threads)
        return table(axes) + _sums(bright, axes, axes, exponent, threads)

    def _fit_for(self, exponent: float, least: int) -> LightClusters:
        finest = max(_FINEST, len(self._radiance))
        side = min(_power_of_two(_POINTS * np.sqrt(exponent), least), finest)
        if side not in self._points:
            self._points[side] = light_clusters(self._radiance, self._luminance, side)
        return self._points[side]

    def _table(self, exponent: float, rows: int, threads: int) -> tuple[LightClusters, SphereTable]:
        """The brightest points, and the table of the others, about the normal."""
        if exponent not in self._tables:
            points = self._fit_for(exponent, 2 * _COARSEST)
            energy = points.energy.sum(axis=1)
            bright = energy > _BRIGHT * energy.sum() / max(len(energy), 1)
            rest = points.part(~bright)
            table = SphereTable(lambda ways: _sums(rest, ways, ways, exponent, threads), rows)
            self._tables[exponent] = points.part(bright), table
        return self._tables[exponent]


def _power_of_two(wanted: float, least: int) -> int:
    return max(least, 1 << int(np.ceil(np.log2(max(wanted, 1.0)))))


def _sums(points: LightClusters, axes: Doubles, normals: Doubles, exponent: float, threads: int) -> Doubles:
    """(N, 3) float64, whatever the number of threads."""
    light = np.zeros((len(axes), 3))

    def gather(alike: Longs) -> None:
        near = _reached(points, axes[alike], exponent)
        count = max(_TOGETHER // (len(near.width) + 1), 8)
        for start in range(0, len(alike), count):
            these = alike[start : start + count]
            light[these] = _sum(near, axes[these], None if normals is axes else normals[these], exponent)

    for_each(gather, _alike(axes), threads)
    light *= (exponent + 1.0) / (2.0 * np.pi)
    return light


def _alike(axes: Doubles) -> Iterator[Longs]:
    """All indices, those of like axes together."""
    bins = cell_of(octahedral(axes), _BINS)
    order = np.argsort(bins, kind="stable")
    ends = np.searchsorted(bins[order], np.arange(_BINS * _BINS + 1, dtype=np.int64))
    return (order[start:end] for start, end in pairwise(ends) if start < end)


def _reached(points: LightClusters, axes: Doubles, exponent: float) -> LightClusters:
    """The points that lobes about these axes reach."""
    middle = axes.mean(axis=0)
    middle /= length_of(middle)
    angle = arccos(np.clip(dot(points.mean, middle), -1.0, 1.0))
    lobe = arccos(elementary.power(_NOTHING, 1.0 / exponent)) if exponent > 0.0 else 0.5 * np.pi
    reach = lobe + arccos(np.clip(dot(axes, middle).min(), -1.0, 1.0))
    return points.part(angle - points.width < reach)


def _sum(points: LightClusters, axes: Doubles, normals: Doubles | None, exponent: float) -> Doubles:
    """Σ energy times the lobe, over what of each point is above the horizon. normals None: as the axes."""
    real = np.float32 if exponent < 1e3 else np.float64  # cosines of narrow lobes need their digits
    mean: Reals = points.mean.T.astype(real)
    covariance: Reals = points.covariance.T.astype(real)
    cosine: Reals = _product(axes.astype(real), mean)
    variance: Reals = _product((products(axes) * np.repeat([1.0, 2.0], 3)).astype(real), covariance)
    width: Reals = points.width.astype(real)
    if normals is None:
        if exponent >= 1.0:
            width = np.sqrt(12.0 * np.maximum(variance, 1e-13))
        above, lean = _above(cosine, width), 1.0
    else:
        above = _above(_product(normals.astype(real), mean), width)
        lean = (axes * normals).sum(axis=1, keepdims=True).astype(real)
    if exponent < 1.0:  # such a lobe ends in a step, as the horizon does
        above = np.minimum(above, _above(cosine, width))
    cosine += (1.0 - above) * (0.5 * lean * width)  # at the middle of what is above
    if exponent != 1.0:
        cosine += 0.5 * (exponent - 1.0) * variance / np.maximum(cosine, width)
    lobe = _power(cosine, exponent)
    lobe *= above
    light = [(lobe * channel).sum(axis=1) for channel in points.energy.T.astype(real)]
    gathered: Doubles = np.stack(light, axis=1).astype(np.float64)
    return gathered


def _product(rows: Reals, columns: Reals) -> Reals:
    """(N, K) times (K, P) → (N, P), term by term, for a small K (vectors.py says why)."""
    result: Reals = np.multiply(rows[:, :1], columns[0])
    for term in range(1, len(columns)):
        result += rows[:, term : term + 1] * columns[term]
    return result


def _above(height: Reals, width: Reals) -> Reals:
    """What share of points of these widths is above the horizon."""
    share = height / width
    share += 0.5
    return np.clip(share, 0.0, 1.0, out=share)


def _power(cosines: Reals, exponent: float) -> Reals:
    """cosᵉ; as good as 0 below 0. The cosines are let go."""
    np.maximum(cosines, 0.0 if exponent == 1.0 else 1e-6, out=cosines)
    if exponent == 1.0:
        return cosines
    return elementary.powers(cosines, exponent) if cosines.dtype == np.float32 else elementary.power(cosines, exponent)
