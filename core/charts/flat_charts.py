"""Charts laid flat, and how well that went."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..base.arrays import Doubles, Flags, Longs
from ..base.kernel_api import Control
from .chart_boxes import ChartBoxes
from .chart_mesh import ChartMesh, corner_classes
from .flatten import FLATTENED, flattened
from .overlaps import lowest_overlaps

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


def lay_flat(mesh: ChartMesh, cuts: Cuts, control: Control | None = None, *, most: int | None = None) -> FlatCharts:
    """Flatten the charts of a mesh, all its triangles being in one; those that are no planes and of more than `most`
    triangles are not. Raises Cancelled."""
    order = np.argsort(cuts.label, kind="stable")
    starts = np.searchsorted(cuts.label[order], np.arange(cuts.count + 1, dtype=np.int64))
    vertex, count = corner_classes(mesh.twin, cuts.joined(mesh))
    points = np.empty((count, 3))
    points[vertex] = mesh.corners.reshape(-1, 3)
    corners = vertex.reshape(-1, 3)[order]
    flat, stretch, state = flattened(points, corners, starts, most=most, control=control)
    laid = state == FLATTENED
    uv, squared = np.empty((len(order), 3, 2)), np.empty(len(order))
    uv[order], squared[order] = flat[corners], stretch
    uv[~laid[cuts.label]] = 0.0
    overlap = lowest_overlaps(uv, _OVERLAP, cuts.label.astype(np.int32), cuts.count, control=control)
    return FlatCharts(cuts.label, mesh.area, uv, laid, squared, overlap.astype(np.int64))
