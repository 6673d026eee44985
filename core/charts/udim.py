"""UDIM: UVs that go on beyond the unit square, in tiles of its size with an image each, numbered from 1001."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from itertools import product

import numpy as np

from ..base.arrays import Doubles, Flags, Floats, Longs
from ..base.triangles import uv_area_of
from ..scene.checks import zero_area
from ..scene.scene import Instance, Mesh

FIRST, ACROSS, DOWN = 1001, 10, 100  # ten tiles in a row; 2000 is the last that is in use
_SLACK = 1e-5  # of a tile: UVs on a border may be rounded past it
_STRAY = 0.01  # of the triangles of a layout: so many may lie over a border, or in no tile
_PLACES = 8191  # a side: copies lie on the same of them. A prime, so that UVs on a raster lie between no two of them
_MOST = 0.9  # of the triangles beyond the first tile lie upon its own where they are copies

_REPEATS = "go over the borders of tiles, and are taken for those of a texture that repeats"
_COPIES = "lie upon those in it, mirrored or several at one place, and are taken for copies that show its texture"


class Udim(Enum):
    """What UVs beyond the unit square are. LAYOUT: every tile is baked. STACKED: copies moved aside, over which a bake
    passes. AUTO: what they look like (`tiles_of`)."""

    AUTO = "auto"
    LAYOUT = "layout"
    STACKED = "stacked"


@dataclass(frozen=True)
class UvTiles:
    """numbers: the tiles to bake, in order; none where the unit square alone is. taken_for: what UVs beyond it do that
    are taken for no layout. outside: triangles that leave all tiles."""

    numbers: tuple[int, ...] = ()
    taken_for: str = ""
    outside: int = 0

    def warnings(self, name: str) -> list[str]:
        """What the artist should know, a line each."""
        lines = []
        if self.taken_for:
            lines.append(
                f"{name}: its UVs beyond the first tile {self.taken_for}; set UDIM to Layout (--udim layout) if they "
                "lie in tiles of their own"
            )
        if self.outside:
            lines.append(
                f"{name}: {self.outside} triangles leave the UDIM tiles, 1001 to 2000; what lies outside is not baked"
            )
        return lines


def tiles_of(mesh: Mesh, udim: Udim = Udim.AUTO) -> UvTiles:
    """The tiles that a mesh lies in.

    UVs look like a layout if they leave the unit square and the triangles lie in one tile each. The UVs of a texture
    that repeats do not: their triangles go over the borders. Nor do copies, moved aside by whole tiles so that a bake
    passes over them and they show the texture of the first tile all the same: they lie upon what is there, and are
    mirrored, or are several at one place of a tile. Equal parts with a tile for each are a layout. So is what is in
    doubt: a tile too many costs time, one too few is lost.
    """
    if mesh.uv is None or udim is Udim.STACKED or (udim is Udim.AUTO and _in_unit_square(mesh.uv)):
        return UvTiles()
    uv = mesh.uv[~zero_area(mesh)].astype(np.float64)
    uv = uv[np.isfinite(uv).all(axis=(1, 2))]
    uv = uv[uv_area_of(uv) != 0.0]  # the others get no texel
    whole = _in_one_tile(uv)
    if udim is Udim.AUTO:
        beyond = _numbered(uv) & (np.floor(_middle(uv)) != 0.0).any(axis=1)
        if np.count_nonzero(~whole) > _STRAY * len(uv):
            return UvTiles(taken_for=_REPEATS if beyond.any() else "")
        if not (beyond & whole).any():
            return UvTiles()
        if _are_copies(uv[whole]):
            return UvTiles(taken_for=_COPIES)
    low, high = _span(uv)
    outside = ((low < -_SLACK) | (high > np.array([ACROSS, DOWN]) + _SLACK)).any(axis=1)
    return UvTiles(_numbers(uv, whole), outside=int(np.count_nonzero(outside)))


def are_copies(mesh: Mesh, udim: Udim = Udim.AUTO) -> bool:
    """Whether UVs beyond the unit square are those of copies that were moved aside: they lie upon what is in it."""
    if mesh.uv is None or udim is Udim.LAYOUT:
        return False
    return udim is Udim.STACKED or tiles_of(mesh, udim).taken_for == _COPIES


def corner_of(tile: int) -> tuple[int, int]:
    """Where a tile begins, u and v."""
    row, column = divmod(tile - FIRST, ACROSS)
    return column, row


def in_tile(target: Instance, tile: int | None) -> Instance:
    """A target with UVs as a tile has them, its own from 0 to 1; None: as they are."""
    if tile is None:
        return target
    assert target.mesh.uv is not None
    uv = target.mesh.uv - np.array(corner_of(tile), dtype=np.float32)
    return replace(target, mesh=replace(target.mesh, uv=uv))


def outside_tile(mesh: Mesh, tile: int | None) -> Flags:
    """(T,) bool: triangles of a mesh that do not reach into a tile; none where there are no tiles."""
    if tile is None:
        return np.zeros(len(mesh.triangles), dtype=np.bool_)
    assert mesh.uv is not None
    with np.errstate(invalid="ignore"):
        return ~_reaches(mesh.uv.astype(np.float64), tile)


def part_in_tile(target: Instance, tile: int | None) -> Instance:
    """The triangles of a target that lie in a tile, with UVs as the tile has them; None: all, as they are."""
    if tile is None:
        return target
    mesh, rows = in_tile(target, tile).mesh, ~outside_tile(target.mesh, tile)
    assert mesh.uv is not None
    part = replace(mesh, triangles=mesh.triangles[rows], uv=mesh.uv[rows], normals=None, corners=None)
    return replace(target, mesh=part)


def _in_unit_square(uv: Floats) -> bool:
    """Whether all UVs lie there, as most do, at a glance; not where some are no numbers."""
    return len(uv) == 0 or bool(uv.min() >= 0.0 and uv.max() <= 1.0)


def _are_copies(uv: Doubles) -> bool:
    """Whether triangles beyond the first tile are copies of its own, by their middles and which way round they are."""
    number = _number(uv)
    beyond = number != FIRST
    if beyond.all():
        return False
    middle = _middle(uv)
    x, y = np.rint((middle - np.floor(middle)) * _PLACES).astype(np.int64).T
    place = (_PLACES + 1) * x + y
    sided = 2 * place + (uv_area_of(uv) > 0.0)
    placed = (_PLACES + 1) ** 2 * number + place
    in_first = _times(place, place[~beyond])
    mirrored = _times(sided, sided[~beyond]) == 0
    crowded = _times(placed, placed) > in_first
    upon = in_first > 0
    return bool(upon[beyond].mean() > _MOST and (upon & (mirrored | crowded))[beyond].mean() > 0.5)


def _times(values: Longs, among: Longs) -> Longs:
    """How often each value stands among others."""
    found, counts = np.unique(among, return_counts=True)
    at = np.minimum(np.searchsorted(found, values), len(found) - 1)
    times: Longs = np.where(found[at] == values, counts[at], 0)
    return times


def _numbers(uv: Doubles, whole: Flags) -> tuple[int, ...]:
    """The tiles that triangles reach into. whole: those that lie in one."""
    found: set[int] = set(np.unique(_number(uv[whole])).tolist())
    over = uv[~whole]
    if len(over):
        most = np.array([ACROSS - 1, DOWN - 1], dtype=np.int64)
        low = np.clip(np.floor(over.min(axis=(0, 1))), 0, most).astype(np.int64)
        high = np.clip(np.floor(over.max(axis=(0, 1))), 0, most).astype(np.int64)
        for column, row in product(range(low[0], high[0] + 1), range(low[1], high[1] + 1)):
            if _reaches(over, FIRST + column + ACROSS * row).any():
                found.add(FIRST + column + ACROSS * row)
    return tuple(sorted(found))


def _in_one_tile(uv: Doubles) -> Flags:
    """(T,) bool: triangles that lie in one tile that has a number."""
    corner, (low, high) = np.floor(_middle(uv)), _span(uv)
    whole: Flags = ((low - corner >= -_SLACK) & (high - corner <= 1.0 + _SLACK)).all(axis=1) & _numbered(uv)
    return whole


def _numbered(uv: Doubles) -> Flags:
    """(T,) bool: triangles whose middle lies where tiles have numbers."""
    middle = _middle(uv)
    numbered: Flags = ((middle >= 0.0) & (middle < [ACROSS, DOWN])).all(axis=1)
    return numbered


def _reaches(uv: Doubles, tile: int) -> Flags:
    """(T,) bool: triangles that have their middle in a tile, or reach into it by more than what is rounded."""
    corner, (low, high) = np.array(corner_of(tile), dtype=np.int64), _span(uv)
    within = (np.floor(_middle(uv)) == corner).all(axis=1)
    near = ((low < corner + 1.0 - _SLACK) & (high > corner + _SLACK)).all(axis=1) & ~within
    near[near] = ~_beside_tile(uv[near] - corner)
    reaches: Flags = within | near
    return reaches


def _beside_tile(local: Doubles) -> Flags:
    """(n,) bool: triangles one of whose edges has the whole unit square on its outer side."""
    edge = np.roll(local, -1, axis=1) - local
    edge /= np.maximum(np.linalg.norm(edge, axis=-1, keepdims=True), 1e-300)
    outward = np.stack([edge[..., 1], -edge[..., 0]], axis=-1) * np.sign(uv_area_of(local))[:, None, None]
    square = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
    side = ((square - local[:, :, None]) * outward[:, :, None]).sum(axis=-1)
    beside: Flags = (side > -_SLACK).all(axis=2).any(axis=1)
    return beside


def _number(uv: Doubles) -> Longs:
    """(T,) the tile that the middle of each triangle lies in."""
    column, row = np.floor(_middle(uv)).astype(np.int64).T
    number: Longs = FIRST + column + ACROSS * row
    return number


# Over three corners many times as fast as numpy's own reductions.


def _middle(uv: Doubles) -> Doubles:
    middle: Doubles = (uv[:, 0] + uv[:, 1] + uv[:, 2]) / 3.0
    return middle


def _span(uv: Doubles) -> tuple[Doubles, Doubles]:
    """Lower left and upper right."""
    a, b, c = uv[:, 0], uv[:, 1], uv[:, 2]
    return np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
