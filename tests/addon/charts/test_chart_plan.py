"""Which UV map an object is baked onto, and when charts are made for it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.addon.charts.chart_marks import ATLAS_MAP, CHART_MAP, is_ours  # noqa: E402
from occlusion_bake.addon.job.bake_job import BakeJob, Layout, bake_steps  # noqa: E402
from occlusion_bake.addon.job.outcome import Outcome  # noqa: E402
from occlusion_bake.addon.job.runner import run  # noqa: E402
from occlusion_bake.core.progress import Progress  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402
from occlusion_bake.tests.oracles.blender import bake_onto, press, select, set_panel, uv_of  # noqa: E402
from occlusion_bake.tests.oracles.settings import flat_settings  # noqa: E402


@pytest.fixture(autouse=True)
def scene(registered: None, empty_scene: None, charts_here: None) -> Any:
    return set_panel(width=64, height=64, quality="RAYS", rays=1, margin=0, threads=2)


def said() -> str:
    return bpy.context.window_manager.occlusion_bake.lines


def names(obj: Any) -> list[str]:
    return [layer.name for layer in obj.data.uv_layers]


def onto(*names: str, atlas: str = "") -> list[str]:
    """The UV maps that a bake with these settings is onto, by object."""
    found: list[str] = []
    job = BakeJob(blender.refs(*names), flat_settings(width=64, height=64, rays=1), layout=Layout(atlas))
    progress, outcome = Progress(), Outcome()
    deliver = lambda result: found.extend(target.mesh.uv_map for target in result.targets)  # noqa: E731
    run(bake_steps(bpy.context, job, progress, outcome, deliver), progress)
    assert not outcome.charting.made
    return found


def empty_map(modifier: bool) -> Any:
    """A cube with a UV map in which all is at one place. modifier: nodes that change nothing, as Smooth by Angle."""
    obj = blender.cube("Flat")
    obj.data.uv_layers[0].uv.foreach_set("vector", np.zeros(2 * len(obj.data.loops), np.float32))
    if modifier:
        group = bpy.data.node_groups.new("Same", "GeometryNodeTree")
        for direction in ("INPUT", "OUTPUT"):
            group.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
        start, end = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
        group.links.new(start.outputs[0], end.inputs[0])
        obj.modifiers.new("Same", "NODES").node_group = group
    return obj


@pytest.mark.parametrize("modifier", [False, True])
def test_a_map_in_which_nothing_has_an_area_counts_as_none(modifier: bool) -> None:
    """Charts are made, and baked onto, though the artist's map stays the active one."""
    obj = empty_map(modifier)
    assert bake_onto("Flat") == {"FINISHED"} and "Flat: 6 charts in the UV map Occlusion Bake" in said()
    assert names(obj) == ["UVMap", CHART_MAP] and obj.data.uv_layers.active.name == "UVMap"
    assert bake_onto("Flat") == {"FINISHED"} and "charts" not in said()
    assert onto("Flat") == [CHART_MAP]


def test_charts_that_were_made_by_their_button_are_baked_onto() -> None:
    obj = empty_map(modifier=True)
    select(obj)
    assert press("unwrap") == {"FINISHED"}
    assert press() == {"FINISHED"} and "charts" not in said()
    assert onto("Flat") == [CHART_MAP]


def test_of_an_atlas_the_map_that_was_laid_out_in_it_is_the_objects_own() -> None:
    """Where the artist shows the atlas' map, an image of the object's own is baked onto the map that it came from."""
    one = blender.plane("One")
    blender.plane("Two", location=(5, 0, 0))
    set_panel(layout="ATLAS", atlas="Set")
    bake_onto("One", "Two")
    assert names(one) == ["UVMap", ATLAS_MAP]
    one.data.uv_layers.active = one.data.uv_layers[ATLAS_MAP]
    set_panel(layout="EACH")
    assert bake_onto("One") == {"FINISHED"} and "charts" not in said()
    assert names(one) == ["UVMap", ATLAS_MAP] and one.data.uv_layers.active.name == ATLAS_MAP
    assert onto("One") == ["UVMap"]


