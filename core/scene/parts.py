"""A target in parts that float32 holds, each traced about an origin of its own.

Positions are rounded by a share of their distance from the origin, and rays start off the surface by more than that.
About the middle of one box all is well, unless a stray triangle, a ground plate or a sky dome is joined to the mesh and
makes that box a thousand times as large as what matters in it. So a triangle may be as far from its origin as

- `SIZES` times the size of the triangles there, by which a ray starts off it by a thousandth of them at most, or
- a share of its distance from the mesh's own origin, for there the mesh itself was rounded to float32 before;

and what is farther away is parted from the rest. So are a few clusters in a box that is empty otherwise, or has nothing
but triangles as large as itself in it, whatever the size of theirs: gaps within a cluster may be far thinner than its
triangles.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ..base import elementary
from ..base.arrays import Doubles, Flags, Ints, Longs
from ..base.singular_values import singular_values
from ..base.vectors import length_of, mapped
from .scene import Instance
from .world_mesh import bounds_of

SIZES = 1024.0
# Of the distance from the mesh's own origin. By the first, rays start off by what the mesh was rounded by itself; the
# second is where that would take more parts than are worth it.
_SHARES = (1.0 / 16.0, 1.0)
_MOST_PARTS = (16, 64)
_CELLS, _FEW = 256, 16  # along each axis of a box; where small triangles stand in so few of them, they are clusters
_TINY = 1.0 / 64.0  # of a box: a cluster for which it is worth it
_SAMPLE = 1 << 12  # triangles, that tell of most meshes that they are no clusters
_SMALL = 1.0 / 32.0  # of a box: a triangle that is no part of what encloses the clusters
_SHRUNK = 0.5  # what is parted must have a box this much smaller, or the box is cut
_LEAST_SIZE = 1e-300  # where a matrix leaves none
_RIM = 0.125  # of that box: what stands so near to it goes along
_GAP = 1.0 / 16.0  # of a box: a cut goes through the widest gap, where there is one


@dataclass(frozen=True, eq=False)
class Part:
    """origin: (3,) float64, in world space, and low, high the box. triangles: (T,) bool, None: all of the target's."""

    origin: Doubles
    low: Doubles
    high: Doubles
    triangles: Flags | None = None

    @property
    def radius(self) -> float:
        """Half the box's diagonal."""
        return 0.5 * float(length_of(self.high - self.low))


def parts_of(target: Instance, counted: Flags | None = None) -> list[Part]:
    """The target's parts, the one with most triangles first; nearly always there is one, about the middle of its box.

    counted: (T,) bool, triangles that must be exact, by default all that have an area; the others belong to the first
    part. The target has passed `check_target`.
    """
    low, high = bounds_of(target)
    whole = Part(0.5 * (low + high), low, high)
    counted = np.ones(len(target.mesh.triangles), dtype=np.bool_) if counted is None else counted
    number = np.flatnonzero(counted & (np.abs(target.mesh.doubled_areas).max(axis=1) > 0.0))
    if not len(number) or _are_large(target, number, 0.5 * float((high - low).max())):
        return [whole]
    extent = _Extent.of(target, number)
    found = list(_parted(extent, _SHARES[0], _MOST_PARTS[0], clusters=True))
    if len(found) <= _MOST_PARTS[0] and min(each.width for each in found) <= _TINY * extent.width:
        return _as_parts(extent, found)
    for share, most in zip(_SHARES, _MOST_PARTS, strict=True):
        if not extent.far_from(whole.origin - extent.offset, share).any():
            return [whole]
        found = list(_parted(extent, share, most))
        if len(found) <= most:
            break
    return _as_parts(extent, found)


