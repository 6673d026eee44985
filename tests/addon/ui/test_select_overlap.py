"""Faces that overlap in the UV map."""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.addon.ui.select_overlap import select_overlap  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402

pytestmark = pytest.mark.usefixtures("empty_scene")

SQUARES = [(i, j, 0) for i in range(4) for j in (0, 1)]  # three squares in a row
FACES = [(2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1) for i in range(3)]


def uv(shifts: tuple[float, ...]) -> list[tuple[float, float]]:
    return [(shift + x / 4, y / 4) for shift in shifts for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
@pytest.mark.parametrize(("shifts", "found"), [((0, 0.125, 0.5), [0, 1]), ((0, 0.25, 0.5), []), ((0, 0, 0), [0, 1, 2])])
def test_those_that_overlap_are_selected(mode: str, shifts: tuple[float, ...], found: list[int]) -> None:
    obj = blender.mesh("Row", SQUARES, FACES, uv(shifts))
    bpy.context.view_layer.objects.active = obj
    obj.select_set(True)
    if mode == "EDIT":
        bpy.ops.object.mode_set(mode="EDIT")
    assert select_overlap(bpy.context) == len(found)
    assert obj.mode == "EDIT"
    bpy.ops.object.mode_set(mode="OBJECT")
    assert [polygon.index for polygon in obj.data.polygons if polygon.select] == found
