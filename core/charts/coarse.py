"""The simplified mesh that charts are cut and joined on, and what was cut there carried over to the mesh itself.

Fine noise and fine tessellation would make charts small, and their making slow; on a simplified mesh they do neither.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.arrays import Flags, Longs
from ..base.kernel_api import Control
from .chart_mesh import ChartMesh, connected, triangle_groups
from .simplify import simplified

# How far the surface may move, a thousandth of its size being 1, and to how many triangles it may come down beyond
# that.
TOLERANCE, MOST = 2.0, 8_000


@dataclass(frozen=True, eq=False)
class CoarseMesh:
    """A simplified mesh. mesh: itself; origin: (T,) its triangle that each of the full mesh's is part of; locked:
    (3 T',) bool, its half-edges over which no chart may go."""

    mesh: ChartMesh
    origin: Longs
    locked: Flags

    @staticmethod
    def of(mesh: ChartMesh, locked: Flags, control: Control | None = None) -> CoarseMesh:
        """A mesh without its fine detail; lines that are locked, (3 T,) bool, stay."""
        result = simplified(mesh.points, mesh.triangles, locked.reshape(-1, 3), TOLERANCE, MOST, control=control)
        used, local = np.unique(result.triangles, return_inverse=True)
        count = len(result.survivors)
        coarse = connected(
            result.smoothed(mesh.points, TOLERANCE)[used],
            local.reshape(-1, 3).astype(np.int64),
            np.arange(count, dtype=np.int64),
        )
        return CoarseMesh(coarse, result.patch, _carried(mesh, locked, result.patch, coarse))


def _carried(mesh: ChartMesh, locked: Flags, origin: Longs, coarse: ChartMesh) -> Flags:
    """(3 T',) bool: half-edges of the coarse mesh between parts of the mesh that locked lines keep apart."""
    region = np.zeros(len(coarse.triangles), np.int64)
    region[origin] = triangle_groups(mesh, (mesh.twin >= 0) & ~locked)[0]
    return coarse.between(region)