def _are_large(target: Instance, number: Longs, reach: float) -> bool:
    """Whether none of these triangles is too small to be as far away as that, nor in a cluster. Quickly told, as it is
    so of nearly all meshes: a triangle's longest side is no shorter than the root of its doubled area."""
    areas = length_of(target.mesh.doubled_areas[number])
    sides = np.sqrt(areas) * singular_values(target.matrix[None, :3, :3]).min()
    small = number[sides < _SMALL * 2.0 * reach]
    some = target.mesh.triangles[small[:: max(len(small) // _SAMPLE, 1)], 0]
    places = mapped(target.mesh.vertices[some].astype(np.float64), target.matrix[:3, :3])
    if len(places) and _in_few_cells(places, 2.0 * reach):
        return False
    enough = reach * np.sqrt(3.0) / SIZES
    return bool(sides.min() >= enough or _size_about(target.mesh.triangles[number], sides).min() >= enough)


def _in_few_cells(places: Doubles, width: float) -> bool:
    """Whether places, (N, 3), of a box so wide are clusters that would have a box of their own much smaller."""
    cells = ((places - places.min(axis=0)) * (_CELLS / width)).astype(np.int64)
    return all(np.count_nonzero(np.bincount(along)) <= _FEW for along in cells.T)


@dataclass(frozen=True, eq=False)
class _Extent:
    """Boxes of triangles, (N, 3) float64 each, about the world's axes and the place of the mesh's own origin.

    number: which triangles of the mesh they are. size: the largest side of each, or of those about it. rounded: how far
    from the mesh's origin its corners are, the nearest of them. offset: (3,), from the world's origin. count: of all
    triangles of the mesh.
    """

    number: Longs
    low: Doubles
    high: Doubles
    size: Doubles
    rounded: Doubles
    offset: Doubles
    count: int

    @staticmethod
    def of(target: Instance, number: Longs) -> _Extent:
        """Of these triangles."""
        mesh, linear = target.mesh, target.matrix[:3, :3]
        vertices = mesh.vertices.astype(np.float64)
        distance = _largest(mapped(np.abs(vertices), np.abs(linear)))
        places, corners = mapped(vertices, linear), mesh.triangles[number]
        low, high, rounded = places[corners[:, 0]], places[corners[:, 0]], distance[corners[:, 0]]
        for corner in corners.T[1:]:
            np.minimum(low, places[corner], out=low)
            np.maximum(high, places[corner], out=high)
            np.minimum(rounded, distance[corner], out=rounded)
        size = _largest(high - low)
        size = np.maximum(size, _size_about(corners, size))
        return _Extent(number, low, high, size, rounded, target.matrix[:3, 3], len(mesh.triangles))

    def only(self, these: Flags) -> _Extent:
        """Some of them."""
        return replace(
            self,
            number=self.number[these],
            low=self.low[these],
            high=self.high[these],
            size=self.size[these],
            rounded=self.rounded[these],
        )

    @property
    def box(self) -> tuple[Doubles, Doubles]:
        """Of all."""
        return self.low.min(axis=0), self.high.max(axis=0)

    @property
    def middle(self) -> Doubles:
        """Of the box."""
        low, high = self.box
        return 0.5 * (low + high)

    @property
    def width(self) -> float:
        """The longest side of the box."""
        low, high = self.box
        return float((high - low).max())

    def far_from(self, origin: Doubles, share: float) -> Flags:
        """(N,) bool: triangles that are farther from an origin than they may be."""
        distance = _largest(np.maximum(np.abs(self.low - origin), np.abs(self.high - origin)))
        far: Flags = distance > np.maximum(SIZES * self.size, share * self.rounded)
        return far

    def clustered(self, share: float) -> Flags:
        """(N,) bool: small triangles that stand in a few clusters and would be more exact about their own middles."""
        small: Flags = _largest(self.high - self.low) < _SMALL * self.width
        some = np.flatnonzero(small)
        if not len(some) or not all(
            _in_few_cells(self.low[each], self.width) for each in (some[:: max(len(some) // _SAMPLE, 1)], some)
        ):
            return np.zeros_like(small)
        return small & bool((self.width > 2.0 * share * self.rounded[small]).any())


def _largest(values: Doubles) -> Doubles:
    """(N,): of each of (N, 3), several times as fast as along an axis so short."""
    largest: Doubles = np.maximum(np.maximum(values[:, 0], values[:, 1]), values[:, 2])
    return largest


def _size_about(triangles: Ints, size: Doubles) -> Doubles:
    """(N,): a mean of the sizes of those that share a corner with each, at the corner where it is largest: slivers ask
    for no more than the surface about them.

    triangles: (N, 3) int32. size: (N,); the mean is the geometric one, and taken twice: of those about these, too.
    """
    corners = triangles.reshape(-1)
    counts = np.maximum(np.bincount(corners), 1)
    about = elementary.log(np.maximum(size, _LEAST_SIZE))
    for _ in range(2):
        mean = np.bincount(corners, np.repeat(about, 3)) / counts
        about = mean[triangles].max(axis=1)
    sizes: Doubles = elementary.exp(about)
    return sizes


def _parted(extent: _Extent, share: float, most: int, clusters: bool = False) -> Iterator[_Extent]:
    """Extents about whose middles none of their triangles is too far; with more than `most` it ends early. clusters:
    of those, too, each has its own."""
    waiting, found = [extent], 0
    while waiting and found <= most:
        here = waiting.pop()
        far = here.far_from(here.middle, share)
        if clusters and not far.any():
            far = here.clustered(share)
        if not far.any():
            found += 1
            yield here
            continue
        for each in _divided(here, far):
            waiting.append(each)


def _divided(extent: _Extent, far: Flags) -> list[_Extent]:
    """In two: what stands within the box of the far ones and the rest, or, where that is no smaller, a cut."""
    low, high = extent.only(far).box
    rim = _RIM * (high - low)
    within = ((extent.low >= low - rim) & (extent.high <= high + rim)).all(axis=1)
    if float((high - low).max()) > _SHRUNK * extent.width or within.all():
        within = _side_of_cut(extent)
    return [extent.only(~within), extent.only(within)]


def _side_of_cut(extent: _Extent) -> Flags:
    """(N,) bool: on which side of the widest gap along an axis each triangle is; of the middle where there is none."""
    width, best = extent.width, (_GAP, np.zeros(0, dtype=np.bool_))
    for axis in range(3):
        order = np.argsort(extent.low[:, axis], kind="stable")
        reached = np.maximum.accumulate(extent.high[order, axis])
        gaps = extent.low[order[1:], axis] - reached[:-1]
        at = int(np.argmax(gaps)) if len(gaps) else 0
        if len(gaps) and gaps[at] / width > best[0]:
            side = np.zeros(len(order), dtype=np.bool_)
            side[order[: at + 1]] = True
            best = float(gaps[at]) / width, side
    if len(best[1]):
        return best[1]
    low, high = extent.box
    axis = int(np.argmax(high - low))
    middles = extent.low[:, axis] + extent.high[:, axis]
    order = np.argsort(middles, kind="stable")
    side = middles <= low[axis] + high[axis]
    if side.all() or not side.any():
        side = np.zeros(len(order), dtype=np.bool_)
        side[order[: len(order) // 2]] = True
    return side


def _as_parts(extent: _Extent, found: list[_Extent]) -> list[Part]:
    """What no part was found for, and what does not count, goes with the first."""
    found.sort(key=lambda each: -len(each.number))
    belongs = np.zeros(extent.count, dtype=np.int64)
    for place, each in enumerate(found):
        belongs[each.number] = place
    parts = []
    for place, each in enumerate(found):
        low, high = (corner + extent.offset for corner in each.box)
        parts.append(Part(0.5 * (low + high), low, high, belongs == place if len(found) > 1 else None))
    return parts
