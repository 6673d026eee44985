"""Several objects in one image, UDIM layouts, Blender's own unwrap, and the queue."""

from __future__ import annotations

import gc
import weakref
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from mathutils import Matrix  # noqa: E402
from occlusion_bake.addon.charts.chart_marks import ATLAS_MAP, CHART_MAP  # noqa: E402
from occlusion_bake.addon.job.bake_job import BakeJob, Layout, bake_steps  # noqa: E402
from occlusion_bake.addon.job.outcome import DONE, REFUSED, Outcome  # noqa: E402
from occlusion_bake.addon.job.runner import run  # noqa: E402
from occlusion_bake.addon.output.result import Result  # noqa: E402
from occlusion_bake.core.bake import Baker  # noqa: E402
from occlusion_bake.core.base.errors import Cancelled, InputError  # noqa: E402
from occlusion_bake.core.charts import child_process  # noqa: E402
from occlusion_bake.core.finish.image_file import read_image  # noqa: E402
from occlusion_bake.core.progress import Progress  # noqa: E402
from occlusion_bake.core.texels.rasterize import rasterize  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402
from occlusion_bake.tests.oracles.blender import bake_onto, set_panel  # noqa: E402
from occlusion_bake.tests.oracles.settings import flat_settings  # noqa: E402

pytestmark = pytest.mark.usefixtures("empty_scene", "registered")


@pytest.fixture
def settings() -> Any:
    return partial(set_panel, width=64, height=64, quality="RAYS", rays=4, margin=2)


def layout(obj: Any, name: str) -> Any:
    """(T, 3, 2) UVs of an object's map."""
    return blender.triangle_uv(obj.data, name)


def covered(obj: Any, name: str, size: int = 256) -> Any:
    return rasterize(obj.name, layout(obj, name), size, size).covered


def area(uv: Any) -> float:
    edges = (uv[:, 1:] - uv[:, :1]).astype(np.float64)
    return 0.5 * float(np.abs(edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0]).sum())


@pytest.mark.parametrize("uv", ["ACTIVE", "SMART"])
def test_charts_of_all_lie_side_by_side_by_their_size_in_the_world(uv: str, settings: Any) -> None:
    """Objects without UVs, one mirrored, one twice as large; each its own texels, and as many a square metre."""
    objects = [
        blender.bare_cube("One"),
        blender.bare_cube("Two", location=(5, 0, 0)),
        blender.bare_cube("Three", location=(0, 9, 0)),
    ]
    objects[1].scale = (2, 2, 2)
    objects[2].scale = (-1, 1, 1)
    bpy.context.view_layer.update()
    settings(layout="ATLAS", atlas="Set", uv=uv)
    assert bake_onto("One", "Two", "Three") == {"FINISHED"}
    assert [layer.name for obj in objects for layer in obj.data.uv_layers] == [ATLAS_MAP] * 3
    masks = [covered(obj, ATLAS_MAP) for obj in objects]
    assert all(mask.any() for mask in masks) and int(sum(mask.astype(np.int64) for mask in masks).max()) == 1
    areas = [area(layout(obj, ATLAS_MAP)) for obj in objects]
    np.testing.assert_allclose(areas, np.array([1.0, 4.0, 1.0]) * areas[0], rtol=1e-2)
    assert [image.name for image in bpy.data.images if "AO" in image.name] == ["Set AO"]


def test_charts_that_fit_stay_and_others_are_made_anew(settings: Any) -> None:
    objects = [blender.bare_cube("One"), blender.bare_cube("Two", location=(5, 0, 0))]
    settings(layout="ATLAS")
    bake_onto("One", "Two")
    first = [layout(obj, ATLAS_MAP) for obj in objects]
    bake_onto("One", "Two")
    for obj, before in zip(objects, first, strict=True):
        np.testing.assert_array_equal(layout(obj, ATLAS_MAP), before)
    settings(layout="EACH")
    bake_onto("One")  # by its active map, which is the atlas'
    settings(layout="ATLAS")
    objects[1].scale = (3, 3, 3)
    bpy.context.view_layer.update()
    bake_onto("One", "Two")
    assert not np.array_equal(layout(objects[0], ATLAS_MAP), first[0])


