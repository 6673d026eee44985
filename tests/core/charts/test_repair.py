"""Charts that do not fit are cut until they do: as they were joined first, then in halves."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from occlusion_bake.core.base.errors import Cancelled
from occlusion_bake.core.base.kernel_api import Control
from occlusion_bake.core.charts.chart_mesh import ChartMesh, connected, triangle_groups
from occlusion_bake.core.charts.flat_charts import Cuts, FlatCharts, lay_flat
from occlusion_bake.core.charts.joins import Tree, replayed
from occlusion_bake.core.charts.repair import Joins, good_charts
from occlusion_bake.tests.oracles.charts.organic import ball
from occlusion_bake.tests.oracles.charts.polygon_mesh import net
from occlusion_bake.tests.oracles.charts.round_shapes import spring, tube


def mesh_of(mesh: Any) -> ChartMesh:
    vertices, triangles, polygons = mesh
    return connected(vertices.astype(float), triangles.astype(np.int64), polygons.astype(np.int64))


def uncut(mesh: ChartMesh) -> Cuts:
    return Cuts(np.zeros(len(mesh.triangles), np.int64), np.zeros(len(mesh.twin), bool))


def fits(flat: FlatCharts) -> Any:
    return flat.good(1.1, 1.5)


def check(mesh: ChartMesh, cuts: Cuts) -> None:
    """Each chart is in one piece, polygons are whole, all can be laid flat."""
    assert triangle_groups(mesh, cuts.joined(mesh))[1] == cuts.count
    for polygon in np.unique(mesh.polygon):
        assert len(np.unique(cuts.label[mesh.polygon == polygon])) == 1
    assert fits(lay_flat(mesh, cuts)).all()


def test_a_ball_is_cut_until_it_lies_flat() -> None:
    mesh = mesh_of(ball(3))
    layout = good_charts(mesh, uncut(mesh), fits)
    check(mesh, layout.cuts)
    assert 2 <= layout.cuts.count <= 12


def test_a_ring_is_cut_across_into_two_discs() -> None:
    mesh = mesh_of(tube(64, rows=4))
    layout = good_charts(mesh, uncut(mesh), fits)
    check(mesh, layout.cuts)
    assert layout.cuts.count == 2


def test_what_lies_on_itself_is_cut() -> None:
    """A flat ribbon that goes round more than once, each time over itself."""
    turn = np.linspace(0.0, 5.0 * np.pi, 120)
    ring = np.stack([np.cos(turn), np.sin(turn), 1e-3 * turn], axis=1)
    mesh = mesh_of(net(np.stack([ring * [0.8, 0.8, 1.0], ring], axis=1)))
    whole = lay_flat(mesh, uncut(mesh))
    assert whole.overlap[0, 0] >= 0
    layout = good_charts(mesh, uncut(mesh), fits)
    check(mesh, layout.cuts)
    assert layout.cuts.count >= 3


def test_a_join_that_does_not_fit_comes_apart_as_it_was() -> None:
    mesh = mesh_of(spring(16, turns=2.0))
    halves = good_charts(mesh, uncut(mesh), fits).cuts
    tree = Tree(halves.count, [(0, 1)], [1])
    cuts, name = replayed(mesh, halves.label, np.zeros(len(mesh.twin), bool), tree)
    nothing_joined = good_charts(
        mesh, cuts, lambda flat: flat.areas <= halves_area(mesh, halves), Joins(tree, name, halves.label)
    )
    assert nothing_joined.cuts.count == halves.count
    pairs = np.unique(np.stack([nothing_joined.cuts.label, halves.label]), axis=1)
    assert pairs.shape[1] == halves.count


def halves_area(mesh: ChartMesh, cuts: Cuts) -> float:
    return float(np.bincount(cuts.label, mesh.area).max()) * (1.0 + 1e-9)


def test_a_polygon_that_is_no_surface_falls_into_triangles() -> None:
    """Three triangles of one polygon on one edge: no disc, and nothing to cut it along."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]], float)
    mesh = connected(points, np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]]), np.zeros(3, np.int64))
    layout = good_charts(mesh, uncut(mesh), fits)
    assert layout.cuts.count == 3
    assert lay_flat(mesh, layout.cuts).laid.all()


def test_cutting_can_be_cancelled() -> None:
    mesh = mesh_of(net(np.stack(np.meshgrid(np.arange(9.0), np.arange(9.0), [0.0]), axis=-1)[:, :, 0]))
    control = Control()

    def none_fits(flat: FlatCharts) -> Any:
        control.cancel = 1  # while charts are judged, so that it is the cutting that is told
        return np.zeros(len(flat.laid), bool)

    with pytest.raises(Cancelled):
        good_charts(mesh, uncut(mesh), none_fits, control=control)
