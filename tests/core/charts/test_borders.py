"""Labels become charts: polygons whole, in one piece, with short borders that keep to creases."""

from __future__ import annotations

from typing import Any

import numpy as np
from occlusion_bake.core.charts.borders import settled
from occlusion_bake.core.charts.chart_mesh import ChartMesh, connected
from occlusion_bake.tests.oracles.charts.hard_surface import cube
from occlusion_bake.tests.oracles.charts.organic import waves


def mesh_of(mesh: Any) -> ChartMesh:
    vertices, triangles, polygons = mesh
    return connected(vertices.astype(float), triangles.astype(np.int64), polygons.astype(np.int64))


def free(mesh: ChartMesh) -> Any:
    return np.zeros(len(mesh.twin), bool)


def border_length(mesh: ChartMesh, label: Any) -> float:
    inner = np.flatnonzero(mesh.twin >= 0)
    return float(mesh.lengths[inner[label[inner // 3] != label[mesh.across[inner]]]].sum()) / 2.0


def test_polygons_are_whole_and_charts_are_in_one_piece() -> None:
    mesh = mesh_of(waves(30))
    label = np.random.default_rng(1).integers(0, 5, len(mesh.triangles))
    chart = settled(mesh, label, free(mesh))
    assert (chart[::2] == chart[1::2]).all()
    assert chart.min() == 0
    assert len(np.unique(chart)) == chart.max() + 1
    again = settled(mesh, chart, free(mesh))
    assert len(np.unique(again)) <= len(np.unique(chart))


def test_a_ragged_border_becomes_short() -> None:
    """Two halves of a flat sheet, their border ragged by two quads: not much longer than straight afterwards."""
    x, y = np.meshgrid(np.arange(41.0), np.arange(41.0), indexing="ij")
    first = (np.arange(40, dtype=np.int64)[:, None] * 41 + np.arange(40, dtype=np.int64)).ravel()
    corners = np.stack([first, first + 41, first + 42, first + 1], axis=1)
    triangles = corners[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    mesh = connected(
        np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3), triangles, np.repeat(np.arange(1600, dtype=np.int64), 2)
    )
    middle = mesh.corners.mean(axis=1)
    tooth = np.random.default_rng(2).integers(-2, 3, 40)
    label = (middle[:, 0] > 20 + tooth[np.floor(middle[:, 1]).astype(np.int64)]).astype(np.int64)
    chart = settled(mesh, label, free(mesh))
    assert chart.max() == 1
    assert border_length(mesh, chart) < 1.25 * 40 < 0.6 * border_length(mesh, label)
    assert abs(np.count_nonzero(chart) / len(chart) - 0.5) < 0.05, "neither side eats the other"


def test_a_few_large_polygons_keep_their_charts() -> None:
    """A cube's faces stay six charts, though one chart would have no border at all."""
    mesh = mesh_of(cube())
    assert settled(mesh, mesh.polygon, free(mesh)).max() == 5


def test_scraps_go_to_the_neighbour_with_the_longest_border() -> None:
    mesh = mesh_of(waves(20))
    label = (mesh.corners.mean(axis=1)[:, 0] > 0).astype(np.int64)
    label[mesh.polygon == 20 * 4 + 10] = 1  # one quad amid the others
    assert settled(mesh, label, free(mesh)).max() == 1


def test_locked_edges_stay_borders() -> None:
    mesh = mesh_of(waves(20))
    side = mesh.corners.mean(axis=1)[:, 1] > 0.4
    locked = (mesh.twin >= 0) & (side[mesh.across] != np.repeat(side, 3))
    chart = settled(mesh, np.zeros(len(side), np.int64), locked)
    assert chart.max() == 1
    assert len(set(zip(side.tolist(), chart.tolist(), strict=True))) == 2