def test_maps_that_all_have_are_used_as_they_are(settings: Any) -> None:
    blender.plane("Left", uv=((0, 0), (0.4, 0), (0.4, 1), (0, 1)))
    blender.plane("Right", uv=((0.6, 0), (1, 0), (1, 1), (0.6, 1)), location=(0, 0, 0.5))
    settings(layout="ATLAS", rays=64)
    assert bake_onto("Left", "Right") == {"FINISHED"}
    assert all(len(obj.data.uv_layers) == 1 for obj in bpy.data.objects)
    values = np.empty(64 * 64 * 4, np.float32)
    bpy.data.images["Atlas AO"].pixels.foreach_get(values)
    ao = values.reshape(64, 64, 4)[..., 0]
    assert ao[32, 10] < 0.5 and ao[32, 54] == 1.0
    lines = bpy.context.window_manager.occlusion_bake.lines
    assert "Atlas: " in lines and "overlap" not in lines


def test_maps_of_objects_that_overlap_a_little_are_used_and_told(settings: Any) -> None:
    """As they are where a tenth of one at most lies on others, and wholly where that is said to be meant."""
    blender.plane("One", uv=((0, 0), (0.5, 0), (0.5, 1), (0, 1)))
    two = blender.plane("Two", uv=((0.46875, 0), (1, 0), (1, 1), (0.46875, 1)), location=(0, 0, 3))
    settings(layout="ATLAS")
    bake_onto("One", "Two")
    said = "Atlas: objects overlap one another in the UV map on {} of 4096"
    assert said.format(128) in bpy.context.window_manager.occlusion_bake.lines
    two.data.uv_layers[0].uv.foreach_set("vector", [0, 0, 1, 0, 1, 1, 0, 1])
    settings(udim="STACKED")
    bake_onto("One", "Two")
    assert said.format(2048) in bpy.context.window_manager.occlusion_bake.lines
    assert [layer.name for obj in bpy.data.objects for layer in obj.data.uv_layers] == ["UVMap"] * 2


def test_one_that_cannot_be_in_it_does_not_stop_the_others(settings: Any) -> None:
    """A second object of a mesh, one without faces, one whose mesh is full of UV maps."""
    one = blender.bare_cube("One")
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Twin", one.data))
    blender.mesh("Empty", ((0, 0, 0),), ())
    full = blender.bare_cube("Full", location=(4, 0, 0))
    for number in range(8):
        full.data.uv_layers.new(name=f"Map {number}")
    blender.bare_cube("Two", location=(8, 0, 0))
    settings(layout="ATLAS")
    assert bake_onto("One", "Twin", "Empty", "Full", "Two") == {"FINISHED"}
    lines = bpy.context.window_manager.occlusion_bake.lines
    assert "Twin: it shares its mesh with One" in lines and "Empty: " in lines and "no faces" in lines
    assert "Full: Blender has no room for another UV map" in lines
    assert {obj.name for obj in bpy.data.objects if ATLAS_MAP in obj.data.uv_layers} == {"One", "Twin", "Two"}
    assert len(full.data.uv_layers) == 8


def test_from_single_images_to_an_atlas_and_back(settings: Any) -> None:
    """Charts of our own are no maps of the artist's: in an atlas they make room for one another."""
    objects = [blender.bare_cube("One"), blender.bare_cube("Two", location=(5, 0, 0))]
    settings()
    bake_onto("One", "Two")
    settings(layout="ATLAS")
    bake_onto("One", "Two")
    assert "overlap" not in bpy.context.window_manager.occlusion_bake.lines
    assert [obj.data.uv_layers.active.name for obj in objects] == [ATLAS_MAP] * 2
    settings(layout="EACH")
    bake_onto("One", "Two")
    assert [obj.data.uv_layers.active.name for obj in objects] == [CHART_MAP] * 2
    np.testing.assert_array_equal(layout(objects[0], CHART_MAP), layout(objects[1], CHART_MAP))


