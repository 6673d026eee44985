"""A mesh as charts see it: which triangle lies across each edge, however the mesh was put together.

Half-edges are numbered 3 t + i: the edge of triangle t from its corner i to its corner i + 1.
"""

from __future__ import annotations

from ctypes import byref, c_int64
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..base import kernel_api as api
from ..base.arrays import Doubles, Flags, Ints, Longs
from ..base.triangles import area_of
from ..base.vectors import unit

_ON_CREASE = 0.8  # of a cut's length does not count where it runs along a right angle


@dataclass(frozen=True, eq=False)
class ChartMesh:
    """A mesh whose surface is 1000 x 1000 large, about its middle.

    points: (V, 3). triangles: (T, 3), none of which is at one place twice; a vertex belongs to one fan of triangles.
    polygon: (T,) from 0. twin: (3 T,) the half-edge on the other side of each, -1 where the surface ends. seam: (3 T,)
    bool, those that the artist marked.
    """

    points: Doubles
    triangles: Longs
    polygon: Longs
    twin: Longs
    seam: Flags

    @cached_property
    def corners(self) -> Doubles:
        """(T, 3, 3)."""
        return self.points[self.triangles]

    @cached_property
    def area(self) -> Doubles:
        """(T,)."""
        return area_of(self.corners)

    @cached_property
    def normals(self) -> Doubles:
        """(T, 3) unit normals, zero for a triangle without area."""
        return unit(np.cross(self.corners[:, 1] - self.corners[:, 0], self.corners[:, 2] - self.corners[:, 0]))

    @cached_property
    def lengths(self) -> Doubles:
        """(3 T,) of the half-edges."""
        return np.asarray(np.linalg.norm(self.corners[:, [1, 2, 0]] - self.corners, axis=2)).ravel()

    @cached_property
    def across(self) -> Longs:
        """(3 T,) the triangle across each half-edge, or -1."""
        return np.where(self.twin >= 0, self.twin // 3, -1)

    def between(self, label: Longs | Ints) -> Flags:
        """(3 T,) bool: half-edges with another label, of labels (T,), on the other side."""
        return np.asarray((self.twin >= 0) & (label[self.across] != np.repeat(label, 3)))

    def crease(self, halves: Longs) -> Doubles:
        """(n,) how good a place for a cut half-edges are: 0 on a plane, 1 at a right angle, where they are marked and
        at the end of the surface."""
        inner = self.twin[halves] >= 0
        here, there = halves // 3, self.across[halves]
        bend = np.ones(len(halves))
        for normal in np.ascontiguousarray(self.normals.T):  # one axis after the other needs a third of the memory
            bend -= normal[here] * normal[there]
        bend[(self.area[here] <= 0.0) | (self.area[there] <= 0.0)] = 0.0
        return np.where(inner & ~self.seam[halves], np.clip(bend, 0.0, 1.0), 1.0)

    def cost(self, halves: Longs) -> Doubles:
        """(n,) what it costs to cut along half-edges: their length, less along creases."""
        return np.asarray(self.lengths[halves] * (1.0 - _ON_CREASE * self.crease(halves)))

    def part(self, chosen: Longs) -> ChartMesh:
        """The triangles numbered `chosen`, in rising order, by themselves, with the vertices that they use."""
        halves = halves_of(chosen)
        twin = self.twin[halves]
        at = np.minimum(np.searchsorted(chosen, twin // 3), len(chosen) - 1)
        inside = (twin >= 0) & (chosen[at] == twin // 3)
        used, triangles = np.unique(self.triangles[chosen], return_inverse=True)
        return ChartMesh(
            self.points[used],
            triangles.reshape(-1, 3),
            np.unique(self.polygon[chosen], return_inverse=True)[1].ravel(),
            np.where(inside, 3 * at + twin % 3, -1),
            self.seam[halves],
        )


def connected(points: Doubles, triangles: Longs, polygon: Longs, seams: Flags | None = None) -> ChartMesh:
    """A mesh of triangles (T, 3) none of which is at one place twice, as ChartMesh.

    Edges belong together by their vertices, else by their places: meshes that were taken apart along seams or into
    loose triangles are one surface here. Of several triangles at an edge those that turn the same way are paired in the
    order of their numbers, so that two sheets in one place stay two. seams: (T, 3) bool, marked on either side.
    """
    twin = np.full(3 * len(triangles), -1, np.int64)
    _pair(twin, triangles, polygon)
    place = places(points)
    if place.max(initial=-1) + 1 < len(points) and (twin < 0).any():
        _pair(twin, place[triangles], polygon)
    marked = np.zeros(len(twin), np.bool_) if seams is None else seams.ravel().copy()
    inner = twin >= 0
    marked[inner] |= marked[twin[inner]]
    vertex, count = corner_classes(twin, twin >= 0, _broken(twin, triangles, polygon, place))
    first = np.zeros(count, np.int64)
    first[vertex[::-1]] = triangles.ravel()[::-1]
    return ChartMesh(points[first], vertex.reshape(-1, 3).astype(np.int64), polygon, twin, marked)


def places(points: Doubles) -> Longs:
    """(V,) the number of each point's place: the same for points that are equal."""
    bits = (points + 0.0).view(np.uint64).reshape(-1, 3)  # -0 is 0
    mixed = np.zeros(len(points), np.uint64)
    for axis in range(3):
        mixed = (mixed ^ bits[:, axis]) * np.uint64(0x9E3779B97F4A7C15)
        mixed ^= mixed >> np.uint64(29)
    _, first, number = np.unique(mixed, return_index=True, return_inverse=True)
    number = number.ravel()
    if (points[first[number]] != points).any():  # two places of one hash
        number = np.unique(points, axis=0, return_inverse=True)[1].ravel()
    return number.astype(np.int64)


def _pair(twin: Longs, ends: Longs, polygon: Longs) -> None:
    """Pair the half-edges that have no twin yet, by the vertices (T, 3) at their ends."""
    free = np.flatnonzero(twin < 0)
    start, end = ends.ravel()[free], ends[:, [1, 2, 0]].ravel()[free]
    forward = start < end
    key = np.minimum(start, end) * (int(ends.max(initial=0)) + 1) + np.maximum(start, end)
    order = np.argsort(2 * key + forward, kind="stable")
    key, forward, free = key[order], forward[order], free[order]
    begin = np.flatnonzero(np.append(True, key[1:] != key[:-1]))
    size = np.diff(np.append(begin, len(key)))
    plain = begin[size == 2]
    plain = plain[~forward[plain] & forward[plain + 1]]
    twin[free[plain]], twin[free[plain + 1]] = free[plain + 1], free[plain]
    crowded = np.repeat(size > 2, size)
    if crowded.any():
        _pair_ranked(
            twin,
            free[crowded],
            np.repeat(np.arange(len(size), dtype=np.int64), size)[crowded],
            forward[crowded],
            polygon,
        )


def _pair_ranked(twin: Longs, halves: Longs, edge: Longs, forward: Flags, polygon: Longs) -> None:
    """Pair half-edges of edges with more than two triangles: within a polygon first, then in the order of numbers."""
    within = polygon[halves // 3]
    for groups in (edge * (int(within.max()) + 1) + within, edge):
        open_ = twin[halves] < 0
        some, group, way = halves[open_], groups[open_], forward[open_]
        order = np.lexsort((some, way, group))
        some, group, way = some[order], group[order], way[order]
        run = np.flatnonzero(np.append(True, (group[1:] != group[:-1]) | (way[1:] != way[:-1])))
        rank = np.arange(len(some), dtype=np.int64) - np.repeat(run, np.diff(np.append(run, len(some))))
        again = np.lexsort((way, rank, group))
        one, other = again[:-1], again[1:]
        match = (group[one] == group[other]) & (rank[one] == rank[other]) & (way[one] != way[other])
        twin[some[one[match]]], twin[some[other[match]]] = some[other[match]], some[one[match]]


def _broken(twin: Longs, triangles: Longs, polygon: Longs, place: Longs) -> tuple[Longs, Longs]:
    """Pairs of corners that are one corner of a polygon whose triangles do not all hang together by their edges."""
    sizes = np.bincount(polygon)
    inner = np.flatnonzero(twin >= 0)
    inner = inner[polygon[inner // 3] == polygon[twin[inner] // 3]]
    links = np.bincount(polygon[inner // 3], minlength=len(sizes)) // 2
    apart = np.flatnonzero((links < sizes - 1)[polygon])
    corner = halves_of(apart)
    key = polygon[corner // 3] * (int(place.max(initial=0)) + 1) + place[triangles.ravel()[corner]]
    order = np.argsort(key, kind="stable")
    same = np.flatnonzero(key[order][1:] == key[order][:-1])
    return corner[order[same]], corner[order[same + 1]]


def corner_classes(twin: Longs, joined: Flags, extra: tuple[Longs, Longs] | None = None) -> tuple[Ints, int]:
    """(3 T,) int32: which corners are one vertex where surfaces go on over the half-edges `joined`, and how many."""
    here = np.flatnonzero(joined)
    here = here[here < twin[here]]
    there = twin[here]
    first = [here, following(here)]
    second = [following(there), there]
    if extra is not None:
        first.append(extra[0])
        second.append(extra[1])
    return components(len(twin), np.concatenate(first), np.concatenate(second))


def following(half: Longs) -> Longs:
    """The half-edges that come next in the same triangles; also the corners at which half-edges end."""
    return np.where(half % 3 == 2, half - 2, half + 1)


def halves_of(triangles: Longs) -> Longs:
    """(3 n,) the half-edges of triangles; also their corners."""
    return np.asarray(3 * triangles[:, None] + np.arange(3, dtype=np.int64)).ravel()


def triangle_groups(mesh: ChartMesh, joined: Flags, label: Longs | None = None) -> tuple[Ints, int]:
    """(T,) int32: which triangles hang together over the half-edges `joined`, or are of one polygon; how many groups.

    label: (T,), what is of no one group in any case.
    """
    here = np.flatnonzero(joined)
    here = here[here < mesh.twin[here]]
    order = np.argsort(mesh.polygon, kind="stable")
    alike = mesh.polygon[order][1:] == mesh.polygon[order][:-1]
    if label is not None:
        alike &= label[order][1:] == label[order][:-1]
    same = np.flatnonzero(alike)
    first = np.concatenate([here // 3, order[same]])
    second = np.concatenate([mesh.across[here], order[same + 1]])
    return components(len(mesh.triangles), first, second)


def components(count: int, first: Longs, second: Longs) -> tuple[Ints, int]:
    """(count,) int32: the connected component of each node, numbered in the order of their first nodes; how many."""
    label, found = np.empty(count, np.int32), c_int64()
    one, other = first.astype(np.int32), second.astype(np.int32)
    status = api.library().ob_components(
        count,
        api.address(one, np.int32, len(one)),
        api.address(other, np.int32, len(one)),
        len(one),
        api.address(label, np.int32, count),
        byref(found),
    )
    api.check(status)
    return label, found.value
