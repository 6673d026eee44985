"""UDIM: UVs that go on beyond the unit square, in tiles of its size with an image each, numbered from 1001."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..base.arrays import Doubles, Flags, Longs
from ..base.triangles import uv_area_of
from ..scene.checks import zero_area
from ..scene.scene import Instance, Mesh

FIRST, ACROSS, DOWN = 1001, 10, 100  # ten tiles in a row; 2000 is the last that is in use
_PLACES = 1 << 12  # a side: copies lie on the same of them
_MANY, _MOST = 32, 0.9  # triangles
_SLACK = 1e-5  # of a tile: UVs on a border may be rounded past it


def tiles_of(mesh: Mesh) -> list[int]:
    """The tiles that a mesh lies in, in order; none where its UVs are no UDIM layout.

    They are one if they leave the unit square and every triangle lies in one tile. The UVs of a texture that repeats
    do not: their triangles go over the borders. Nor are copies, moved aside by whole tiles so that a bake passes over
    them and they show the texture of the first tile all the same.
    """
    if mesh.uv is None or not np.isfinite(mesh.uv).all():
        return []
    uv = mesh.uv[~zero_area(mesh)].astype(np.float64)
    uv = uv[uv_area_of(uv) != 0.0]  # the others get no texel
    if not len(uv):
        return []
    column, row = _tile(uv)
    corner = np.stack([column, row], axis=-1)[:, None]
    whole = ((uv >= corner - _SLACK) & (uv <= corner + 1.0 + _SLACK)).all()
    if not whole or column.min() < 0 or column.max() >= ACROSS or row.min() < 0 or row.max() >= DOWN:
        return []
    tile = _number(column, row)
    numbers: list[int] = np.unique(tile).tolist()
    return [] if numbers == [FIRST] or _are_copies(uv - corner, tile) else numbers


def _are_copies(uv: Doubles, tile: Longs) -> bool:
    """Whether most of the triangles beyond the first tile, where there are many, lie upon one of its own, by their
    middles. A few that fill their tiles each do, too."""
    places = np.rint(uv.mean(axis=1) * _PLACES).astype(np.int64) @ np.array([1 << 24, 1])
    beyond = tile != FIRST
    if np.count_nonzero(beyond) < _MANY:
        return False
    return float(np.isin(places[beyond], places[~beyond]).mean()) > _MOST


def in_tile(target: Instance, tile: int | None) -> Instance:
    """A target with UVs as a tile has them, its own from 0 to 1; None: as they are."""
    if tile is None:
        return target
    assert target.mesh.uv is not None
    row, column = divmod(tile - FIRST, ACROSS)
    uv = target.mesh.uv - np.array([column, row], dtype=np.float32)
    return replace(target, mesh=replace(target.mesh, uv=uv))


def outside_tile(mesh: Mesh, tile: int | None) -> Flags:
    """(T,) bool: triangles of a mesh that lie in another tile; none where there are no tiles."""
    if tile is None:
        return np.zeros(len(mesh.triangles), dtype=np.bool_)
    assert mesh.uv is not None
    outside: Flags = _number(*_tile(mesh.uv.astype(np.float64))) != tile
    return outside


def part_in_tile(target: Instance, tile: int | None) -> Instance:
    """The triangles of a target that lie in a tile, with UVs as the tile has them; None: all, as they are."""
    if tile is None:
        return target
    mesh, rows = in_tile(target, tile).mesh, ~outside_tile(target.mesh, tile)
    assert mesh.uv is not None
    part = replace(mesh, triangles=mesh.triangles[rows], uv=mesh.uv[rows], normals=None, corners=None)
    return replace(target, mesh=part)


def _tile(uv: Doubles) -> tuple[Longs, Longs]:
    """Column and row of the tile that the middle of each triangle lies in."""
    middle = np.floor(uv.mean(axis=1)).astype(np.int64)
    return middle[:, 0], middle[:, 1]


def _number(column: Longs, row: Longs) -> Longs:
    return FIRST + column + ACROSS * row