@pytest.mark.parametrize("scale", [(1, 2, 3), (1.7, 1.7, 1.7), (0.3, 1.7, 5.1)])
def test_turning_an_object_keeps_the_charts(settings: Any, scale: Any) -> None:
    """Its matrix then has other roundings, which those who are many among its vertices would show."""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=4, calc_uvs=False)
    objects = [bpy.context.object, blender.bare_cube("Two", location=(5, 0, 0))]
    objects[0].name, objects[0].scale = "One", scale
    bpy.context.view_layer.update()
    settings(layout="ATLAS")
    bake_onto("One", "Two")
    first = layout(objects[0], ATLAS_MAP)
    objects[0].rotation_euler = (0.3, 1.2, -2.0)
    objects[0].location = (1, 7, 3)
    bpy.context.view_layer.update()
    bake_onto("One", "Two")
    np.testing.assert_array_equal(layout(objects[0], ATLAS_MAP), first)


def test_an_atlas_is_baked_again_with_all_its_objects(settings: Any) -> None:
    blender.plane("Left", uv=((0, 0), (0.4, 0), (0.4, 1), (0, 1)))
    blender.plane("Right", uv=((0.6, 0), (1, 0), (1, 1), (0.6, 1)), location=(0, 0, 0.5))
    settings(layout="ATLAS", rays=64, atlas="Both")
    bake_onto("Left", "Right")
    image = bpy.data.images["Both AO"]
    before = np.empty(64 * 64 * 4, np.float32)
    image.pixels.foreach_get(before)
    settings(layout="EACH")
    image.pixels.foreach_set(np.zeros_like(before))
    with bpy.context.temp_override(edit_image=image):
        assert bpy.ops.occlusion_bake.again() == {"FINISHED"}
    after = np.empty_like(before)
    image.pixels.foreach_get(after)
    np.testing.assert_array_equal(after, before)
    bpy.data.objects.remove(bpy.data.objects["Left"])
    with bpy.context.temp_override(edit_image=image), pytest.raises(RuntimeError, match="its object Left is not in"):
        bpy.ops.occlusion_bake.again()


def test_a_cancelled_atlas_changes_nothing() -> None:
    """The first object's part is done when it is stopped: no image, no charts."""
    blender.bare_cube("One")
    blender.bare_cube("Two", location=(5, 0, 0))
    from occlusion_bake.addon.charts.rollback import chart_rollback

    progress, outcome = Progress(), Outcome()
    job = BakeJob(blender.refs("One", "Two"), flat_settings(width=32, height=32, rays=1), layout=Layout("Atlas"))
    steps = bake_steps(bpy.context, job, progress, outcome, lambda result: pytest.fail("delivered"))
    with chart_rollback(bpy.context, outcome.charting.changes, outcome.finished), pytest.raises(Cancelled):
        task = next(steps)
        while True:
            result = task()
            if outcome.states.get(job.objects[0]) == "baking":
                progress.cancel()
            task = steps.send(result)
    assert outcome.finished == []
    assert not bpy.data.objects["One"].data.uv_layers and not bpy.data.objects["Two"].data.uv_layers


def test_the_command_writes_one_image_for_all(bake: Any) -> None:
    blender.bare_cube("One")
    blender.bare_cube("Two", location=(5, 0, 0))
    run_ = bake("--atlas", "Set")
    assert (run_.status, run_.err) == (0, "")
    (entry,) = run_.report["objects"]
    assert entry["name"] == "Set" and entry["objects"] == ["One", "Two"]
    assert "Set_ao.png" in run_.files and "scene_charts.blend" in run_.files
    assert [line for line in run_.report["notes"] if line.startswith("Set: ")]


# UDIM


