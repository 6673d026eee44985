"""Meshes of polygons from arrays: fans, nets of quads, lathed profiles, and what is done to several of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ....core.base.arrays import Doubles, Floats, Ints, Longs


class PolygonMesh(NamedTuple):
    """vertices: (V, 3). triangles: (T, 3), counter-clockwise. polygons: (T,) the polygon of each triangle."""

    vertices: Floats
    triangles: Ints
    polygons: Ints

    @property
    def corners(self) -> Doubles:
        """(T, 3, 3) where the triangles' corners are."""
        return self.vertices.astype(np.float64)[self.triangles]


def of_faces(vertices: ArrayLike, *faces: ArrayLike) -> PolygonMesh:
    """A mesh of polygons, each a fan about its first corner. faces: (F, k) vertices, an array for each k."""
    triangles, polygons, first = [np.empty((0, 3), np.int64)], [np.empty(0, np.int64)], 0
    for each in (np.asarray(face, np.int64) for face in faces if np.size(face)):
        count, corners = each.shape
        fan = np.stack(
            [np.zeros(corners - 2), np.arange(1, corners - 1, dtype=np.int64), np.arange(2, corners, dtype=np.int64)],
            axis=1,
        )
        triangles.append(each[:, fan.astype(np.int64)].reshape(-1, 3))
        polygons.append(first + np.repeat(np.arange(count, dtype=np.int64), corners - 2))
        first += count
    whole = np.concatenate(triangles).astype(np.int32), np.concatenate(polygons).astype(np.int32)
    return PolygonMesh(np.asarray(vertices, np.float64).reshape(-1, 3).astype(np.float32), *whole)


def net_faces(rows: int, columns: int, close_rows: bool = False, close_columns: bool = False) -> Longs:
    """(Q, 4): the quads of a net of rows x columns vertices, numbered row by row; counter-clockwise where columns run
    to the right and rows upwards."""
    row, column = np.mgrid[: rows - (not close_rows), : columns - (not close_columns)].reshape(2, -1)
    up, right = (row + 1) % rows, (column + 1) % columns
    faces: Longs = np.stack(
        [row * columns + column, row * columns + right, up * columns + right, up * columns + column], axis=1
    )
    return faces


def net(points: ArrayLike, close_rows: bool = False, close_columns: bool = False) -> PolygonMesh:
    """A sheet of quads over (rows, columns, 3) points."""
    grid = np.asarray(points, np.float64)
    return of_faces(grid, net_faces(grid.shape[0], grid.shape[1], close_rows, close_columns))


def lathe(profile: ArrayLike, sides: int) -> PolygonMesh:
    """A profile (n, 2) of radius and height turned about z, facing outwards where it rises. A radius of 0 at either end
    is a pole: one vertex, with triangles about it."""
    radius, height = np.asarray(profile, np.float64).T
    at_start, at_end = radius[0] == 0.0, radius[-1] == 0.0
    rings = slice(int(at_start), len(radius) - int(at_end))
    turn = 2.0 * np.pi * np.arange(sides, dtype=np.int64) / sides
    circle = np.stack([np.cos(turn), np.sin(turn), np.zeros(sides)], axis=1)
    points = radius[rings, None, None] * circle + height[rings, None, None] * np.array([0.0, 0.0, 1.0])
    quads = net_faces(len(points), sides, close_columns=True)
    here, after = np.arange(sides, dtype=np.int64), (np.arange(sides, dtype=np.int64) + 1) % sides
    count, caps, poles = points.shape[0] * sides, [], []
    if at_start:
        caps.append(np.stack([after, here, np.full(sides, count)], axis=1))
        poles.append((0.0, 0.0, height[0]))
    if at_end:
        last = count - sides
        caps.append(np.stack([here + last, after + last, np.full(sides, count + len(poles))], axis=1))
        poles.append((0.0, 0.0, height[-1]))
    vertices = np.concatenate([points.reshape(-1, 3), np.reshape(poles, (-1, 3))])
    return of_faces(vertices, quads, np.concatenate(caps) if caps else [])


def joined(meshes: Sequence[PolygonMesh]) -> PolygonMesh:
    """Several meshes in one, none of their vertices shared."""
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    firsts = np.cumsum([0, *(int(mesh.polygons.max(initial=-1)) + 1 for mesh in meshes)])
    return PolygonMesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.triangles + start for mesh, start in zip(meshes, starts[:-1], strict=True)]).astype(
            np.int32
        ),
        np.concatenate([mesh.polygons + first for mesh, first in zip(meshes, firsts[:-1], strict=True)]).astype(
            np.int32
        ),
    )


def copies(corners: ArrayLike, faces: ArrayLike) -> PolygonMesh:
    """Loose pieces that are alike. corners: (P, k, 3). faces: (F, m) of one piece, or its one polygon (m,)."""
    points = np.asarray(corners, np.float64)
    one = np.atleast_2d(np.asarray(faces, np.int64))
    first = np.arange(len(points), dtype=np.int64)[:, None, None] * points.shape[1]
    return of_faces(points, (first + one).reshape(-1, one.shape[1]))


def placed(mesh: PolygonMesh, at: ArrayLike = (0.0, 0.0, 0.0), scale: ArrayLike = 1.0) -> PolygonMesh:
    """The mesh scaled, by one number or one an axis, then moved."""
    points = mesh.vertices.astype(np.float64) * np.asarray(scale, np.float64) + np.asarray(at, np.float64)
    return mesh._replace(vertices=points.astype(np.float32))


def turned_over(mesh: PolygonMesh) -> PolygonMesh:
    """Seen from its other side."""
    return mesh._replace(triangles=np.ascontiguousarray(mesh.triangles[:, ::-1]))


def welded(mesh: PolygonMesh, digits: int = 5) -> PolygonMesh:
    """Vertices that lie in one place, to so many digits after the point, are one."""
    points, first, index = np.unique(
        np.round(mesh.vertices, digits) + np.float32(0.0), axis=0, return_index=True, return_inverse=True
    )
    del points
    return PolygonMesh(mesh.vertices[first], index.ravel()[mesh.triangles].astype(np.int32), mesh.polygons)


def unwelded(mesh: PolygonMesh) -> PolygonMesh:
    """Each triangle a piece of its own, as some files have it."""
    count = len(mesh.triangles)
    triangles = np.arange(3 * count, dtype=np.int32).reshape(-1, 3)
    return PolygonMesh(mesh.vertices[mesh.triangles].reshape(-1, 3), triangles, np.arange(count, dtype=np.int32))


def some_of(mesh: PolygonMesh, chosen: ArrayLike) -> PolygonMesh:
    """The triangles chosen, (T,) bool or indices."""
    return mesh._replace(triangles=mesh.triangles[np.asarray(chosen)], polygons=mesh.polygons[np.asarray(chosen)])


def rotations(rng: np.random.Generator, count: int) -> Doubles:
    """(count, 3, 3), even over all, from unit quaternions."""
    w, x, y, z = (lambda q: q / np.linalg.norm(q, axis=0))(rng.normal(size=(4, count)))
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    turned: Doubles = np.moveaxis(np.array(rows), -1, 0)
    return turned
