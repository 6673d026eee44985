"""Meshes that cannot be given a UV map: refused before anything is made, and left as they were."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.addon.charts import chart_layout  # noqa: E402
from occlusion_bake.addon.charts.chart_marks import CHART_MAP  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402
from occlusion_bake.tests.oracles.blender import bake_onto, set_panel  # noqa: E402


@pytest.fixture(autouse=True)
def scene(registered: None, empty_scene: None, monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.setattr(chart_layout, "unwrap_in_process", lambda *_, **__: pytest.fail("unwrapped in vain"))
    monkeypatch.setattr(chart_layout, "smart_unwrap", lambda *_, **__: pytest.fail("unwrapped in vain"))
    return set_panel(width=64, height=64, quality="RAYS", rays=1, margin=0, threads=2)


def vertex_group(obj: Any) -> None:
    obj.vertex_groups.new(name=CHART_MAP)


def attribute(obj: Any) -> None:
    obj.data.attributes.new(CHART_MAP, "FLOAT", "POINT")


def full(obj: Any) -> None:
    for i in range(8):
        obj.data.uv_layers.new(name=f"Map {i}")


def dyntopo(obj: Any) -> None:
    bpy.ops.object.mode_set(mode="SCULPT")
    bpy.ops.sculpt.dynamic_topology_toggle()


def edited_in_another_scene(obj: Any) -> None:
    """By another object of the same mesh."""
    other, here = bpy.data.scenes.new("Other"), bpy.context.window.scene
    twin = bpy.data.objects.new("Twin", obj.data)
    other.collection.objects.link(twin)
    bpy.context.window.scene = other
    bpy.context.view_layer.objects.active = twin
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.context.window.scene = here


HINDERED: dict[str, tuple[Callable[[Any], None], str]] = {
    "vertex group": (vertex_group, f"it has a vertex group {CHART_MAP}, as its UV map would be called; rename that"),
    "attribute": (attribute, f"it has an attribute {CHART_MAP}, as its UV map would be called; rename that"),
    "full": (full, "Blender has no room for another UV map on its mesh; remove one"),
    "dyntopo": (dyntopo, "it is sculpted with Dyntopo; leave that, and start again"),
    "edited": (edited_in_another_scene, "it is in Edit Mode in another scene; leave that, and start again"),
}


@pytest.mark.parametrize("remade", [False, True])
@pytest.mark.parametrize("kind", HINDERED)
def test_a_mesh_that_cannot_be_given_charts_is_told_so_at_once(kind: str, remade: bool) -> None:
    """remade: by a modifier for which charts are tried."""
    obj = blender.bare_cube()
    if remade:
        obj.modifiers.new("Smooth", "SMOOTH" if kind == "dyntopo" else "NODES")
    hinder, line = HINDERED[kind]
    hinder(obj)
    before = [layer.name for layer in obj.data.uv_layers]
    set_panel(uv="CHARTS")
    with pytest.raises(RuntimeError, match=f"Bare: {line}"):
        if obj.mode == "OBJECT":
            bake_onto("Bare")
        else:
            blender.press()
    assert [layer.name for layer in obj.data.uv_layers] == before
    assert not [key for key in obj.data.keys() if "occlusion" in key]  # noqa: SIM118
