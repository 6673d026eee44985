"""Charts laid flat, and how well that went."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..base.arrays import Doubles, Flags, Longs
from ..base.kernel_api import Control
from ..base.triangles import square, tangents, uv_area_of
from .chart_boxes import ChartBoxes
from .chart_mesh import ChartMesh, corner_classes
from .flatten import FLATTENED, flattened
from .overlaps import overlapping

# A chart is a plane where no triangle leans off it by more than this (1 - cosine), and no corner stands off it by more
# than this part of its size.
_LEAN, _HEIGHT = 1e-6, 1e-4
_MOST_PAIRS = 1 << 16
_OVERLAP = 1e-3  # units: a triangle that lies less deep in another does not overlap it


@dataclass(frozen=True, eq=False)
class Cuts:
    """Where a mesh is cut. label: (T,) the chart of each triangle, from 0. slit: (3 T,) bool, half-edges that are cut
    though one chart lies on both sides."""

    label: Longs
    slit: Flags

    @property
    def count(self) -> int:
        """Of charts."""
        return int(self.label.max(initial=-1)) + 1

    def joined(self, mesh: ChartMesh) -> Flags:
        """(3 T,) bool: half-edges over which a chart goes on."""
        return np.asarray((mesh.twin >= 0) & ~mesh.between(self.label) & ~self.slit)


@dataclass(frozen=True, eq=False)
class FlatCharts:
    """Charts laid flat, each by itself, in the units of the surface.

    label: (T,) the chart of each triangle. area: (T,) on the surface. uv: (T, 3, 2). laid: (C,) bool, whether it could
    be, each triangle facing up. squared: (T,) squares of the L2 stretch (Sander et al. 2001), after one scale for each
    chart; 1 where it is not known. overlap: (C, 2) two triangles of a chart that lie on one another, or -1.
    """

    label: Longs
    area: Doubles
    uv: Doubles
    laid: Flags
    squared: Doubles
    overlap: Longs

    @cached_property
    def areas(self) -> Doubles:
        """(C,) of the charts on the surface."""
        return np.bincount(self.label, self.area, len(self.laid)).astype(np.float64)

    @cached_property
    def fill(self) -> Doubles:
        """(C,) the part of its box that each chart fills."""
        box = ChartBoxes.of(self.label, len(self.laid), self.uv).area
        return np.divide(self.areas, box, out=np.ones_like(box), where=box > 0.0)

    def good(self, l2: float, p95: float) -> Flags:
        """(C,) bool: charts without overlap, the root mean square of whose stretch, and its 95th percentile, are no
        more than this."""
        count, whole = len(self.laid), self.areas
        mean = np.bincount(self.label, self.area * self.squared, count) <= l2 * l2 * whole
        most = np.bincount(self.label, np.where(self.squared > p95 * p95, self.area, 0.0), count) <= 0.05 * whole
        return np.asarray(self.laid & mean & most & (self.overlap[:, 0] < 0))


def lay_flat(mesh: ChartMesh, cuts: Cuts, control: Control | None = None) -> FlatCharts:
    """Flatten the charts of a mesh, all its triangles being in one. Raises Cancelled."""
    order = np.argsort(cuts.label, kind="stable")
    starts = np.searchsorted(cuts.label[order], np.arange(cuts.count + 1))
    uv, plane = _projected(mesh, order, starts)
    laid = plane.copy()
    bent = order[np.repeat(~plane, np.diff(starts))]
    if len(bent):
        vertex, _ = corner_classes(mesh.twin, cuts.joined(mesh))
        used, local = np.unique(vertex.reshape(-1, 3)[bent], return_inverse=True)
        local = local.reshape(-1, 3)
        points = np.empty((len(used), 3))
        points[local] = mesh.corners[bent]
        sizes = np.diff(starts)[~plane]
        flat, state = flattened(points, local, np.concatenate([[0], np.cumsum(sizes)]), control=control)
        uv[bent] = flat[local]
        laid[~plane] = state == FLATTENED
    uv[~laid[cuts.label]] = 0.0
    squared = _squared_stretch(mesh, cuts.label, cuts.count, uv)
    return FlatCharts(cuts.label, mesh.area, uv, laid, squared, _overlaps(uv, cuts, control))


def _overlaps(uv: Doubles, cuts: Cuts, control: Control | None) -> Longs:
    """(C, 2) two triangles of each chart that lie on one another, or -1."""
    overlap = np.full((cuts.count, 2), -1)
    group = cuts.label.astype(np.int32)
    while True:
        chosen = np.flatnonzero(overlap[cuts.label, 0] < 0)
        pairs = chosen[overlapping(uv[chosen], _OVERLAP, group=group[chosen], most=_MOST_PAIRS, control=control)]
        overlap[cuts.label[pairs[::-1, 0]]] = pairs[::-1]
        if len(pairs) < _MOST_PAIRS:  # else charts that no pair was found of may have some all the same
            return overlap


def planes(mesh: ChartMesh, label: Longs) -> Flags:
    """(C,) bool: which groups of triangles, label (T,), are planes."""
    order = np.argsort(label, kind="stable")
    return _projected(mesh, order, np.searchsorted(label[order], np.arange(int(label.max()) + 2)))[1]


def _projected(mesh: ChartMesh, order: Longs, starts: Longs) -> tuple[Doubles, Flags]:
    """Charts that are planes, of any outline, onto them: (T, 3, 2) UVs, (C,) bool which are."""
    count = len(starts) - 1
    weighted = mesh.normals * mesh.area[:, None]
    total = np.add.reduceat(weighted[order], starts[:-1], axis=0)
    length = np.linalg.norm(total, axis=1, keepdims=True)
    normal = np.divide(total, length, out=np.zeros_like(total), where=length > 0.0)
    chart = np.empty(len(order), np.int64)
    chart[order] = np.repeat(np.arange(count), np.diff(starts))
    lean = np.where(mesh.area > 0.0, 1.0 - (mesh.normals * normal[chart]).sum(axis=1), 0.0)
    plane = (length[:, 0] > 0.0) & (np.maximum.reduceat(lean[order], starts[:-1]) <= _LEAN)
    uv = np.zeros((len(chart), 3, 2))
    flat = order[np.repeat(plane, np.diff(starts))]
    if not len(flat):
        return uv, plane
    chart, corners = chart[flat], mesh.corners[flat]
    offset = corners - mesh.corners[order[starts[:-1]], 0][chart][:, None]
    height = np.abs((offset * normal[chart][:, None]).sum(axis=2)).max(axis=1)
    size = np.sqrt(square(offset)).max(axis=1)
    begins = np.flatnonzero(np.append(True, chart[1:] != chart[:-1]))
    plane[chart[begins]] = np.maximum.reduceat(height, begins) <= _HEIGHT * np.maximum.reduceat(size, begins)
    along, up = _axes(normal)
    uv[flat, :, 0] = (offset * along[chart][:, None]).sum(axis=2)
    uv[flat, :, 1] = (offset * up[chart][:, None]).sum(axis=2)
    return uv, plane


def _axes(normal: Doubles) -> tuple[Doubles, Doubles]:
    """(n, 3) each: two directions in planes, which make a right-handed frame with the normals."""
    axis = np.zeros_like(normal)
    axis[np.arange(len(normal)), np.argmin(np.abs(normal), axis=1)] = 1.0
    along = np.cross(axis, normal)
    length = np.linalg.norm(along, axis=1, keepdims=True)
    along = np.divide(along, length, out=np.zeros_like(along), where=length > 0.0)
    return along, np.cross(normal, along)


def _squared_stretch(mesh: ChartMesh, label: Longs, count: int, uv: Doubles) -> Doubles:
    """(T,) squares of the L2 stretch, after one scale for each chart; 1 for triangles without area, here or there."""
    flat = uv_area_of(uv)
    good = (flat > 0.0) & (mesh.area > 0.0)
    along_u, along_v = tangents(mesh.corners[good], uv[good])
    which = label[good]
    scale = np.bincount(which, flat[good], count) / np.maximum(np.bincount(which, mesh.area[good], count), 1e-300)
    squared = np.ones(len(label))
    squared[good] = 0.5 * (square(along_u) + square(along_v)) * scale[which]
    return squared