def spread() -> Any:
    """A floor in the first tile, a ceiling that looks up in the third."""
    corners = [(-1, -1, z) for z in (0.0,)] + [(1, -1, 0), (1, 1, 0), (-1, 1, 0)]
    corners += [(x, y, 0.5) for x, y, _ in corners]
    uv = [(0, 0), (1, 0), (1, 1), (0, 1), (2.1, 0.1), (2.9, 0.1), (2.9, 0.8), (2.1, 0.8)]
    return blender.mesh("Tiled", corners, ((0, 1, 2, 3), (4, 5, 6, 7)), uv)


def test_every_tile_is_baked_into_a_tiled_image(tmp_path: Path, settings: Any) -> None:
    spread()
    settings(rays=64)
    assert bake_onto("Tiled") == {"FINISHED"}
    image = bpy.data.images["Tiled AO"]
    assert image.source == "TILED" and [tile.number for tile in image.tiles] == [1001, 1003]
    assert all(tuple(tile.size) == (64, 64) for tile in image.tiles) and image.is_float
    assert image.colorspace_settings.name == "Non-Color" and len(image.packed_files) == 2
    named = [image.filepath, *(each.filepath for each in image.packed_files)]  # and no folder that is there no more
    assert named == [f"//Tiled AO.{tile}.exr" for tile in ("<UDIM>", 1001, 1003)]
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "saved.blend"))
    image = bpy.data.images["Tiled AO"]
    image.filepath_raw = str(tmp_path / "out.<UDIM>.exr")
    image.save()
    floor, ceiling = (read_image(tmp_path / f"out.{tile}.exr")[0][..., 0] for tile in (1001, 1003))
    assert floor[32, 32] < 0.5 and floor.max() < 1.0
    np.testing.assert_array_equal(ceiling, 1.0)
    assert bake_onto("Tiled") == {"FINISHED"}
    assert [each.name for each in bpy.data.images if each.name.startswith("Tiled")] == ["Tiled AO"]
    settings(udim="STACKED")
    assert bake_onto("Tiled") == {"FINISHED"}
    assert bpy.data.images["Tiled AO"].source != "TILED"


def test_tiles_are_saved_by_their_numbers(tmp_path: Path, settings: Any) -> None:
    spread()
    settings(output="SAVED", path=str(tmp_path / "{object}_{map}.<UDIM>.png"), format="PNG", depth="8")
    assert bake_onto("Tiled") == {"FINISHED"}
    assert sorted(path.name for path in tmp_path.glob("*.png")) == ["Tiled_ao.1001.png", "Tiled_ao.1003.png"]
    image = bpy.data.images["Tiled AO"]
    assert image.source == "TILED" and [tile.number for tile in image.tiles] == [1001, 1003]
    assert bake_onto("Tiled") == {"FINISHED"}
    assert len([each for each in bpy.data.images if each.name.startswith("Tiled")]) == 1


def test_a_tile_is_delivered_before_the_next_is_baked_and_let_go() -> None:
    """26 bytes a texel of every tile would be held; what concerns the mesh is said once."""
    bent = spread().data
    bent.vertices.add(3)  # in one place
    bent.loops.add(3)
    bent.polygons.add(1)
    bent.polygons[-1].loop_start = 8
    bent.loops.foreach_set("vertex_index", [*range(8), 8, 9, 10])
    bent.update()
    held: list[Any] = []
    told: list[list[str]] = []

    def deliver(result: Result) -> None:
        gc.collect()
        assert [each() for each in held] == [None] * len(held)
        held.append(weakref.ref(result.baked))
        told.append(result.baked.warnings)
        assert (result.is_first, result.is_last) == (len(held) == 1, len(held) == 2)
        assert result.baked.tile == result.tiles[len(held) - 1]

    progress = Progress()
    job = BakeJob(blender.refs("Tiled"), flat_settings(width=16, height=16, rays=4))
    run(bake_steps(bpy.context, job, progress, Outcome(), deliver), progress)
    assert len(held) == 2
    assert [len([line for line in lines if "zero area" in line]) for lines in told] == [1, 0]


