"""Charts that exist already, of one mesh or several, laid side by side in one image: cut, shaped and stacked as they
are, each mesh at a scale of its own, so that all get the same texels a square metre."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..base.arrays import Doubles, Floats, Ints, Longs
from ..base.errors import InputError
from ..base.kernel_api import Control
from ..base.triangles import area_of, uv_area_of
from ..scene.scene import Mesh
from .chart_mesh import components, places
from .overlaps import MOST, overlapping
from .packing import packed
from .stages import Stages, Tell
from .stretch import Stretch, stretch_of
from .udim import Udim, are_copies

_OVERLAP = 1e-4  # of the unit square, a tenth of a texel of 1024: charts that meet by less lie beside one another
_NOWHERE = -1


@dataclass(frozen=True, eq=False)
class ExistingCharts:
    """The UV map of a mesh.

    vertices: (V, 3) float32, as large as they are in the world. triangles: (T, 3) int32. uv: (T, 3, 2) float32. udim:
    what UVs beyond the unit square are; of copies, moved aside, charts lie upon those in it.
    """

    vertices: Floats
    triangles: Ints
    uv: Floats
    udim: Udim = Udim.LAYOUT

    @property
    def corners(self) -> Doubles:
        """(T, 3, 3)."""
        return self.vertices.astype(np.float64)[self.triangles]

    @property
    def are_copies(self) -> bool:
        """Whether charts beyond the unit square are those of copies."""
        return are_copies(Mesh("", self.vertices, self.triangles, self.uv), self.udim)


@dataclass(frozen=True, eq=False)
class SideBySide:
    """uv: for each map (T, 3, 2) float32 in the unit square, which is the whole image. count: of charts, those upon one
    another being one. padding: texels kept free between them. stretch: of all together, mirrored ones as others."""

    uv: list[Floats]
    count: int
    padding: int
    stretch: Stretch


def side_by_side(
    name: str,
    maps: Sequence[ExistingCharts],
    size: tuple[int, int],
    padding: int,
    *,
    progress: Tell | None = None,
) -> SideBySide:
    """Lay the charts of several meshes out in one image of so many texels, width and height.

    Charts of one mesh that lie on one another stay so; those of different meshes never do. Charts are turned by
    quarters alone, and mirrored ones stay mirrored. All meshes get the same texels a square metre, over all of a mesh
    and not by charts. Triangles that cover nothing, here or on the surface, and hang together with none that does, fall
    on one point. progress: as in `unwrap`. Raises InputError, naming `name`, where no chart has an area.
    """
    with Stages(progress) as stages:
        laid = []
        for i, each in enumerate(maps):
            control = stages.enter("looking for charts", 0.4 * i / len(maps), 0.4 * (i + 1) / len(maps))
            laid.append(_Pieces.of(each, control))
        control = stages.enter("packing charts", 0.4, 0.9)
        uv, padding = _packed(name, laid, size, padding, control)
        stages.enter("measuring charts", 0.9, 1.0)
        corners = np.concatenate([each.corners for each in maps])
        stretch = _stretch_of(corners, np.concatenate(uv).astype(np.float64) * (np.array(size) / max(size)))
    return SideBySide(uv, sum(each.count for each in laid), padding, stretch)


@dataclass(frozen=True, eq=False)
class _Pieces:
    """uv: (T, 3, 2), in metres. piece: (T,) from 0, triangles that stay where they are to one another; `_NOWHERE` for
    those that cover nothing. count: of pieces."""

    uv: Doubles
    piece: Longs
    count: int

    @staticmethod
    def of(charts: ExistingCharts, control: Control) -> _Pieces:
        uv = charts.uv.astype(np.float64)
        uv[~np.isfinite(uv).all(axis=(1, 2))] = 0.0
        island = islands(places(charts.vertices.astype(np.float64))[charts.triangles], uv)
        if charts.are_copies:
            uv = _in_first_tile(uv, island)
        area, drawn = area_of(charts.corners), np.abs(uv_area_of(uv))
        drawn[~(area > 0.0)] = 0.0
        piece, count = _stacks(uv, island, drawn, control)
        total = float(drawn.sum())
        metres = float(np.sqrt(area[drawn > 0.0].sum() / total)) if total > 0.0 else 0.0  # that the map is wide
        return _Pieces(uv * metres, piece, count)


def islands(triangles: Longs, uv: Doubles) -> Longs:
    """(T,) from 0: triangles (T, 3) that hang together by corners at one vertex with the same UVs (T, 3, 2)."""
    vertex, places = triangles.ravel(), (uv + 0.0).reshape(-1, 2)  # -0 is 0
    order = np.lexsort((places[:, 1], places[:, 0], vertex))
    same = (np.diff(vertex[order]) == 0) & (np.diff(places[order], axis=0) == 0.0).all(axis=1)
    owner = order // 3
    label, _ = components(len(triangles), owner[:-1][same], owner[1:][same])
    return label.astype(np.int64)


def _in_first_tile(uv: Doubles, island: Longs) -> Doubles:
    """(T, 3, 2) islands moved by whole tiles to where their middles lie in the first."""
    count = int(island.max(initial=-1)) + 1
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    np.minimum.at(low, island, uv.min(axis=1))
    np.maximum.at(high, island, uv.max(axis=1))
    moved: Doubles = uv - np.floor(0.5 * (low + high))[island][:, None]
    return moved


def _stacks(uv: Doubles, island: Longs, areas: Doubles, control: Control) -> tuple[Longs, int]:
    """(T,) from 0: islands that lie on one another as one piece, `_NOWHERE` for those that cover nothing; how many.

    Where more triangles do than are looked for, all islands are one piece: nothing can be told apart there.
    """
    count = int(island.max(initial=-1)) + 1
    pairs = island[overlapping(uv, _OVERLAP, control=control)]
    stack, _ = components(count, pairs[:, 0], pairs[:, 1])
    if len(pairs) >= MOST:
        stack[:] = 0
    covers = np.bincount(stack[island], areas, count) > 0.0
    number = np.where(covers, np.cumsum(covers, dtype=np.int64) - 1, _NOWHERE)
    return number[stack[island]], int(covers.sum())


def _packed(
    name: str, laid: Sequence[_Pieces], size: tuple[int, int], padding: int, control: Control
) -> tuple[list[Floats], int]:
    """(T, 3, 2) UVs for each map, and the padding kept."""
    first = np.cumsum([0, *(each.count for each in laid)], dtype=np.int64)  # piece of each map
    pieces = [np.where(each.piece >= 0, each.piece + start, _NOWHERE) for each, start in zip(laid, first, strict=False)]
    uv, piece = np.concatenate([each.uv for each in laid]), np.concatenate(pieces)
    shown = np.flatnonzero(piece >= 0)
    if not len(shown):
        raise InputError(f"{name}: no face has an area, so there is nothing to lay out; scale or edit the mesh")
    turned = _facing_up(uv[shown])
    facing = np.ascontiguousarray(np.take_along_axis(uv[shown], turned, axis=1))
    layout, kept = packed(facing, piece[shown], size, padding, align=False, control=control)
    placed = np.broadcast_to(layout[0, 0], uv.shape).copy()
    placed[shown] = np.take_along_axis(layout, turned, axis=1)
    ends = np.cumsum([len(each.uv) for each in laid], dtype=np.int64)[:-1]
    return np.split(placed.astype(np.float32), ends), kept


def _facing_up(uv: Doubles) -> Longs:
    """(T, 3, 1): an order of corners in which no triangle is mirrored; it is its own inverse."""
    return np.where((uv_area_of(uv) < 0.0)[:, None], [0, 2, 1], [0, 1, 2])[:, :, None]


def _stretch_of(corners: Doubles, uv: Doubles) -> Stretch:
    order = _facing_up(uv)
    return stretch_of(np.take_along_axis(corners, order, axis=1), np.take_along_axis(uv, order, axis=1))
