"""Charts are joined along one stretch of border, and in the same way on a finer mesh."""

from __future__ import annotations

from typing import Any

import numpy as np
from occlusion_bake.core.charts.chart_mesh import ChartMesh, connected
from occlusion_bake.core.charts.flat_charts import FlatCharts, lay_flat
from occlusion_bake.core.charts.joins import Tree, absorbed, joined, replayed
from occlusion_bake.tests.oracles.charts.round_shapes import dome, tube


def mesh_of(mesh: Any) -> ChartMesh:
    vertices, triangles, polygons = mesh
    return connected(vertices.astype(float), triangles.astype(np.int64), polygons.astype(np.int64))


def flat(charts: FlatCharts) -> Any:
    return charts.good(1.01, 1.05)


def sectors(mesh: ChartMesh, count: int) -> Any:
    """(T,) labels by the angle about the z axis."""
    middle = mesh.corners.mean(axis=1)
    of_polygon = np.arctan2(*(np.bincount(mesh.polygon, middle[:, axis]) for axis in (1, 0)))
    return np.floor((of_polygon / (2 * np.pi) % 1.0) * count).astype(np.int64)[mesh.polygon]


def free(mesh: ChartMesh) -> Any:
    return np.zeros(len(mesh.twin), bool)


def test_an_open_tube_is_unrolled_into_one_chart() -> None:
    mesh = mesh_of(tube(64, rows=4))
    label = sectors(mesh, 4)
    tree = joined(mesh, label, free(mesh), flat)
    assert len(tree.children) == 3
    cuts, name = replayed(mesh, label, free(mesh), tree)
    assert cuts.count == 1
    assert name.tolist() == [tree.leaves + 2]
    charts = lay_flat(mesh, cuts)
    assert charts.laid.all()
    assert charts.good(1.001, 1.01).all()
    assert np.count_nonzero(cuts.slit) == 2 * 4, "cut along one line from rim to rim, both its sides"


def test_what_cannot_lie_flat_together_stays_apart() -> None:
    mesh = mesh_of(dome(32))
    label = sectors(mesh, 8)
    tree = joined(mesh, label, free(mesh), flat)
    cuts, _ = replayed(mesh, label, free(mesh), tree)
    assert cuts.count > 1
    single = np.bincount(cuts.label) == np.bincount(label).max()
    assert flat(lay_flat(mesh, cuts))[~single].all()


def test_locked_edges_are_not_joined_over() -> None:
    mesh = mesh_of(tube(64, rows=4))
    label = sectors(mesh, 4)
    border = (mesh.twin >= 0) & (label[mesh.across] != np.repeat(label, 3))
    assert joined(mesh, label, border, flat).children == []


def test_a_finer_mesh_is_joined_likewise() -> None:
    coarse, fine = mesh_of(tube(32, rows=2)), mesh_of(tube(256, rows=16))
    tree = joined(coarse, sectors(coarse, 4), free(coarse), flat)
    cuts, _ = replayed(fine, sectors(fine, 4), free(fine), tree)
    assert cuts.count == 1
    assert flat(lay_flat(fine, cuts)).all()


def test_a_pair_that_does_not_touch_stays_two() -> None:
    mesh = mesh_of(tube(64))
    cuts, name = replayed(mesh, sectors(mesh, 4), free(mesh), Tree(4, [(0, 2), (4, 1)], [1, 2]))
    assert cuts.count == 4
    assert name.tolist() == [0, 1, 2, 3]


def test_a_chart_within_another_goes_to_it() -> None:
    mesh = mesh_of(tube(64, rows=8))
    half = (sectors(mesh, 2) == 1).astype(np.int64)
    middle = mesh.corners.mean(axis=1)
    patch = np.bincount(mesh.polygon, np.abs(middle[:, 2] - middle[:, 2].mean())) < 1.0
    patch &= np.bincount(mesh.polygon, np.abs(middle[:, 0])) < 1.0
    label = half + 2 * (half * patch[mesh.polygon])
    label = np.unique(label, return_inverse=True)[1].ravel()
    assert label.max() == 2
    assert np.array_equal(absorbed(mesh, label, free(mesh), lambda charts: charts.good(1.1, 1.2)), half)
