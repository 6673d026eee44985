"""Charts too long for an image are cut across until they fit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from occlusion_bake.core.base.errors import Cancelled
from occlusion_bake.core.base.kernel_api import Control
from occlusion_bake.core.charts.chart_boxes import ChartBoxes
from occlusion_bake.core.charts.chart_mesh import ChartMesh, connected
from occlusion_bake.core.charts.flat_charts import Cuts
from occlusion_bake.core.charts.long_charts import shortened
from occlusion_bake.core.charts.repair import Layout
from occlusion_bake.tests.oracles.charts.polygon_mesh import net


def ribbons(count: int, length: int) -> tuple[ChartMesh, Layout]:
    """Flat strips of `length` squares, each a chart."""
    x, y = np.meshgrid(np.arange(length + 1.0), [0.0, 1.0])
    vertices, triangles, polygons = (np.asarray(part, np.int64) for part in net(np.stack([x, y, 0.0 * x], axis=-1)))
    strip = np.arange(count, dtype=np.int64)
    points = (vertices + np.array([0, 3, 0]) * strip[:, None, None]).reshape(-1, 3)
    faces = (triangles + len(vertices) * strip[:, None, None]).reshape(-1, 3)
    polygon = (polygons + (int(polygons.max()) + 1) * strip[:, None]).ravel()
    mesh = connected(points.astype(float), faces, polygon)
    cuts = Cuts(np.repeat(strip, len(triangles)), np.zeros(len(mesh.twin), bool))
    return mesh, Layout(cuts, np.ascontiguousarray(mesh.corners[..., :2]))


def test_a_strip_is_cut_until_all_of_it_fits() -> None:
    mesh, layout = ribbons(1, 2000)
    short = shortened(mesh, layout, (512, 512), 2)
    box = ChartBoxes.of(short.cuts.label, short.cuts.count, short.uv)
    assert box.length.max() < np.sqrt(mesh.area.sum())  # the side of an image that they fill
    assert box.length.min() > box.length.max() / 3.0
    for polygon in range(2000):
        assert len(np.unique(short.cuts.label[mesh.polygon == polygon])) == 1


def test_what_is_short_stays_as_it_is() -> None:
    mesh, layout = ribbons(50, 4)
    short = shortened(mesh, layout, (512, 512), 2)
    assert np.array_equal(short.cuts.label, layout.cuts.label)
    assert np.array_equal(short.uv, layout.uv)


def test_it_can_be_cancelled() -> None:
    mesh, layout = ribbons(3, 500)
    with pytest.raises(Cancelled):
        shortened(mesh, layout, (512, 512), 2, Control(cancel=1))


def test_one_polygon_that_is_too_long_stays_beside_others_that_are_not() -> None:
    mesh, layout = ribbons(3, 500)
    first = np.where(mesh.polygon < 500, 0, mesh.polygon)  # the first strip is one polygon
    mesh = replace(mesh, polygon=np.unique(first, return_inverse=True)[1].ravel())
    short = shortened(mesh, layout, (512, 512), 2)
    assert len(np.unique(short.cuts.label[mesh.polygon == 0])) == 1
    assert short.cuts.count > 20
