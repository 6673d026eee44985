"""One bake from Blender: who is baked, and charts where they are needed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.addon.charts import chart_layout  # noqa: E402
from occlusion_bake.addon.charts.chart_marks import CHART_MAP  # noqa: E402
from occlusion_bake.addon.charts.chart_request import CHARTS  # noqa: E402
from occlusion_bake.addon.job.bake_job import BakeJob, bake_steps, meshes_in_render  # noqa: E402
from occlusion_bake.addon.job.outcome import Outcome  # noqa: E402
from occlusion_bake.addon.job.runner import run  # noqa: E402
from occlusion_bake.core.base.errors import Cancelled, InputError  # noqa: E402
from occlusion_bake.core.finish.image_file import read_image  # noqa: E402
from occlusion_bake.core.progress import Progress  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402
from occlusion_bake.tests.oracles.settings import flat_settings  # noqa: E402

pytestmark = pytest.mark.usefixtures("empty_scene")


def uvs(obj: Any) -> dict[str, bytes]:
    """Every UV map of the mesh, bit for bit."""
    return {layer.name: blender.uv_of(obj.data, layer.name).tobytes() for layer in obj.data.uv_layers}


def go(*names: str, uv: str | None = None, progress: Progress | None = None, **settings: Any) -> tuple[Outcome, Any]:
    """Bake in this process: the outcome, and the results by name."""
    outcome, results, progress = Outcome(), {}, progress or Progress()
    job = BakeJob(blender.refs(*names), flat_settings(**{"width": 32, "height": 32, "rays": 2, **settings}), uv)
    steps = bake_steps(bpy.context, job, progress, outcome, lambda result: results.update({result.name: result.baked}))
    run(steps, progress)
    return outcome, results


def charted(outcome: Outcome) -> list[str]:
    """The objects whose meshes were given charts."""
    return [ref.label for ref in outcome.charting.made]


# Who is baked


def collection(name: str, parent: Any = None) -> Any:
    made = bpy.data.collections.new(name)
    (parent or bpy.context.scene.collection).children.link(made)
    return made


def move(obj: Any, *places: Any) -> Any:
    for each in list(obj.users_collection):
        each.objects.unlink(obj)
    for each in places:
        each.objects.link(obj)
    return obj


def seen() -> set[str]:
    return {obj.name for obj in meshes_in_render(bpy.context.view_layer)}


def test_what_renders_is_baked_and_nothing_else() -> None:
    blender.plane("Shown")
    blender.plane("Hidden").hide_render = True
    blender.plane("Not in the window").hide_viewport = True
    blender.plane("Closed eye").hide_set(True)
    blender.mesh("Points", ((0, 0, 0),), ())
    bpy.ops.object.light_add()
    bpy.ops.curve.primitive_bezier_circle_add()
    assert seen() == {"Shown", "Not in the window", "Closed eye"}


def test_collections_that_do_not_render() -> None:
    shown, hidden, excluded = collection("Shown"), collection("Hidden"), collection("Excluded")
    inner = collection("Inner", hidden)
    hidden.hide_render = True
    bpy.context.view_layer.layer_collection.children["Excluded"].exclude = True
    move(blender.plane("A"), shown)
    move(blender.plane("B"), hidden)
    move(blender.plane("C"), inner)
    move(blender.plane("D"), excluded)
    move(blender.plane("E"), hidden, shown)
    move(blender.plane("F"), hidden, excluded)
    assert seen() == {"A", "E"}


def test_an_instancer_that_does_not_show_itself() -> None:
    for name, shown in (("Scattered over", True), ("Scaffold", False)):
        parent = blender.plane(name)
        parent.instance_type = "VERTS"
        parent.show_instancer_for_render = shown
        blender.plane(f"Child of {name}").parent = parent
    assert "Scattered over" in seen() and "Scaffold" not in seen()


def test_faces_made_by_a_modifier_are_baked() -> None:
    profile = blender.mesh("Lathe", ((1, 0, 0), (1, 0, 1)), ())
    profile.data.edges.add(1)
    profile.data.edges[0].vertices = (0, 1)
    screw = profile.modifiers.new("Screw", "SCREW")
    screw.steps = screw.render_steps = 8
    screw.use_stretch_u = screw.use_stretch_v = True
    assert seen() == {"Lathe"}


# Charts


def baked_picture(run: Any, name: str) -> Any:
    return read_image(run.folder / f"{name}_ao.png")[0]


def test_charts_leave_the_artists_maps_alone(bake: Any) -> None:
    obj = blender.cube()
    obj.data.uv_layers.new(name="Second")
    before, active = uvs(obj), obj.data.uv_layers.active.name
    result = bake("--uv", "charts")
    assert result.status == 0, result.err
    assert result.files == ["Cube_ao.png", "report.json", "scene_charts.blend"]
    assert str(result.folder / "scene_charts.blend") in "\n".join(result.report["notes"])
    bpy.ops.wm.open_mainfile(filepath=str(result.folder / "scene_charts.blend"))
    obj = bpy.data.objects["Cube"]
    after = uvs(obj)
    assert after.keys() == {*before, CHART_MAP}
    assert {name: after[name] for name in before} == before
    assert obj.data.uv_layers.active.name == active


@pytest.mark.parametrize("bare", [False, True])
def test_the_saved_charts_give_the_same_texture(bake: Any, bare: bool) -> None:
    (blender.bare_cube if bare else blender.cube)("Cube")
    blender.plane("Ceiling", location=(0.4, 0.2, 1.3))
    first = bake("--objects", "Cube", *(() if bare else ("--uv", "charts")))
    picture = baked_picture(first, "Cube")
    assert picture.min() < 0.5 and picture.max() == 1.0
    copy = first.folder / "scene_charts.blend"
    for words in (("--uv", CHART_MAP), ("--uv", "charts")):
        (first.folder / "Cube_ao.png").unlink()
        again = bake("--objects", "Cube", *words, file=copy)
        np.testing.assert_array_equal(baked_picture(again, "Cube"), picture)
        assert again.report["notes"] == []  # no charts were made anew
        assert not (first.folder / "scene_charts_charts.blend").exists()


def test_charts_are_made_anew_for_another_mesh_or_size() -> None:
    obj = blender.bare_cube()
    assert charted(go("Bare")[0]) == ["Bare"]
    first = uvs(obj)
    assert first.keys() == {CHART_MAP}
    assert charted(go("Bare")[0]) == [] and uvs(obj) == first
    assert charted(go("Bare", width=64)[0]) == ["Bare"]
    assert charted(go("Bare")[0]) == ["Bare"] and uvs(obj) == first
    obj.data.vertices[0].co.x -= 1.0
    assert charted(go("Bare")[0]) == ["Bare"]
    assert uvs(obj).keys() == {CHART_MAP} and uvs(obj) != first


def test_only_meshes_without_a_map_get_charts_unasked() -> None:
    blender.cube("Mapped")
    blender.bare_cube("Bare", location=(5, 0, 0))
    outcome, results = go("Mapped", "Bare")
    assert charted(outcome) == ["Bare"] and results.keys() == {"Mapped", "Bare"}
    assert CHART_MAP not in bpy.data.objects["Mapped"].data.uv_layers
    assert charted(go("Mapped", "Bare", uv=CHARTS)[0]) == ["Mapped"]


def test_objects_that_share_a_mesh_share_its_charts() -> None:
    first = blender.bare_cube("First")
    second = bpy.data.objects.new("Second", first.data)
    second.location.x = 5.0
    bpy.context.scene.collection.objects.link(second)
    outcome, results = go("First", "Second")
    assert charted(outcome) == ["First", "Second"] and len(outcome.notes) == 1
    np.testing.assert_array_equal(results["First"].maps["ao"].covered, results["Second"].maps["ao"].covered)


def move_a_vertex() -> None:
    bpy.data.meshes[0].vertices[0].co.x -= 1.0


def take_out() -> None:
    bpy.context.scene.collection.objects.unlink(bpy.data.objects["Bare"])


def remove() -> None:
    bpy.data.objects.remove(bpy.data.objects["Bare"])


@pytest.mark.parametrize(
    ("act", "what"),
    [(move_a_vertex, "changed"), (take_out, "taken out of the view layer that is shown"), (remove, "removed")],
)
def test_a_mesh_changed_while_its_charts_are_made(
    monkeypatch: pytest.MonkeyPatch, act: Callable[[], None], what: str
) -> None:
    mesh = blender.bare_cube().data

    def meanwhile(*arguments: Any, **options: Any) -> Any:
        act()
        return unwrap(*arguments, **options)

    unwrap = chart_layout.unwrap_in_process
    monkeypatch.setattr(chart_layout, "unwrap_in_process", meanwhile)
    with pytest.raises(InputError, match=rf"^Bare: it was {what} while its charts were made; start again$"):
        go("Bare")
    assert not mesh.uv_layers


def test_a_linked_mesh_without_a_map_is_refused(tmp_path: Path) -> None:
    blender.bare_cube()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, wanted):
        wanted.objects = ["Bare"]
    bpy.context.scene.collection.objects.link(bpy.data.objects["Bare"])
    with pytest.raises(InputError, match=r"^Bare: .*library\.blend.*; make it local"):
        go("Bare")


# The steps


def test_results_come_in_order_as_they_are_done() -> None:
    for place, name in enumerate("CAB"):
        blender.plane(name, location=(0, 0, place))
    outcome, results = go("B", "C", "A")
    assert list(results) == [ref.label for ref in outcome.finished] == ["B", "C", "A"]
    assert outcome.refused == outcome.notes == []
    assert outcome.baker is not None


def test_one_that_is_refused_on_delivery_does_not_stop_the_others() -> None:
    blender.plane("One")
    blender.plane("Two", location=(0, 0, 3))

    def deliver(result: Any) -> None:
        if result.name == "One":
            raise InputError("One: nobody is at home; come again")

    progress, outcome = Progress(), Outcome()
    job = BakeJob(blender.refs("One", "Two"), flat_settings(width=8, height=8, rays=1))
    run(bake_steps(bpy.context, job, progress, outcome, deliver), progress)
    assert [ref.label for ref in outcome.finished] == ["Two"]
    assert outcome.complaint(2) == "1 of 2 objects could not be baked; One: nobody is at home; come again"


@pytest.mark.parametrize("bare", [False, True])
def test_a_cancelled_bake_delivers_nothing(bare: bool) -> None:
    (blender.bare_cube if bare else blender.cube)("Thing")
    progress, outcome, results = Progress(), Outcome(), []
    progress.cancel()
    job = BakeJob(blender.refs("Thing"), flat_settings(width=8, height=8))
    with pytest.raises(Cancelled):
        run(bake_steps(bpy.context, job, progress, outcome, lambda *each: results.append(each)), progress)
    assert results == outcome.finished == []
    assert CHART_MAP not in bpy.data.objects["Thing"].data.uv_layers


def test_progress_never_falls_and_ends_at_one() -> None:
    blender.plane("One")
    blender.plane("Two", location=(0, 0, 3))
    progress, seen = Progress(), []
    job = BakeJob(blender.refs("One", "Two"), flat_settings(width=8, height=8, rays=1))
    run(bake_steps(bpy.context, job, progress, Outcome(), lambda *_: seen.append(progress.fraction)), progress)
    assert seen == [0.5, 1.0] and progress.fraction == 1.0
