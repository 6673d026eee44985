"""Both sides of a UV seam, as an engine would show them: bilinear, at the same points of the surface."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ....core.base.arrays import Doubles, Flags, Floats, Ints
from ....core.finish.margin import fill_margin
from ....core.scene.scene import Mesh
from ..shapes import grid_cells
from .case import Judged

POINTS = 9  # along each edge, its ends left out
MARGIN = 4


def seam_edges(mesh: Mesh) -> Doubles:
    """UVs of the edges that two triangles share in space but not in the texture: (E, side, end, 2) float64."""
    assert mesh.uv is not None
    _, same = np.unique(mesh.vertices, axis=0, return_inverse=True)
    corners = np.asarray(same).reshape(-1)[mesh.triangles]
    found: dict[tuple[int, int], list[Doubles]] = {}
    for triangle, uv in zip(corners, mesh.uv.astype(np.float64), strict=True):
        for i in range(3):
            ends = np.array([i, (i + 1) % 3])
            ends = ends[np.argsort(triangle[ends])]
            found.setdefault((int(triangle[ends[0]]), int(triangle[ends[1]])), []).append(uv[ends])
    pairs = [np.stack(sides) for sides in found.values() if len(sides) == 2]
    torn = [pair for pair in pairs if np.abs(pair[0] - pair[1]).max() > 1e-6 and np.ptp(pair[0], axis=0).max() > 0]
    return np.stack(torn)


def jumps(edges: Doubles, image: Floats, covered: Flags) -> Doubles:
    """The first side less the second, at points along every edge: (E * POINTS,) float64."""
    filled = fill_margin(image.astype(np.float32), covered, MARGIN)
    share = (np.arange(POINTS, dtype=np.int64) + 0.5) / POINTS
    along = edges[:, :, None, 0] + share[:, None] * (edges[:, :, None, 1] - edges[:, :, None, 0])
    values = bilinear(filled, along)
    return (values[:, 0] - values[:, 1]).reshape(-1)


def bilinear(image: Floats, uv: Doubles) -> Doubles:
    """Values at (..., 2) UVs, clamped at the borders."""
    height, width = image.shape
    x, y = uv[..., 0] * width - 0.5, (1.0 - uv[..., 1]) * height - 0.5
    left, top = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    fx, fy = x - left, y - top

    def at(i: Ints, j: Ints) -> Doubles:
        return image[np.clip(j, 0, height - 1), np.clip(i, 0, width - 1)].astype(np.float64)

    above = at(left, top) * (1 - fx) + at(left + 1, top) * fx
    below = at(left, top + 1) * (1 - fx) + at(left + 1, top + 1) * fx
    between: Doubles = above * (1 - fy) + below * fy
    return between


def seam(judged: Judged) -> float:
    """RMS of the jumps that would be left without noise: the noise of their mean, from its spread over seeds, taken
    off."""
    edges = seam_edges(judged.view.target.mesh)
    covered = judged.view.covered
    each = np.array([jumps(edges, baked.maps["ao"].values, covered) for baked in judged.baked])
    squared = each.mean(axis=0) ** 2 - each.var(axis=0, ddof=1) / len(each)
    return float(np.sqrt(max(squared.mean(), 0.0)))


def no_seam(most: float) -> Callable[[Judged], list[str]]:
    """A check of a judged case: jumps of at most `most`, RMS, beyond noise."""

    def check(judged: Judged) -> list[str]:
        found = seam(judged)
        return [f"seams of {found:.4f}"] if found > most else []

    return check


def scattered(mesh: Mesh, charts: int) -> Mesh:
    """The mesh cut along lines of constant u into charts, each turned in its cell by another angle."""
    assert mesh.uv is not None
    uv = mesh.uv.astype(np.float64)
    part = np.minimum((uv[:, :, 0].mean(axis=1) * charts).astype(np.int64), charts - 1)
    cells = np.array(grid_cells(int(np.ceil(charts / 2)), 2))[part]
    angle = (0.3 + 1.1 * part)[:, None]
    place = uv * np.array([charts, 1.0]) - np.stack([part, 0 * part], axis=-1)[:, None] - 0.5
    turned = np.stack(
        [
            np.cos(angle) * place[..., 0] - np.sin(angle) * place[..., 1],
            np.sin(angle) * place[..., 0] + np.cos(angle) * place[..., 1],
        ],
        axis=-1,
    )
    middle = 0.5 * (cells[:, :2] + cells[:, 2:])
    side = (cells[:, 2:] - cells[:, :2]).min(axis=1)
    return replace(mesh, uv=(middle[:, None] + 0.6 * side[:, None, None] * turned).astype(np.float32))