def test_an_atlas_map_that_was_edited_is_baked_onto_as_any_other() -> None:
    one = blender.plane("One")
    blender.plane("Two", location=(5, 0, 0))
    set_panel(layout="ATLAS", atlas="Set")
    bake_onto("One", "Two")
    one.data.uv_layers.active = one.data.uv_layers[ATLAS_MAP]
    one.data.uv_layers[ATLAS_MAP].uv.foreach_set("vector", 0.5 * uv_of(one.data, "UVMap").reshape(-1))
    assert onto("One") == [ATLAS_MAP]


def test_maps_of_their_own_that_leave_room_are_used_whichever_is_active() -> None:
    """Those of an atlas that was made of them before they did."""
    boxes = [((x, 0), (x + 0.4, 0), (x + 0.4, 1), (x, 1)) for x in (0.0, 0.6)]
    objects = [blender.plane(name, location=(5 * i, 0, 0)) for i, name in enumerate(("One", "Two"))]
    set_panel(layout="ATLAS", atlas="Set")
    bake_onto("One", "Two")
    for obj, box in zip(objects, boxes, strict=True):
        obj.data.uv_layers["UVMap"].uv.foreach_set("vector", np.array(box, np.float32).reshape(-1))
        obj.data.uv_layers.active = obj.data.uv_layers[ATLAS_MAP]
    assert onto("One", "Two", atlas="Set") == ["UVMap"] * 2


# What is copied, linked, or of several shapes


def test_a_copy_has_the_charts_of_what_it_was_copied_from() -> None:
    obj = blender.bare_cube()
    bake_onto("Bare")
    twin, copy = bpy.data.objects.new("Twin", obj.data), bpy.data.objects.new("Copy", obj.data.copy())
    for each in (twin, copy):
        bpy.context.scene.collection.objects.link(each)
    assert is_ours(copy.data, CHART_MAP)
    assert bake_onto("Bare", "Twin", "Copy") == {"FINISHED"} and "charts" not in said()


def test_a_copy_of_a_map_is_the_artists() -> None:
    obj = blender.bare_cube()
    bake_onto("Bare")
    obj.data.uv_layers.new(name=f"{CHART_MAP}.001")
    obj.data.uv_layers.active = obj.data.uv_layers[f"{CHART_MAP}.001"]
    before = uv_of(obj.data, f"{CHART_MAP}.001")
    set_panel(width=128)
    assert bake_onto("Bare") == {"FINISHED"} and "charts" not in said()
    set_panel(uv="CHARTS")
    assert bake_onto("Bare") == {"FINISHED"} and "Bare: 6 charts" in said()
    np.testing.assert_array_equal(uv_of(obj.data, f"{CHART_MAP}.001"), before)
    assert obj.data.uv_layers.active.name == f"{CHART_MAP}.001"


def test_a_linked_mesh_whose_charts_fit_is_baked(tmp_path: Any) -> None:
    """Others are not made: what is linked cannot be written."""
    blender.bare_cube()
    bake_onto("Bare")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"))
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, wanted):
        wanted.objects = ["Bare"]
    bpy.context.scene.collection.objects.link(bpy.data.objects["Bare"])
    set_panel(width=64, height=64, quality="RAYS", rays=1, margin=0, threads=2)
    assert bake_onto("Bare") == {"FINISHED"} and "charts" not in said()
    set_panel(width=128)
    with pytest.raises(RuntimeError, match=r"Bare: its mesh is linked from .*library\.blend; make it local first"):
        bake_onto("Bare")


def test_charts_are_of_the_basis_of_shape_keys() -> None:
    """Whichever key is shown."""
    plain, keyed = blender.bare_cube("Plain"), blender.bare_cube("Keyed", location=(5, 0, 0))
    keyed.shape_key_add(name="Basis")
    key = keyed.shape_key_add(name="Long")
    for point in key.data:
        point.co.z *= 3.0
    key.value, keyed.active_shape_key_index = 1.0, 1
    assert bake_onto("Plain", "Keyed") == {"FINISHED"}
    np.testing.assert_array_equal(uv_of(plain.data, CHART_MAP), uv_of(keyed.data, CHART_MAP))
    key.value = 0.5
    assert bake_onto("Plain", "Keyed") == {"FINISHED"} and "charts" not in said()