def test_a_bake_that_ends_between_tiles_leaves_images_as_they_were(settings: Any, monkeypatch: Any) -> None:
    """And the next object's takes no tile of it."""
    spread()
    settings(seed=0)
    assert bake_onto("Tiled") == {"FINISHED"}
    before = blender.pixels("Tiled AO").copy()
    bake = Baker.bake

    def stop(self: Baker, target: Any, tile: int | None = None, *rest: Any) -> Any:
        if target.name == "Tiled" and tile == 1003:
            raise InputError("Tiled: stopped")
        return bake(self, target, tile, *rest)

    monkeypatch.setattr(Baker, "bake", stop)
    blender.plane("Zebra", [(1, 0), (2, 0), (2, 1), (1, 1)])
    settings(seed=1)
    assert bake_onto("Tiled", "Zebra") == {"FINISHED"}
    np.testing.assert_array_equal(blender.pixels("Tiled AO"), before)
    assert [tile.number for tile in bpy.data.images["Zebra AO"].tiles] == [1002]


def test_the_command_writes_a_file_a_tile(bake: Any) -> None:
    spread()
    run_ = bake()
    assert [entry["tile"] for entry in run_.report["objects"]] == [1001, 1003]
    assert {"Tiled_ao.1001.png", "Tiled_ao.1003.png"} <= set(run_.files)
    coded = bake("--code", "sh_1", "--output", str(run_.folder / "coded"))
    assert {path.name for path in (run_.folder / "coded").glob("*sh_1*")} == {
        "Tiled_sh_1_0.1001.png",
        "Tiled_sh_1_0.1003.png",
    }
    assert coded.status == 0
    alone = bake("--udim", "stacked", "--output", str(run_.folder / "alone"))
    assert alone.status == 0
    assert (run_.folder / "alone" / "Tiled_ao.png").exists()


def test_copies_that_a_modifier_moves_aside_are_baked_as_one_says(settings: Any) -> None:
    """A cube and its mirror image, a tile apart by the modifier's own offset."""
    obj = blender.cube("Half")
    obj.data.transform(Matrix.Translation((2, 0, 0)))
    obj.modifiers.new("Mirror", "MIRROR").offset_u = 1.0
    for udim, tiles in (("AUTO", [1001]), ("LAYOUT", [1001, 1002]), ("STACKED", [1001])):
        settings(udim=udim)
        assert bake_onto("Half") == {"FINISHED"}
        image = bpy.data.images["Half AO"]
        assert (image.source == "TILED", [tile.number for tile in image.tiles]) == (udim == "LAYOUT", tiles)
        said = bpy.context.window_manager.occlusion_bake.lines
        assert ("(--udim layout)" in said) == (udim == "AUTO")
        assert ("not baked" in said) == (udim != "LAYOUT")


# Blender's own unwrap


def test_smart_uv_project_in_a_map_of_its_own(settings: Any) -> None:
    """Selection, mode, active object and the mesh's own maps stay; a face stays one piece."""
    obj = blender.cube("Cube")
    before = [layer.name for layer in obj.data.uv_layers]
    obj.data.polygons[2].select = False
    selected = [polygon.select for polygon in obj.data.polygons]
    settings(uv="SMART")
    assert bake_onto("Cube") == {"FINISHED"}
    assert [layer.name for layer in obj.data.uv_layers] == [*before, CHART_MAP]
    assert obj.data.uv_layers.active.name == before[0]
    assert [polygon.select for polygon in obj.data.polygons] == selected
    assert bpy.context.view_layer.objects.active == obj and obj.select_get() and obj.mode == "OBJECT"
    assert len(bpy.data.objects) == 1 and len(bpy.data.meshes) == 1
    uv = layout(obj, CHART_MAP)
    assert uv.min() >= 0.0 and uv.max() <= 1.0
    mask = covered(obj, CHART_MAP)
    assert mask.mean() > 0.2
    assert rasterize("Cube", uv, 256, 256).overlapped == 0


