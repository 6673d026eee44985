"""Baked maps as colour attributes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.addon.job.runner import Runner  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402
from occlusion_bake.tests.oracles.blender import press, select  # noqa: E402


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


def lines() -> list[str]:
    return bpy.context.window_manager.occlusion_bake.lines.split("\n")


def meanwhile(monkeypatch: pytest.MonkeyPatch, act: Callable[[], None]) -> None:
    """Let the artist do something while the first object of the next press is baked."""
    poll, waiting = Runner.poll, [act]

    def polled(runner: Runner) -> bool:
        done = poll(runner)
        if waiting:
            waiting.pop()()
        return done

    monkeypatch.setattr(Runner, "poll", polled)


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


def test_a_vertex_group_of_the_name_stays() -> None:
    """Blender would call the colours AO.001, or not make them at all."""
    obj = blender.cube()
    obj.vertex_groups.new(name="AO")
    with pytest.raises(RuntimeError, match="Cube: it has a vertex group AO"):
        press()
    assert not obj.data.color_attributes


# Several at once


@pytest.fixture
def pair() -> tuple[Any, Any]:
    """Two cubes, selected, side by side."""
    cubes = tuple(blender.cube(name, location=(x, 0, 0)) for name, x in (("Left", 0), ("Right", 2.5)))
    select(*cubes)
    return cubes


def test_each_has_its_colours_and_what_concerns_all_is_told_once(pair: tuple[Any, Any]) -> None:
    """They share the occluders: what is wrong with one of these stands in one line."""
    broken = blender.plane("Broken")
    broken.data.vertices[0].co.x = float("nan")
    select(*pair)
    assert press() == {"FINISHED"}
    left, right = (colours(obj)[:, 0] for obj in pair)
    assert left.min() < 0.9 and np.sort(left) == pytest.approx(np.sort(right), abs=0.1)
    assert sum(line.startswith("Broken: ") for line in lines()) == 1


def test_each_by_itself(scene: Any, pair: tuple[Any, Any]) -> None:
    """A cube alone hides nothing of itself, whoever else is baked."""
    scene.occluders = "SELF"
    assert press() == {"FINISHED"}
    assert all(colours(obj).min() == 1.0 for obj in pair)


def test_of_those_that_share_a_mesh_the_first_is_baked(pair: tuple[Any, Any]) -> None:
    pair[1].data = pair[0].data
    assert press() == {"FINISHED"}
    assert any(line.startswith("Right: it shares its mesh, and with it the colors, with Left") for line in lines())


def rename() -> None:
    bpy.data.objects["Right"].name = "Renamed"


def go_to_another_scene() -> None:
    bpy.context.window.scene = bpy.data.scenes.new("Second")


def exclude() -> None:
    hidden = bpy.data.collections.new("Hidden")
    bpy.context.scene.collection.children.link(hidden)
    hidden.objects.link(bpy.data.objects["Right"])
    bpy.context.scene.collection.objects.unlink(bpy.data.objects["Right"])
    bpy.context.view_layer.layer_collection.children["Hidden"].exclude = True


def edit() -> None:
    bpy.context.view_layer.objects.active = bpy.data.objects["Right"]
    bpy.ops.object.mode_set(mode="EDIT")


def edit_in_another_scene() -> None:
    bpy.data.objects["Left"].select_set(False)
    edit()
    go_to_another_scene()


def make_points() -> None:
    select(bpy.data.objects["Right"])
    bpy.ops.object.convert(target="POINTCLOUD")


def subdivide() -> None:
    bpy.data.objects["Left"].select_set(False)
    edit()
    bpy.ops.mesh.subdivide()


@pytest.mark.parametrize("act", [rename, go_to_another_scene, exclude, edit])
def test_what_the_artist_does_meanwhile_changes_no_colour(
    monkeypatch: pytest.MonkeyPatch, pair: tuple[Any, Any], act: Callable[[], None]
) -> None:
    press()
    before = [colours(obj) for obj in pair]
    for obj in pair:
        obj.data.color_attributes.remove(obj.data.color_attributes["AO"])
    meanwhile(monkeypatch, act)
    assert press() == {"FINISHED"}
    edited = [obj.mode for obj in pair] == ["EDIT"] * 2
    assert edited == (act is edit)
    if edited:
        bpy.ops.object.mode_set(mode="OBJECT")
    for obj, values in zip(pair, before, strict=True):
        np.testing.assert_array_equal(colours(obj), values)


@pytest.mark.parametrize(
    ("act", "line"),
    [
        (lambda: bpy.data.objects.remove(bpy.data.objects["Right"]), "Right: removed during the bake"),
        (make_points, "Right: made another kind of object during the bake; nothing was written for it"),
        (subdivide, "Right: its faces were changed during the bake; bake again"),
        (edit_in_another_scene, "Right: it is in Edit Mode in another scene"),
        (lambda: bpy.data.objects["Right"].vertex_groups.new(name="AO"), "Right: it has a vertex group AO"),
    ],
)
def test_where_one_cannot_have_its_colours_any_more_the_others_do(
    monkeypatch: pytest.MonkeyPatch, pair: tuple[Any, Any], act: Callable[[], None], line: str
) -> None:
    meanwhile(monkeypatch, act)
    shown = bpy.context.scene
    assert press() == {"FINISHED"}
    bpy.context.window.scene = shown
    assert any(each.startswith(line) for each in lines())
    assert "AO" in pair[0].data.color_attributes
    assert [mesh.name for mesh in bpy.data.meshes if "AO" in mesh.color_attributes] == [pair[0].data.name]
