"""Baked maps as colour attributes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.tests.oracles import blender  # noqa: E402
from occlusion_bake.tests.oracles.blender import press  # noqa: E402


@pytest.fixture(autouse=True)
def scene(registered: None, empty_scene: None) -> Any:
    chosen = bpy.context.scene.occlusion_bake
    chosen.quality, chosen.rays, chosen.threads, chosen.output = "RAYS", 64, 2, "COLOURS"
    return chosen


def colours(obj: Any, name: str = "AO") -> Any:
    """(corners, 4)."""
    attribute = obj.data.color_attributes[name]
    values = np.empty(4 * len(obj.data.loops), np.float32)
    attribute.data.foreach_get("color", values)
    return values.reshape(-1, 4)


def test_a_mesh_without_uvs_gets_colours_and_nothing_else(scene: Any) -> None:
    obj = blender.bare_cube(location=(0, 0, 1))
    blender.plane("Floor", location=(0, 0, -0.001)).scale = (5, 5, 1)
    obj.select_set(True)
    bpy.data.objects["Floor"].select_set(False)
    scene.use_ro = True
    assert press() == {"FINISHED"}
    assert [each.name for each in obj.data.color_attributes] == ["AO", "RO 10"]
    assert not obj.data.uv_layers and not bpy.data.images and not bpy.data.materials
    values = colours(obj)
    assert np.all(values[:, 3] == 1) and np.all(values[:, 0] == values[:, 1])
    height = np.array([obj.data.vertices[loop.vertex_index].co.z for loop in obj.data.loops])
    up = np.array([polygon.normal.z for polygon in obj.data.polygons for _ in polygon.loop_indices])
    assert np.all(values[up > 0.9, 0] == 1.0) and np.all(values[up < -0.9, 0] < 0.05)  # the top, what lies on the floor
    sides = abs(up) < 0.1
    assert values[sides & (height < 0), 0].max() < values[sides & (height > 0), 0].min()


def test_again_into_the_same_attribute(scene: Any) -> None:
    obj = blender.cube()
    press()
    scene.use_ground = True
    press()
    assert [each.name for each in obj.data.color_attributes] == ["AO"] and colours(obj)[:, 0].min() < 0.1


def test_a_bent_mesh_is_baked_as_it_is_bent(scene: Any) -> None:
    """A modifier that moves vertices counts, and one that makes others is refused by a line, nothing changed."""
    obj = blender.cube()
    obj.modifiers.new("Cast", "CAST").factor = 0.5
    assert press() == {"FINISHED"}
    obj.data.color_attributes.remove(obj.data.color_attributes["AO"])
    obj.modifiers.new("Array", "ARRAY").count = 2
    with pytest.raises(RuntimeError, match="Cube: its modifiers make other faces than the mesh has"):
        press()
    assert not obj.data.color_attributes


def test_an_attribute_of_another_kind_stays() -> None:
    obj = blender.cube()
    obj.data.attributes.new("AO", "FLOAT", "POINT").data[0].value = 0.25
    with pytest.raises(RuntimeError, match="Cube: it has an attribute AO of another kind"):
        press()
    assert obj.data.attributes["AO"].data[0].value == 0.25


def test_several_at_once() -> None:
    for x in (0, 3):
        blender.cube(f"Cube {x}", location=(x, 0, 0))
    bpy.ops.object.select_all(action="SELECT")
    assert press() == {"FINISHED"}
    assert all("AO" in obj.data.color_attributes for obj in bpy.data.objects)