def test_smart_charts_are_square_whatever_the_mesh_has(settings: Any) -> None:
    """A wide texture in the material, a shape key, a scale: the faces of a cube stay squares of their size."""
    objects = [blender.bare_cube("One"), blender.bare_cube("Two", location=(9, 0, 0))]
    material = bpy.data.materials.new("Wide")
    material.use_nodes = True
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = bpy.data.images.new("Wide", 512, 64)
    material.node_tree.nodes.active = node
    objects[0].data.materials.append(material)
    objects[1].shape_key_add(name="Basis")
    objects[1].shape_key_add(name="Key")
    objects[1].scale = (2, 2, 2)
    bpy.context.view_layer.update()
    settings(layout="ATLAS", uv="SMART")
    assert bake_onto("One", "Two") == {"FINISHED"}
    for obj in objects:
        uv = layout(obj, ATLAS_MAP)
        sides = np.linalg.norm(uv - np.roll(uv, 1, axis=1), axis=2)
        np.testing.assert_allclose(np.sort(sides, axis=1)[:, 1] / np.sort(sides, axis=1)[:, 0], 1.0, rtol=1e-3)
    areas = [area(layout(obj, ATLAS_MAP)) for obj in objects]
    assert areas[1] == pytest.approx(4.0 * areas[0], rel=1e-2)


def test_where_making_charts_breaks_down_the_second_press_unwraps_what_it_did_not(
    monkeypatch: pytest.MonkeyPatch, settings: Any
) -> None:
    good, bad = blender.bare_cube("Good"), blender.bare_cube("Bad", location=(9, 0, 0))
    settings()
    assert bake_onto("Good") == {"FINISHED"}
    before = layout(good, CHART_MAP)
    monkeypatch.setattr(child_process, "_BOOT", "import os\nos.abort()")
    assert bake_onto("Good", "Bad") == {"FINISHED"}
    said = bpy.context.window_manager.occlusion_bake.lines
    assert "Bad: it needs UV charts and the process that makes them was ended" in said
    assert "press Bake or Make UV Charts again" in said
    assert not bad.data.uv_layers
    assert bake_onto("Good", "Bad") == {"FINISHED"}
    assert "Bad: 6 charts by Smart UV Project" in bpy.context.window_manager.occlusion_bake.lines
    np.testing.assert_array_equal(layout(good, CHART_MAP), before)


def test_an_artist_in_edit_mode_is_put_back(settings: Any) -> None:
    blender.bare_cube("Bare")
    blender.cube("Edited", location=(4, 0, 0))
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.data.objects["Bare"].select_set(True)
    settings(uv="SMART")
    assert bpy.ops.occlusion_bake.bake() == {"FINISHED"}
    assert bpy.context.view_layer.objects.active.name == "Edited" and bpy.context.object.mode == "EDIT"
    assert CHART_MAP in bpy.data.objects["Bare"].data.uv_layers


def test_the_command_unwraps_by_blender(bake: Any) -> None:
    blender.bare_cube("Bare")
    run_ = bake("--uv", "smart")
    assert (run_.status, run_.err) == (0, "")
    assert run_.report["notes"][0].startswith(
        f"Bare: 6 charts by Smart UV Project in the UV map {CHART_MAP}, stretch 1.000"
    )


# The queue


def test_the_state_of_each() -> None:
    blender.plane("One")
    blender.plane("Two", uv=[(-5, -5), (-4, -5), (-4, -4), (-5, -4)], location=(0, 0, 3))
    blender.plane("Three", location=(0, 0, 6))
    progress, outcome, seen = Progress(), Outcome(), []
    job = BakeJob(blender.refs("One", "Two", "Three"), flat_settings(width=8, height=8, rays=1))
    steps = bake_steps(bpy.context, job, progress, outcome, lambda _: seen.append(list(outcome.states.values())))
    run(steps, progress)
    assert seen[0] == ["baking", "waiting", "waiting"]
    assert seen[1] == [DONE, REFUSED, "baking"]
    assert list(outcome.states.values()) == [DONE, REFUSED, DONE]
