"""Work that comes to nothing leaves meshes as they were, but for what the artist did to them in the meantime."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.addon.charts.chart_marks import ATLAS_MAP, CHART_MAP, is_ours  # noqa: E402
from occlusion_bake.addon.charts.rollback import chart_rollback  # noqa: E402
from occlusion_bake.addon.job.bake_job import BakeJob, Layout, bake_steps  # noqa: E402
from occlusion_bake.addon.job.outcome import Outcome  # noqa: E402
from occlusion_bake.core.base.errors import Cancelled  # noqa: E402
from occlusion_bake.core.progress import Progress  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402
from occlusion_bake.tests.oracles.blender import bake_onto, select, set_panel, uv_of  # noqa: E402
from occlusion_bake.tests.oracles.settings import flat_settings  # noqa: E402

KEY = "occlusion_bake_charts"
SIZE = 64


@pytest.fixture(autouse=True)
def scene(registered: None, empty_scene: None, charts_here: None) -> Any:
    return set_panel(width=SIZE, height=SIZE, quality="RAYS", rays=1, margin=2, threads=2)


def nothing() -> None:
    pass


def cancelled(*names: str, act: Callable[[], None] = nothing, size: int = 2 * SIZE, atlas: str = "") -> None:
    """A bake that is cancelled once all charts are made; `act` is what the artist does before that."""
    progress, outcome = Progress(), Outcome()
    job = BakeJob(blender.refs(*names), flat_settings(width=size, height=size, rays=1), layout=Layout(atlas))
    steps = bake_steps(bpy.context, job, progress, outcome, lambda result: pytest.fail("delivered"))
    with pytest.raises(Cancelled), chart_rollback(bpy.context, outcome.charting.changes, outcome.finished):
        task = next(steps)
        while outcome.baker is None:
            task = steps.send(task())
        assert outcome.charting.made
        act()
        steps.throw(Cancelled())


def uvs(obj: Any, name: str = CHART_MAP) -> bytes:
    return uv_of(obj.data, name).tobytes()


def names(obj: Any) -> list[str]:
    return [layer.name for layer in obj.data.uv_layers]


def marks(obj: Any) -> list[str]:
    return [key for key in obj.data.keys() if "occlusion" in key]  # noqa: SIM118


def toggle(obj: Any) -> None:
    if obj.mode == "EDIT":
        bpy.ops.object.mode_set(mode="OBJECT")
    else:
        select(obj)
        bpy.ops.object.mode_set(mode="EDIT")


def enter(mode: str, obj: Any) -> None:
    if obj.mode != mode:
        toggle(obj)


@pytest.mark.parametrize("toggles", [False, True])
@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_charts_of_before_come_back_in_every_mode(mode: str, toggles: bool) -> None:
    """Those that are made anew for another size."""
    obj = blender.bare_cube()
    bake_onto("Bare")
    before, mark = uvs(obj), obj.data[KEY]
    enter(mode, obj)
    cancelled("Bare", act=lambda: toggle(obj) if toggles else None)
    assert (obj.mode == mode) != toggles
    enter("OBJECT", obj)
    assert uvs(obj) == before and obj.data[KEY] == mark and is_ours(obj.data, CHART_MAP)
    assert bake_onto("Bare") == {"FINISHED"} and "charts" not in bpy.context.window_manager.occlusion_bake.lines


@pytest.mark.parametrize("toggles", [False, True])
@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_new_charts_are_gone_in_every_mode(mode: str, toggles: bool) -> None:
    obj = blender.bare_cube()
    enter(mode, obj)
    cancelled("Bare", act=lambda: toggle(obj) if toggles else None)
    enter("OBJECT", obj)
    assert names(obj) == marks(obj) == []


@pytest.mark.parametrize("back", [False, True])
@pytest.mark.parametrize("charted", [False, True])
def test_what_the_artist_edits_meanwhile_stays(charted: bool, back: bool) -> None:
    """In Edit Mode, be it left again or not."""
    obj = blender.bare_cube()
    if charted:
        bake_onto("Bare")

    def edit() -> None:
        enter("OBJECT", obj)
        for corner in obj.data.polygons[2].loop_indices:
            obj.data.uv_layers[CHART_MAP].uv[corner].vector *= 0.5
        edited.append(uvs(obj))
        if not back:
            toggle(obj)

    edited: list[bytes] = []
    cancelled("Bare", act=edit)
    enter("OBJECT", obj)
    assert names(obj) == [CHART_MAP] and [uvs(obj)] == edited and not is_ours(obj.data, CHART_MAP)


def test_what_the_artist_renames_meanwhile_stays() -> None:
    obj = blender.bare_cube()

    def rename() -> None:
        obj.data.uv_layers[CHART_MAP].name = "Mine"

    cancelled("Bare", act=rename)
    assert names(obj) == ["Mine"]


def test_a_mesh_that_has_other_faces_by_now_keeps_its_new_charts_and_their_mark() -> None:
    """The UVs of before are of corners that are no more."""
    obj = blender.bare_cube()
    bake_onto("Bare")

    def extrude() -> None:
        toggle(obj)
        bpy.ops.mesh.select_all(action="SELECT")
        bpy.ops.mesh.duplicate()
        bpy.ops.transform.translate(value=(5, 0, 0))

    mark = obj.data[KEY]
    cancelled("Bare", act=extrude)
    enter("OBJECT", obj)
    assert obj.data[KEY] != mark and is_ours(obj.data, CHART_MAP)


def test_the_active_map_is_that_of_before() -> None:
    """Charts that are made, or stand, become active in the place of others of ours."""
    objects = [blender.bare_cube("One"), blender.bare_cube("Two", location=(5, 0, 0))]
    bake_onto("One", "Two")
    active = lambda: [obj.data.uv_layers.active.name for obj in objects]  # noqa: E731
    cancelled("One", "Two", atlas="Set")
    assert active() == [CHART_MAP] * 2 and names(objects[0]) == [CHART_MAP]
    set_panel(layout="ATLAS", atlas="Set")
    bake_onto("One", "Two")
    assert active() == [ATLAS_MAP] * 2
    blender.bare_cube("Three", location=(0, 5, 0))
    cancelled("One", "Two", "Three", size=SIZE)  # the charts of two stand
    assert active() == [ATLAS_MAP] * 2


def test_objects_that_the_artist_removes_or_converts_are_left() -> None:
    obj, gone = blender.bare_cube(), blender.bare_cube("Gone", location=(5, 0, 0))

    def act() -> None:
        bpy.data.objects.remove(gone)
        select(obj)
        bpy.ops.object.convert(target="POINTCLOUD")

    cancelled("Bare", "Gone", act=act)
    assert obj.type == "POINTCLOUD"
