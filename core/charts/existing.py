"""Charts that exist already, of one mesh or several, laid side by side in one image: cut, shaped and stacked as they
are, each mesh at a scale of its own, so that all get the same texels a square metre."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..base.arrays import Doubles, Floats, Longs
from ..base.errors import InputError
from ..base.kernel_api import Control
from ..base.triangles import uv_area_of
from .overlaps import MOST, overlapping
from .packing import packed
from .stages import Stages, Tell

_OVERLAP = 1e-4  # of the unit square, a tenth of a texel of 1024: charts that meet by less lie beside one another
_NOWHERE = -1


@dataclass(frozen=True, eq=False)
class ExistingCharts:
    """The UV map of a mesh.

    uv: (T, 3, 2) float32. triangles: (T, 3) vertices, numbered as one where they are in one place. area: (T,) of the
    triangles on the surface, as large as they are in the world. are_copies: charts in other tiles than the first lie
    upon those in it, moved aside.
    """

    uv: Floats
    triangles: Longs
    area: Doubles
    are_copies: bool = False

    @property
    def drawn_areas(self) -> Doubles:
        """(T,) in the UV map; 0 for triangles that have none on the surface, or are not finite."""
        with np.errstate(invalid="ignore"):
            drawn = np.abs(uv_area_of(self.uv.astype(np.float64)))
        return np.where(np.isfinite(drawn) & (self.area > 0.0), drawn, 0.0)

    @property
    def scale(self) -> float:
        """Metres that the map is wide, over all of it and not by charts; 0 where none of it has an area."""
        drawn = self.drawn_areas
        total = float(drawn.sum())
        return float(np.sqrt(self.area[drawn > 0.0].sum() / total)) if total > 0.0 else 0.0


@dataclass(frozen=True, eq=False)
class SideBySide:
    """uv: for each map (T, 3, 2) float32 in the unit square, which is the whole image. count: of charts, those upon one
    another being one. padding: texels kept free between them."""

    uv: list[Floats]
    count: int
    padding: int


def side_by_side(
    name: str, maps: Sequence[ExistingCharts], size: tuple[int, int], padding: int, *, progress: Tell | None = None
) -> SideBySide:
    """Lay the charts of several meshes out in one image of so many texels, width and height.

    Charts of one mesh that lie on one another stay so; those of different meshes never do. Charts are turned by
    quarters alone, and mirrored ones stay mirrored. Triangles that cover nothing, here or on the surface, and hang
    together with none that does, fall on one point. progress: as in `unwrap`. Raises InputError, naming `name`, where
    no chart has an area.
    """
    with Stages(progress) as stages:
        stages.enter("looking for charts", 0.0, 0.4)
        laid = [_Pieces.of(each) for each in maps]
        control = stages.enter("packing charts", 0.4, 1.0)
        return _packed(name, laid, size, padding, control)


@dataclass(frozen=True, eq=False)
class _Pieces:
    """uv: (T, 3, 2), in metres. piece: (T,) from 0, triangles that stay where they are to one another; `_NOWHERE` for
    those that cover nothing. count: of pieces."""

    uv: Doubles
    piece: Longs
    count: int

    @staticmethod
    def of(charts: ExistingCharts) -> _Pieces:
        uv = charts.uv.astype(np.float64)
        uv[~np.isfinite(uv).all(axis=(1, 2))] = 0.0
        island = islands(charts.triangles, uv)
        if charts.are_copies:
            uv = _in_first_tile(uv, island)
        piece, count = _stacks(uv, island, charts.drawn_areas)
        return _Pieces(uv * charts.scale, piece, count)


def islands(triangles: Longs, uv: Doubles) -> Longs:
    """(T,) from 0: triangles (T, 3) that hang together by corners at one vertex with the same UVs (T, 3, 2)."""
    vertex, places = triangles.ravel(), (uv + 0.0).reshape(-1, 2)  # -0 is 0
    order = np.lexsort((places[:, 1], places[:, 0], vertex))
    same = (np.diff(vertex[order]) == 0) & (np.diff(places[order], axis=0) == 0.0).all(axis=1)
    owner = order // 3
    return _components(len(triangles), owner[:-1][same], owner[1:][same])


def _components(count: int, first: Longs, second: Longs) -> Longs:
    """(count,) the connected component of each node, from 0, of links from `first` to `second`."""
    label = np.arange(count)
    while True:
        one, other = label[first], label[second]
        lower = label.copy()
        np.minimum.at(lower, np.concatenate([one, other]), np.tile(np.minimum(one, other), 2))
        lower = lower[lower]
        if np.array_equal(lower, label):
            return np.asarray(np.unique(label, return_inverse=True)[1].ravel(), np.int64)
        label = lower


def _in_first_tile(uv: Doubles, island: Longs) -> Doubles:
    """(T, 3, 2) islands moved by whole tiles to where their middles lie in the first."""
    count = int(island.max(initial=-1)) + 1
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    np.minimum.at(low, island, uv.min(axis=1))
    np.maximum.at(high, island, uv.max(axis=1))
    moved: Doubles = uv - np.floor(0.5 * (low + high))[island][:, None]
    return moved


def _stacks(uv: Doubles, island: Longs, areas: Doubles) -> tuple[Longs, int]:
    """(T,) from 0: islands that lie on one another as one piece, `_NOWHERE` for those that cover nothing; how many.

    Where more triangles do than are looked for, all islands are one piece: nothing can be told apart there.
    """
    count = int(island.max(initial=-1)) + 1
    pairs = island[overlapping(uv, _OVERLAP)]
    stack = _components(count, pairs[:, 0], pairs[:, 1])
    if len(pairs) >= MOST:
        stack[:] = 0
    covers = np.bincount(stack[island], areas, count) > 0.0
    number = np.where(covers, np.cumsum(covers) - 1, _NOWHERE)
    return number[stack[island]], int(covers.sum())


def _packed(name: str, laid: Sequence[_Pieces], size: tuple[int, int], padding: int, control: Control) -> SideBySide:
    counts = [each.count for each in laid]
    first = np.cumsum([0, *counts])  # piece of each map
    pieces = [np.where(each.piece >= 0, each.piece + start, _NOWHERE) for each, start in zip(laid, first, strict=False)]
    uv, piece = np.concatenate([each.uv for each in laid]), np.concatenate(pieces)
    shown = np.flatnonzero(piece >= 0)
    if not len(shown):
        raise InputError(f"{name}: no face has an area, so there is nothing to lay out; scale or edit the mesh")
    turned = np.where((uv_area_of(uv[shown]) < 0.0)[:, None], [0, 2, 1], [0, 1, 2])[:, :, None]  # mirrored ones
    facing = np.ascontiguousarray(np.take_along_axis(uv[shown], turned, axis=1))
    layout, kept = packed(facing, piece[shown], size, padding, align=False, control=control)
    placed = np.broadcast_to(layout[0, 0], uv.shape).copy()
    placed[shown] = np.take_along_axis(layout, turned, axis=1)
    ends = np.cumsum([len(each.uv) for each in laid])[:-1]
    return SideBySide(np.split(placed.astype(np.float32), ends), sum(counts), kept)
