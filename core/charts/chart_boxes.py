"""Boxes about charts that are laid flat, along the direction in which each is spread most."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.arrays import Doubles, Longs
from ..base.triangles import uv_area_of


@dataclass(frozen=True, eq=False)
class ChartBoxes:
    """middle: (C, 2) the charts' centroids. along: (C, 2) unit directions. length, breadth: (C,) along and across."""

    middle: Doubles
    along: Doubles
    length: Doubles
    breadth: Doubles

    @property
    def area(self) -> Doubles:
        """(C,)."""
        return self.length * self.breadth

    @staticmethod
    def of(label: Longs, count: int, uv: Doubles) -> ChartBoxes:
        """label: (T,) charts, from 0 to count - 1. uv: (T, 3, 2)."""
        middle, along = _axes(label, count, uv)
        chart, off = np.repeat(label, 3), uv.reshape(-1, 2)
        spans = []
        for axis in (along, across(along)):
            at = (off * axis[chart]).sum(axis=1)
            low, high = np.full(count, np.inf), np.full(count, -np.inf)
            np.minimum.at(low, chart, at)
            np.maximum.at(high, chart, at)
            spans.append(high - low)
        return ChartBoxes(middle, along, spans[0], spans[1])


def diagonals(label: Longs, count: int, uv: Doubles) -> Doubles:
    """(C,) of the boxes about charts along u and v, quickly: no chart is longer in any direction."""
    order = np.argsort(label, kind="stable")
    starts = np.searchsorted(label[order], np.arange(count, dtype=np.int64))
    sides = [
        np.maximum.reduceat(uv[..., axis].max(axis=1)[order], starts)
        - np.minimum.reduceat(uv[..., axis].min(axis=1)[order], starts)
        for axis in range(2)
    ]
    return _length(*sides)


def across(along: Doubles) -> Doubles:
    """(C, 2) a quarter turn on from directions."""
    return np.stack([-along[:, 1], along[:, 0]], axis=1)


def _axes(label: Longs, count: int, uv: Doubles) -> tuple[Doubles, Doubles]:
    """(C, 2) each: the centroids, and the longer principal axes of the second moments of area."""
    weight, centre = np.maximum(uv_area_of(uv), 0.0), uv.mean(axis=1)
    total = np.maximum(np.bincount(label, weight, count), np.finfo(np.float64).tiny)[:, None]
    middle = np.stack([np.bincount(label, weight * centre[:, axis], count) for axis in range(2)], axis=1) / total
    off, central = uv - middle[label][:, None], centre - middle[label]

    def moment(a: int, b: int) -> Doubles:  # of a triangle: its corners' products once, its centroid's nine times
        products = (off[..., a] * off[..., b]).sum(axis=1) + 9.0 * central[:, a] * central[:, b]
        return np.asarray(np.bincount(label, weight * products, count))

    xx, xy, yy = moment(0, 0), moment(0, 1), moment(1, 1)
    along = np.stack([0.5 * (xx - yy) + _length(0.5 * (xx - yy), xy), xy], axis=1)
    along[(along == 0.0).all(axis=1)] = (0.0, 1.0)
    return middle, along / _length(*along.T)[:, None]


def _length(x: Doubles, y: Doubles) -> Doubles:
    """(C,) of vectors; numpy's hypot is the C library's, which rounds as it likes."""
    length: Doubles = np.sqrt(x * x + y * y)
    return length
