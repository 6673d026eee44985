"""What we make is the artist's to keep: renamed or edited, it is never written over nor removed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.addon.charts.chart_marks import ATLAS_MAP, CHART_MAP, is_ours, mark_of, set_mark  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402
from occlusion_bake.tests.oracles.blender import bake_onto, press, select, set_panel  # noqa: E402

KEY = "occlusion_bake_charts"


@pytest.fixture(autouse=True)
def scene(registered: None, empty_scene: None, charts_here: None) -> Any:
    return set_panel(width=64, height=64, quality="RAYS", rays=1, margin=2, threads=2)


def said() -> str:
    return bpy.context.window_manager.occlusion_bake.lines


def uvs(obj: Any, name: str = CHART_MAP) -> bytes:
    return blender.uv_of(obj.data, name).tobytes()


def names(obj: Any) -> list[str]:
    return [layer.name for layer in obj.data.uv_layers]


def charted(name: str = "Bare") -> Any:
    """A cube with charts of ours, and no other map."""
    obj = blender.bare_cube(name)
    assert bake_onto(name) == {"FINISHED"}
    assert names(obj) == [CHART_MAP] and is_ours(obj.data, CHART_MAP)
    return obj


def move_a_face(obj: Any, name: str = CHART_MAP) -> None:
    """As in the UV editor."""
    uv = obj.data.uv_layers[name].uv
    for corner in obj.data.polygons[2].loop_indices:
        uv[corner].vector = uv[corner].vector * 0.5


def move_a_vertex(obj: Any) -> None:
    obj.data.vertices[0].co.x -= 0.5
    obj.data.update()


def in_edit_mode(obj: Any, act: Callable[[], Any]) -> None:
    select(obj)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    act()
    bpy.ops.object.mode_set(mode="OBJECT")


def extrude_a_face(obj: Any) -> None:
    def act() -> None:
        bpy.ops.mesh.select_all(action="DESELECT")
        bpy.ops.mesh.select_mode(type="FACE")
        bpy.ops.object.mode_set(mode="OBJECT")
        obj.data.polygons[0].select = True
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.extrude_region_move(TRANSFORM_OT_translate={"value": (-1, 0, 0)})

    in_edit_mode(obj, act)


# Whose a map is


def test_into_edit_mode_and_back_is_no_edit() -> None:
    obj = charted()
    in_edit_mode(obj, lambda: None)
    assert is_ours(obj.data, CHART_MAP)


@pytest.mark.parametrize("edit", [move_a_vertex, extrude_a_face])
def test_an_edit_of_the_mesh_leaves_the_map_ours(edit: Callable[[Any], None]) -> None:
    """And charts are made anew, as it has no others."""
    obj = charted()
    before = uvs(obj)
    edit(obj)
    assert is_ours(obj.data, CHART_MAP)
    assert bake_onto("Bare") == {"FINISHED"}
    assert "charts in the UV map" in said() and names(obj) == [CHART_MAP] and uvs(obj) != before


@pytest.mark.parametrize("edit", [None, move_a_vertex, extrude_a_face])
def test_an_edited_map_is_the_artists_whatever_becomes_of_the_mesh(edit: Callable[[Any], None] | None) -> None:
    """It is baked onto as any map of theirs, and new charts refuse to take its place."""
    obj = charted()
    move_a_face(obj)
    if edit is not None:
        edit(obj)
    assert not is_ours(obj.data, CHART_MAP)
    before = uvs(obj)
    assert bake_onto("Bare") == {"FINISHED"}
    assert "charts" not in said() and uvs(obj) == before
    set_panel(uv="CHARTS", width=128)
    with pytest.raises(RuntimeError, match=rf"Bare: new charts would take the place of its UV map {CHART_MAP}.*rename"):
        bake_onto("Bare")
    assert uvs(obj) == before and names(obj) == [CHART_MAP]


def subdivide(obj: Any) -> None:
    in_edit_mode(obj, bpy.ops.mesh.subdivide)


def move_and_extrude(obj: Any) -> None:
    in_edit_mode(obj, lambda: bpy.ops.transform.translate(value=(3, 0, 0)))
    extrude_a_face(obj)


@pytest.mark.parametrize("edit", [subdivide, move_and_extrude])
def test_where_no_face_is_where_it_was_the_map_is_the_artists(edit: Callable[[Any], None]) -> None:
    """None is left to tell whether its UVs were edited."""
    obj = charted()
    edit(obj)
    move_a_face(obj)
    assert not is_ours(obj.data, CHART_MAP)
    before = uvs(obj)
    assert bake_onto("Bare") == {"FINISHED"}
    assert "charts in the UV map" not in said() and uvs(obj) == before


def test_a_face_among_many_is_known() -> None:
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=100, y_subdivisions=100, calc_uvs=False)
    obj = bpy.context.object
    obj.data.uv_layers.new(name=CHART_MAP)
    set_mark(obj.data, CHART_MAP, "made for something")
    extrude_a_face(obj)
    assert is_ours(obj.data, CHART_MAP)
    obj.data.uv_layers[CHART_MAP].uv[4 * 5000].vector.x += 0.01
    assert not is_ours(obj.data, CHART_MAP)


def test_charts_that_fit_stay_with_an_artists_touch() -> None:
    """New Charts leaves those made before that still fit, and what was moved by hand since."""
    obj = charted()
    move_a_face(obj)
    before = uvs(obj)
    set_panel(uv="CHARTS")
    assert bake_onto("Bare") == {"FINISHED"}
    assert "charts" not in said() and uvs(obj) == before


def test_a_renamed_map_is_kept_beside_new_charts() -> None:
    obj = charted()
    before = uvs(obj)
    obj.data.uv_layers[CHART_MAP].name = "Mine"
    assert bake_onto("Bare") == {"FINISHED"}
    assert names(obj) == ["Mine"] and "charts" not in said()
    set_panel(uv="CHARTS", width=128)
    assert bake_onto("Bare") == {"FINISHED"}
    assert names(obj) == ["Mine", CHART_MAP] and uvs(obj, "Mine") == before
    assert obj.data.uv_layers.active.name == "Mine"


def test_a_map_of_our_name_that_we_did_not_make_is_the_artists() -> None:
    obj = blender.cube()
    obj.data.uv_layers[0].name = CHART_MAP
    before = uvs(obj)
    assert not is_ours(obj.data, CHART_MAP) and mark_of(obj.data, CHART_MAP) is None
    assert bake_onto("Cube") == {"FINISHED"} and uvs(obj) == before
    with pytest.raises(RuntimeError, match=r"Cube: new charts would take the place"):
        press("unwrap")
    assert uvs(obj) == before


def test_unwrap_refuses_an_edited_map_and_does_the_others() -> None:
    edited = charted("Edited")
    move_a_face(edited)
    before = uvs(edited)
    fresh = blender.bare_cube("Fresh", location=(5, 0, 0))
    select(edited, fresh)
    set_panel(width=128)
    assert press("unwrap") == {"FINISHED"}
    assert "Edited: new charts would take the place" in said() and "Fresh: 6 charts" in said()
    assert uvs(edited) == before and names(fresh) == [CHART_MAP]


# Atlases


def test_an_edited_part_of_an_atlas_stays_while_the_atlas_fits() -> None:
    """A new member makes it anew, but for that part, which is refused."""
    objects = [blender.bare_cube("One"), blender.bare_cube("Two", location=(5, 0, 0))]
    set_panel(layout="ATLAS", atlas="Set")
    assert bake_onto("One", "Two") == {"FINISHED"}
    move_a_face(objects[0], ATLAS_MAP)
    before = [uvs(obj, ATLAS_MAP) for obj in objects]
    assert bake_onto("One", "Two") == {"FINISHED"}
    assert "charts" not in said() and [uvs(obj, ATLAS_MAP) for obj in objects] == before
    blender.bare_cube("Three", location=(0, 5, 0))
    assert bake_onto("One", "Two", "Three") == {"FINISHED"}
    assert "One: new charts would take the place" in said() and "Set: 12 charts" in said()
    assert uvs(objects[0], ATLAS_MAP) == before[0] and uvs(objects[1], ATLAS_MAP) != before[1]
    set_panel(uv="CHARTS")
    assert bake_onto("One", "Two", "Three") == {"FINISHED"}
    assert "One: new charts would take the place" in said() and "Set:" in said() and "12 charts" not in said()


# Marks


def test_a_seam_that_is_marked_makes_charts_anew() -> None:
    obj = charted()
    obj.data.edges[0].use_seam = True
    assert bake_onto("Bare") == {"FINISHED"} and "Bare: 6 charts" in said()
    assert bake_onto("Bare") == {"FINISHED"} and "charts" not in said()


@pytest.mark.parametrize("text", ["{", "{}", "[]", '{"made_for": "x"}', ""])
def test_a_mark_that_says_nothing_makes_nothing_ours(text: str) -> None:
    obj = charted()
    obj.data[KEY] = text
    before = uvs(obj)
    assert not is_ours(obj.data, CHART_MAP)
    set_panel(uv="CHARTS", width=128)
    with pytest.raises(RuntimeError, match="rename it to keep it"):
        bake_onto("Bare")
    assert uvs(obj) == before


def test_marks_are_kept_in_the_file(tmp_path: Any) -> None:
    obj = charted()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "kept.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "kept.blend"))
    obj = bpy.data.objects["Bare"]
    assert is_ours(obj.data, CHART_MAP)
    extrude_a_face(obj)
    assert is_ours(obj.data, CHART_MAP)
    move_a_face(obj)
    assert not is_ours(obj.data, CHART_MAP)
