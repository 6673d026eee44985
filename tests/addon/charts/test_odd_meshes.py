"""Meshes of every odd kind: charts, or a line; never a hang, and what lies in the image lies there properly."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.addon.charts.base_mesh import base_triangles  # noqa: E402
from occlusion_bake.addon.charts.chart_marks import CHART_MAP  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402
from occlusion_bake.tests.oracles.blender import press, select, set_panel  # noqa: E402
from occlusion_bake.tests.oracles.charts.judge import TOLERANCE, assert_sound_layout, uv_areas  # noqa: E402
from occlusion_bake.tests.oracles.charts.overlaps import overlaps  # noqa: E402
from occlusion_bake.tests.oracles.charts.polygon_mesh import PolygonMesh  # noqa: E402

NAN = float("nan")
SQUARE = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0))


@pytest.fixture(autouse=True)
def scene(registered: None, empty_scene: None, charts_here: None) -> Any:
    return set_panel(width=64, height=64, quality="RAYS", rays=1, margin=0, threads=2)


def ring(sides: int, inner: float = 1.0) -> list[tuple[float, float, float]]:
    """A polygon; every other corner at `inner`."""
    return [
        (math.cos(turn) * radius, math.sin(turn) * radius, 0.0)
        for i in range(sides)
        for turn, radius in [(2.0 * math.pi * i / sides, inner if i % 2 else 1.0)]
    ]


def many(count: int, corners: Any = SQUARE) -> tuple[list[Any], list[Any]]:
    """So many of one polygon, each with corners of its own, in one place."""
    size = len(corners)
    return [each for _ in range(count) for each in corners], [range(size * i, size * (i + 1)) for i in range(count)]


SOUND = {
    "one triangle": (((0, 0, 0), (1, 0, 0), (0, 1, 0)), ((0, 1, 2),)),
    "three faces at an edge": (
        ((0, 0, 0), (0, 0, 1), (1, 0, 0), (1, 0, 1), (-1, 1, 0), (-1, 1, 1), (-1, -1, 0), (-1, -1, 1)),
        ((0, 2, 3, 1), (0, 4, 5, 1), (0, 6, 7, 1)),
    ),
    "faces that turn otherwise": ((*SQUARE, (2, 0, 0), (2, 1, 0)), ((0, 1, 2, 3), (1, 2, 5, 4))),
    "a polygon of 64 corners": (ring(64), (range(64),)),
    "a star": (ring(20, 0.3), (range(20),)),
    "a hundred faces on one place": many(100),
    "a face in two places of one size": many(2, [(0, 0, 0), (1e-3, 0, 0), (0, 1e-3, 0)]),
    "a needle beside a face": ((*SQUARE, (0, 2, 0), (1e3, 2, 0), (1e3, 2.0001, 0)), ((0, 1, 2, 3), (4, 5, 6))),
    "two faces that share a corner alone": ((*SQUARE, (2, 1, 0), (2, 2, 0), (1, 2, 0)), ((0, 1, 2, 3), (2, 4, 5, 6))),
    "a face without an area beside one that has": ((*SQUARE, (5, 5, 5)), ((0, 1, 2, 3), (0, 1, 4), (4, 0, 2))),
    "far from the origin": ([(1e4 + x, 1e4 + y, 0) for x, y, _ in SQUARE], ((0, 1, 2, 3),)),
    "as small as can be": ([(1e-4 * x, 1e-4 * y, 0) for x, y, _ in SQUARE], ((0, 1, 2, 3),)),
}
FOLDED = ("three faces at an edge", "a face without an area beside one that has")  # by Smart UV Project itself
UNSOUND = {
    "all at one point": ([(3, 3, 3)] * 8, ((0, 1, 2, 3), (4, 5, 6, 7))),
    "all on a line": ([(x, 0, 0) for x in range(6)], ((0, 1, 2), (3, 4, 5))),
    "vertices that are no numbers": ([(NAN, 0, 0)] * 4, ((0, 1, 2, 3),)),
    "no faces": (SQUARE, ()),
}


def charted(obj: Any) -> set[str]:
    """By the button that makes charts."""
    select(obj)
    return press("unwrap")


def duplicates() -> Any:
    """A cube each face of which is there twice, by the same vertices."""
    obj = blender.bare_cube("Odd")
    mesh = obj.data
    places = [tuple(vertex.co) for vertex in mesh.vertices]
    faces = [tuple(each.vertices) for each in mesh.polygons]
    twice = bpy.data.meshes.new("Odd")
    twice.from_pydata(places, [], [*faces, *faces])
    obj.data = twice
    return obj


def check_charts(obj: Any, size: int = 64, *, folded: bool = False) -> Any:
    """Those of ours hold what holds of all; those of Blender's do not lie on one another, unless it is known to fold
    them. Returns their UVs."""
    base, uv = base_triangles(bpy.context, obj), blender.triangle_uv(obj.data, CHART_MAP)
    if bpy.context.scene.occlusion_bake.uv != "SMART":
        assert_sound_layout(PolygonMesh(base.vertices, base.triangles, base.polygons), uv, (size, size))
    assert uv.min() >= 0.0 and uv.max() <= 1.0 and uv_areas(uv).any()
    assert folded or not len(overlaps(uv.astype(np.float64) * size, TOLERANCE)[0])
    return uv


@pytest.mark.parametrize("unwrap", ["ACTIVE", "SMART"])
@pytest.mark.parametrize("kind", SOUND)
def test_a_mesh_that_has_an_area_gets_charts(kind: str, unwrap: str) -> None:
    obj = blender.mesh("Odd", *SOUND[kind])
    set_panel(uv=unwrap)
    assert charted(obj) == {"FINISHED"}
    check_charts(obj, folded=unwrap == "SMART" and kind in FOLDED)


@pytest.mark.parametrize("unwrap", ["ACTIVE", "SMART"])
def test_faces_that_are_there_twice_get_charts(unwrap: str) -> None:
    obj = duplicates()
    set_panel(uv=unwrap)
    assert charted(obj) == {"FINISHED"}
    check_charts(obj, folded=unwrap == "SMART")


@pytest.mark.parametrize(("kind", "unwrap"), [(kind, uv) for kind in UNSOUND for uv in ("ACTIVE", "SMART")])
def test_a_mesh_that_has_none_is_refused_in_a_line(kind: str, unwrap: str) -> None:
    """And keeps no map of a layout that came to nothing."""
    obj = blender.mesh("Odd", *UNSOUND[kind])
    set_panel(uv=unwrap)
    with pytest.raises(RuntimeError, match=r"^Error: Odd: [^\n]+\n?$"):
        charted(obj)
    assert not obj.data.uv_layers


# Blender's own unwrap


@pytest.mark.parametrize("size", [256, 32, 8])
def test_many_small_charts_of_smart_uv_project_fit_and_the_room_left_is_told(size: int) -> None:
    """Fifty faces: with margins that Blender's own packing could only hold by shrinking all charts to points."""
    vertices, faces = [], []
    for i in range(50):
        x, y, side = 2 * (i % 10), 2 * (i // 10), 0.5 + 0.02 * i
        faces.append(range(4 * i, 4 * i + 4))
        vertices += [(x, y, 0), (x + side, y, 0), (x + side, y + side, 0), (x, y + side, 0)]
    obj = blender.mesh("Odd", vertices, faces)
    set_panel(uv="SMART", width=size, height=size)
    assert charted(obj) == {"FINISHED"}
    said = bpy.context.window_manager.occlusion_bake.lines
    assert "Odd: 50 charts by Smart UV Project" in said and "UVs overlap" not in said
    assert ("of 4 texels between charts" in said) == (size < 64)
    areas = np.abs(uv_areas(check_charts(obj, size)))
    assert areas.min() > 0.0 and areas.sum() > 0.15
