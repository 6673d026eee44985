"""Charts of Blender's own head: no two of its triangles on one texel, coarse or subdivided."""

from __future__ import annotations

from typing import Any

import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.addon.charts.base_mesh import base_triangles  # noqa: E402
from occlusion_bake.core.charts.unwrap import unwrap  # noqa: E402
from occlusion_bake.tests.oracles.charts.judge import assert_sound  # noqa: E402
from occlusion_bake.tests.oracles.charts.polygon_mesh import PolygonMesh  # noqa: E402


def suzanne(levels: int) -> PolygonMesh:
    bpy.ops.mesh.primitive_monkey_add()
    head: Any = bpy.context.object
    if levels:
        head.modifiers.new("Subdivision", "SUBSURF").levels = levels
        bpy.ops.object.modifier_apply(modifier="Subdivision")
    base = base_triangles(bpy.context, head)
    return PolygonMesh(base.vertices, base.triangles, base.polygons)


@pytest.mark.parametrize("size", [128, 1024])
@pytest.mark.parametrize("levels", [0, 1])
def test_suzanne_is_charted_soundly(empty_scene: None, levels: int, size: int) -> None:
    mesh = suzanne(levels)
    assert_sound(mesh, unwrap("Suzanne", *mesh, size=size, padding=4), (size, size), 4)
