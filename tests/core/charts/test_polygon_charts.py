"""Polygons that the draft cuts are put together, and nowhere over another triangle."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from occlusion_bake.core.charts import polygon_charts
from occlusion_bake.core.charts import unwrap as module
from occlusion_bake.core.charts.unwrap import unwrap
from occlusion_bake.tests.oracles.chart_layouts import chart_of, check, cover, quads, waves

pytest.importorskip("xatlas")


def test_polygons_are_cut_by_the_draft_and_mended(monkeypatch: pytest.MonkeyPatch) -> None:
    """The draft does cut quads of a curved sheet; the layout does not, and has hardly more charts."""
    mesh, cuts, drafts = waves(40), [], []
    drafted = module._drafted

    def spy(xatlas: Any, surface: Any) -> Any:
        chart, uv = drafted(xatlas, surface)
        cuts.append(int((chart[::2] != chart[1::2]).sum()))
        drafts.append(len(np.unique(chart)))
        return chart, uv

    monkeypatch.setattr(module, "_drafted", spy)
    result = unwrap("waves", *mesh)
    assert cuts[0] > 20
    check(mesh, result)
    label = chart_of(result.uv)
    assert (label[::2] == label[1::2]).all()
    assert result.count <= drafts[0] + 0.1 * cuts[0]


def test_a_polygon_that_fits_nowhere_becomes_a_chart(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(polygon_charts, "_misfits", lambda surface, chart, nodes, moved: moved)
    mesh = waves(20)
    result = unwrap("waves", *mesh, size=512)
    check(mesh, result)
    assert result.collapsed == 0
    hits, _ = cover(result.uv, chart_of(result.uv), 512, 512)
    assert hits.max() == 1
    monkeypatch.undo()
    assert result.count > unwrap("waves", *mesh).count


@pytest.mark.parametrize(
    ("corner", "fits"),
    [((0, 1), True), ((0.3, 0.9), True), ((0.9, 0.1), False), ((0.5, 0.5), False), ((-4, 4), False)],
    ids=["as on the surface", "bent", "mirrored", "flat", "overstretched"],
)
def test_misfits(corner: tuple[float, float], fits: bool) -> None:
    """A square's second triangle moves into the chart of the first; its last corner lies in different places."""
    side = module.SIDE
    surface = module._surface("square", *quads([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]]))
    nodes = polygon_charts.Nodes(4)
    nodes.add(np.zeros(4, int), np.arange(4), side * np.array([[0, 0], [1, 0], [1, 1], corner], float))
    found = polygon_charts._misfits(surface, np.zeros(2, int), nodes, np.array([False, True]))
    assert found.tolist() == [False, not fits]


def test_overlap_is_found_and_touching_is_not() -> None:
    """Against a lower triangle: one beside it, one across it, one inside it, one in another chart, one apart."""
    lower = [[0, 0], [1, 0], [0, 1]]
    beside, across, inside = (
        [[1, 0], [1, 1], [0, 1]],
        [[0.2, 0.2], [2, 0.2], [2, 2]],
        [[0.1, 0.1], [0.3, 0.1], [0.1, 0.3]],
    )
    apart = [[5, 5], [6, 5], [5, 6]]
    uv = np.array([lower, across, inside, lower, beside, apart], float)
    chart = np.array([0, 0, 0, 1, 2, 0])
    suspects = np.array([False, True, True, True, True, True])
    uv2, chart2 = np.concatenate([uv, [lower]]), np.append(chart, 2)
    found = polygon_charts._overlapping(chart2, uv2, np.append(suspects, False), np.ones(7, bool))
    assert found.tolist() == [False, True, True, False, False, False, False]
