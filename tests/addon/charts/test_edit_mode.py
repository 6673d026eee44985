"""Charts while the artist is in Edit Mode, and while they undo: what is edited counts, and their steps of undo stay."""

from __future__ import annotations

from typing import Any

import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.addon.charts.chart_marks import CHART_MAP, is_ours  # noqa: E402
from occlusion_bake.addon.job.bake_job import BakeJob, prepared_charts  # noqa: E402
from occlusion_bake.addon.job.outcome import Outcome  # noqa: E402
from occlusion_bake.core.base.errors import InputError  # noqa: E402
from occlusion_bake.core.progress import Progress  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402
from occlusion_bake.tests.oracles.blender import press, select, set_panel  # noqa: E402
from occlusion_bake.tests.oracles.settings import flat_settings  # noqa: E402


@pytest.fixture(autouse=True)
def scene(registered: None, empty_scene: None, charts_here: None) -> Any:
    bpy.context.preferences.edit.undo_steps = 256
    yield set_panel(width=64, height=64, quality="RAYS", rays=1, margin=0, threads=2)
    bpy.context.preferences.edit.undo_steps = 32


def said() -> str:
    return bpy.context.window_manager.occlusion_bake.lines


def edit(*objects: Any) -> None:
    select(*objects)
    bpy.ops.object.mode_set(mode="EDIT")


def steps_of_undo(capfd: pytest.CaptureFixture[str]) -> int:
    capfd.readouterr()
    bpy.context.window_manager.print_undo_steps()
    return sum("name=" in line for line in capfd.readouterr().out.splitlines())


@pytest.mark.parametrize("button", ["unwrap", "bake"])
def test_steps_of_undo_do_not_grow_with_the_number_of_objects(button: str, capfd: pytest.CaptureFixture[str]) -> None:
    added = []
    for count in (1, 4):
        objects = [blender.bare_cube(f"{count} {i}", location=(5 * i, 0, 0)) for i in range(count)]
        edit(*objects)
        bpy.ops.ed.undo_push(message="Before")
        before = steps_of_undo(capfd)
        assert press(button) == {"FINISHED"} and said().count(" charts in the UV map") == count
        added.append(steps_of_undo(capfd) - before)
        bpy.ops.object.mode_set(mode="OBJECT")
    assert 0 < added[0] == added[1] <= 8


def test_a_mesh_in_edit_mode_is_charted_as_it_is_edited() -> None:
    obj = blender.bare_cube()
    edit(obj)
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.subdivide()
    assert press() == {"FINISHED"} and "Bare: 6 charts" in said()
    assert obj.mode == "EDIT"
    bpy.ops.object.mode_set(mode="OBJECT")
    assert len(obj.data.polygons) == 24 and is_ours(obj.data, CHART_MAP)
    edit(obj)
    assert press() == {"FINISHED"} and "charts" not in said()


@pytest.mark.parametrize("active", ["Bare", "Other", None])
def test_an_object_that_is_edited_in_another_scene_where_it_is_too(active: str | None) -> None:
    """Whichever is active here."""
    obj, here = blender.bare_cube(), bpy.context.window.scene
    blender.bare_cube("Other", location=(5, 0, 0))
    there = bpy.data.scenes.new("There")
    there.collection.objects.link(obj)
    bpy.context.window.scene = there
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.context.window.scene = here
    select(obj)
    shown = bpy.data.objects[active] if active else None
    bpy.context.view_layer.objects.active = shown
    assert press("unwrap") == {"FINISHED"} and "Bare: 6 charts" in said()
    assert obj.mode == "EDIT" and bpy.context.view_layer.objects.active == shown
    assert [each.name for each in bpy.context.selected_objects] == ["Bare"]
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.mode_set(mode="OBJECT")
    assert [layer.name for layer in obj.data.uv_layers] == [CHART_MAP]


def undone_meanwhile() -> Outcome:
    """Charts, while which are made the artist undoes a step."""
    outcome = Outcome()
    job = BakeJob(blender.refs("Bare"), flat_settings(width=64, height=64, rays=1))
    steps = prepared_charts(bpy.context, job, Progress(), outcome)
    made = next(steps)()
    assert bpy.ops.ed.undo() == {"FINISHED"}
    with pytest.raises(StopIteration):
        steps.send(made)
    return outcome


def test_an_undo_while_charts_are_made_that_leaves_the_mesh_alone() -> None:
    blender.bare_cube()
    bpy.ops.ed.undo_push(message="Made")
    bpy.context.scene.frame_end = 77
    bpy.ops.ed.undo_push(message="Another end")
    outcome = undone_meanwhile()
    assert bpy.context.scene.frame_end != 77
    assert [ref.label for ref in outcome.charting.made] == ["Bare"]
    assert is_ours(bpy.data.objects["Bare"].data, CHART_MAP)


def test_an_undo_of_the_mesh_while_charts_are_made() -> None:
    obj = blender.bare_cube()
    bpy.ops.ed.undo_push(message="Made")
    obj.data.vertices[0].co.x -= 1.0
    bpy.ops.ed.undo_push(message="Moved")
    with pytest.raises(InputError, match="Bare: it was changed while its charts were made; start again"):
        undone_meanwhile()
    assert not bpy.data.objects["Bare"].data.uv_layers
