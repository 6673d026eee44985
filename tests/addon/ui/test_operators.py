"""What the buttons do, in a Blender without windows."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.addon.charts.chart_marks import CHART_MAP  # noqa: E402
from occlusion_bake.addon.cli.options import parsed, parser, settings_of  # noqa: E402
from occlusion_bake.addon.compare.steps import ao_alone, child_values  # noqa: E402
from occlusion_bake.addon.job.bake_job import BakeJob, Layout  # noqa: E402
from occlusion_bake.addon.read.high_low_pairs import Pairing  # noqa: E402
from occlusion_bake.addon.read.occluder_filter import OccluderFilter  # noqa: E402
from occlusion_bake.addon.read.roles import roles_from_json  # noqa: E402
from occlusion_bake.addon.ui import operators, translate  # noqa: E402
from occlusion_bake.addon.ui.panel import OCCLUSION_BAKE_PT_bake  # noqa: E402
from occlusion_bake.core.charts.udim import Udim  # noqa: E402
from occlusion_bake.core.finish.image_file import read_image  # noqa: E402
from occlusion_bake.core.options.values import settings_of_panel  # noqa: E402
from occlusion_bake.core.rays.map_spec import Axis  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402
from occlusion_bake.tests.oracles.blender import base_colour, pixels, press, select  # noqa: E402


@pytest.fixture(autouse=True)
def scene(registered: None, empty_scene: None) -> Any:
    chosen = bpy.context.scene.occlusion_bake
    chosen.width = chosen.height = 64
    chosen.quality, chosen.rays, chosen.margin, chosen.threads = "RAYS", 4, 2, 2
    return chosen


def ours() -> dict[str, Any]:
    return {image.name: image for image in bpy.data.images if image.name != "Render Result"}


def lines() -> list[str]:
    return bpy.context.window_manager.occlusion_bake.lines.split("\n")


# Faults


@pytest.mark.parametrize(
    ("error", "shown"),
    [
        (NotImplementedError("so"), "NotImplementedError: so"),
        (RecursionError("so"), "RecursionError: so"),
        (RuntimeError("so"), "RuntimeError: so"),
        (RuntimeError("Error: Python: Traceback (most recent call last):\nKeyError: 'so'"), "Traceback"),
        (RuntimeError("Error: The disk is full.\n"), ""),
        (MemoryError(), ""),
    ],
)
def test_a_fault_of_ours_keeps_its_traceback(monkeypatch: pytest.MonkeyPatch, error: Exception, shown: str) -> None:
    def fails(*_: Any) -> Any:
        raise error

    monkeypatch.setattr(operators, "bake_steps", fails)
    bpy.ops.mesh.primitive_cube_add()
    with pytest.raises(RuntimeError) as caught:
        press()
    assert ("Traceback" in str(caught.value)) == bool(shown) and shown in str(caught.value)
    if "disk" in str(error):
        assert lines() == ["Blender refused (The disk is full)"]


# One press


def test_blenders_own_startup_cube() -> None:
    bpy.ops.wm.read_factory_settings()
    bpy.context.scene.occlusion_bake.width = bpy.context.scene.occlusion_bake.height = 64
    assert press() == {"FINISHED"}
    (image,) = (each for name, each in ours().items() if name == "Cube AO")
    assert tuple(image.size) == (64, 64) and image.is_float and image.packed_file is not None
    assert image.colorspace_settings.name == "Non-Color"
    assert pixels(image)[..., :3].min() == 1.0  # a cube alone hides nothing of itself
    assert any(line.startswith("Cube: ") for line in lines())


def test_a_mesh_without_anything_gets_charts_and_no_material() -> None:
    obj = blender.bare_cube()
    assert press() == {"FINISHED"}
    assert ours().keys() == {"Bare AO"}
    assert [layer.name for layer in obj.data.uv_layers] == [CHART_MAP]
    assert not obj.material_slots and not bpy.data.materials


def test_a_second_bake_takes_the_same_image(scene: Any) -> None:
    blender.cube()
    press()
    (image,) = ours().values()
    press()
    assert list(ours().values()) == [image]
    scene.width, scene.height = 32, 16
    press()
    assert list(ours().values()) == [image] and tuple(image.size) == (32, 16)


def test_all_that_is_selected_and_nothing_else() -> None:
    one, two, _ = blender.plane("One"), blender.bare_cube("Two", location=(9, 0, 0)), blender.plane("Three")
    bpy.ops.object.light_add()
    select(one, two, bpy.context.object)
    assert press() == {"FINISHED"}
    assert ours().keys() == {"One AO", "Two AO"}


def test_the_active_object_where_none_is_selected() -> None:
    select(blender.plane("One"))
    bpy.ops.object.select_all(action="DESELECT")
    assert press() == {"FINISHED"} and ours().keys() == {"One AO"}


def test_reflection_too(scene: Any) -> None:
    select(blender.plane("Floor"))
    blender.wall()
    scene.use_ro, scene.exponents = True, "10, 100 10"
    assert press() == {"FINISHED"}
    assert ours().keys() == {"Floor AO", "Floor RO 10", "Floor RO 100"}
    means = [pixels(ours()[f"Floor {name}"])[..., 0].mean() for name in ("AO", "RO 10", "RO 100")]
    assert means[0] < means[1] < means[2] < 1.0  # a narrower lobe about the normal sees less of a wall


def test_a_modifier_counts_as_in_a_render() -> None:
    obj = blender.cube()
    obj.modifiers.new("Array", "ARRAY").count = 2
    assert press() == {"FINISHED"}
    assert pixels(ours()["Cube AO"])[..., 0].min() == 0.0  # where the two cubes touch
    assert any("or where it touches itself, and get no light" in line for line in lines())


def test_a_solidified_cube_is_told_what_its_texels_show() -> None:
    """Its inner shell lies over the outer one in the texture; without the modifier there is nothing to tell."""
    wall = blender.cube().modifiers.new("Solidify", "SOLIDIFY")
    assert press() == {"FINISHED"}
    assert any("no light reaches it: its UVs overlap" in line for line in lines())
    assert not any("turned inwards" in line for line in lines())
    wall.show_render = False
    assert press() == {"FINISHED"}
    assert not any("light" in line or "overlap" in line for line in lines())


# What the artist has set stays as it is


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT", "WEIGHT_PAINT"])
@pytest.mark.parametrize("uv", ["ACTIVE", "CHARTS"])
def test_nothing_else_changes(scene: Any, mode: str, uv: str) -> None:
    obj, other = blender.cube(), blender.plane("Other", location=(0, 0, 2))
    obj.data.uv_layers.new(name="Second")
    obj.data.uv_layers["Second"].active = True
    obj.data.uv_layers["UVMap"].active_render = True
    bpy.context.scene.render.engine = "CYCLES"
    select(obj, other)
    bpy.ops.object.mode_set(mode=mode)
    scene.uv = uv

    def state() -> dict[str, Any]:
        layers = [layer.name for layer in obj.data.uv_layers if layer.name != CHART_MAP]
        return {
            "active": bpy.context.view_layer.objects.active.name,
            "selected": {each.name for each in bpy.context.selected_objects},
            "mode": {each.name: each.mode for each in (obj, other)},
            "engine": bpy.context.scene.render.engine,
            "uv": (layers, obj.data.uv_layers.active.name),
            "render uv": [layer.name for layer in obj.data.uv_layers if layer.active_render],
            "objects": [each.name for each in bpy.data.objects],
            "meshes": [each.name for each in bpy.data.meshes],
            "materials": len(bpy.data.materials),
            "world": bpy.context.scene.world,
            "camera": bpy.context.scene.camera,
            "modifiers": len(obj.modifiers),
            "attributes": sorted(
                each.name for each in obj.data.attributes if each.name in {"position", "UVMap", "Second"}
            ),
        }

    before = state()
    assert press() == {"FINISHED"}
    assert state() == before
    assert (CHART_MAP in obj.data.uv_layers) == (uv == "CHARTS")
    assert ours().keys() == {"Cube AO", "Other AO"}


def test_edits_in_progress_are_baked() -> None:
    import bmesh

    obj = blender.plane("Floor")
    select(obj)
    bpy.ops.object.mode_set(mode="EDIT")
    edited = bmesh.from_edit_mesh(obj.data)
    ceiling = [edited.verts.new((x, y, 0.1)) for x, y in ((-9, -9), (-9, 9), (9, 9), (9, -9))]
    edited.faces.new(ceiling)
    bmesh.update_edit_mesh(obj.data)
    assert press() == {"FINISHED"}
    assert obj.mode == "EDIT" and pixels(ours()["Floor AO"])[..., 0].mean() < 0.2


# In the material


def test_on_request_the_ao_is_in_the_material(scene: Any) -> None:
    obj = blender.plane("Floor")
    select(obj)
    scene.use_material = True
    assert press() == {"FINISHED"}
    (material,) = bpy.data.materials
    assert obj.material_slots[0].material == material
    mix = base_colour(material).links[0].from_node
    assert mix.blend_type == "MULTIPLY"
    names = [node.name for node in material.node_tree.nodes]
    textures = [node.image for node in material.node_tree.nodes if node.type == "TEX_IMAGE"]
    assert textures == [ours()["Floor AO"]]
    assert press() == {"FINISHED"}
    assert [node.name for node in material.node_tree.nodes] == names and len(bpy.data.materials) == 1


@pytest.mark.parametrize("uv", ["ACTIVE", "CHARTS"])
def test_the_material_shows_the_map_that_was_baked_onto(scene: Any, uv: str) -> None:
    select(blender.cube())
    scene.use_material, scene.uv = True, uv
    press()
    (material,) = bpy.data.materials
    places = [node.uv_map for node in material.node_tree.nodes if node.type == "UVMAP"]
    assert places == ([CHART_MAP] if uv == "CHARTS" else [])


def test_the_material_names_the_map_where_another_is_for_renders(scene: Any) -> None:
    obj = blender.plane()
    obj.data.uv_layers.new(name="Second").active = True
    select(obj)
    scene.use_material = True
    assert press() == {"FINISHED"} and obj.data.uv_layers["UVMap"].active_render
    places = [node.uv_map for node in obj.material_slots[0].material.node_tree.nodes if node.type == "UVMAP"]
    assert places == ["Second"]


def test_without_asking_materials_stay() -> None:
    obj = blender.plane()
    material = bpy.data.materials.new("Paint")
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    obj.data.materials.append(material)
    select(obj)
    before = [node.name for node in material.node_tree.nodes]
    assert press() == {"FINISHED"}
    assert [node.name for node in material.node_tree.nodes] == before and not base_colour(material).is_linked


# The other buttons


def test_unwrap_makes_charts_and_says_so() -> None:
    obj = blender.cube()
    before = [layer.name for layer in obj.data.uv_layers]
    assert press("unwrap") == {"FINISHED"}
    assert [layer.name for layer in obj.data.uv_layers] == [*before, CHART_MAP]
    assert "Cube: " in lines()[0] and "charts" in lines()[0]
    assert press("unwrap") == {"FINISHED"} and "charts" in lines()[0]
    assert not ours()


def test_charts_are_made_of_what_is_baked_whoever_blocks_light(scene: Any) -> None:
    """Of a pair the low mesh alone; a collection of occluders need not be chosen yet."""
    scene.source, scene.occluders = "NAMES", "COLLECTION"
    pair = [blender.bare_cube("Rock_low"), blender.bare_cube("Rock_high")]
    select(*pair)
    assert press("unwrap") == {"FINISHED"}
    assert [len(obj.data.uv_layers) for obj in pair] == [1, 0]
    for button in ("bake", "compare"):
        assert refused(button) == "Occluders: no collection is chosen; choose one, or Scene"


def test_compare_leaves_a_picture_and_lines(scene: Any) -> None:
    select(blender.plane("Floor"))
    blender.wall()
    scene.cycles_samples = 4
    for _ in range(2):
        assert press("compare") == {"FINISHED"}
        assert ours().keys() == {"Floor Comparison"}
        picture = ours()["Floor Comparison"]
        assert picture.packed_file is not None and picture.size[0] > picture.size[1] > 0
    said = "\n".join(lines())
    assert all(word in said for word in ("Cycles", "RMSE", "bias", "p99", "±", "99 % within"))


def test_compare_takes_all_that_a_bake_would_and_tells_their_total(scene: Any) -> None:
    """A pair and an object beside it; one that is hidden from render is told, and keeps none back."""
    scene.source, scene.use_ro, scene.cycles_samples, scene.width, scene.height = "NAMES", True, 1, 16, 16
    chosen = [blender.plane(name, location=(3.0 * x, 0, 0)) for x, name in enumerate(("Rock_low", "Floor", "Gone"))]
    blender.plane("Rock_high", location=(0, 0, 0.01))
    chosen[2].hide_render = True
    select(*chosen)
    assert press("compare") == {"FINISHED"}
    assert ours().keys() == {"Rock_low Comparison", "Floor Comparison"}
    assert "Cycles has no bake of RO 10; AO is compared" in lines()
    assert any(line.startswith("Gone: hidden from render") for line in lines())
    assert any(line.startswith("2 images together; ") and "RMSE" in line for line in lines())
    assert all(any(line.startswith(f"{name}: RMSE") for line in lines()) for name in ("Rock_low", "Floor"))


@pytest.mark.parametrize(("quality", "use_filter"), [("RAYS", True), ("FINAL", True), ("DRAFT", False)])
def test_the_comparisons_own_blender_bakes_the_same(scene: Any, tmp_path: Path, quality: str, use_filter: bool) -> None:
    scene.quality, scene.use_filter, scene.seed, scene.use_ro = quality, use_filter, 3, True
    scene.use_distance, scene.distance = True, 0.3
    blender.plane("Floor")
    settings = settings_of_panel(bpy.context.scene.occlusion_bake)
    layout = Layout("Sheet", Udim.LAYOUT)
    job, handed_on = BakeJob(blender.refs("Floor"), settings, layout=layout), tmp_path / "values.json"
    handed_on.write_text(json.dumps(child_values(job, 4, Path("folder"))), encoding="utf-8")
    options = parsed(parser("", with_file=False), ["--values", str(handed_on)])
    assert settings_of(options) == ao_alone(settings)
    assert (options.uv, options.cycles_samples, options.comparison) == (None, 4, "folder")
    assert (options.atlas, options.udim, options.color_attributes) == ("Sheet", "layout", None)
    assert roles_from_json(options.roles) == (Pairing(job.objects), OccluderFilter())


# How far a bake goes


@pytest.mark.parametrize(("quality", "error"), [("DRAFT", 1 / 50), ("GOOD", 1 / 255), ("FINAL", 1 / 510)])
def test_a_quality_is_an_error(scene: Any, quality: str, error: float) -> None:
    scene.quality = quality
    for on in (True, False):
        scene.use_filter = on
        goal = settings_of_panel(bpy.context.scene.occlusion_bake).goal
        assert goal.error == pytest.approx(error) and goal.filters == on


def test_a_new_scene_begins_with_the_commands_default() -> None:
    chosen = settings_of_panel(bpy.data.scenes.new("Another").occlusion_bake).goal
    commands = settings_of(parsed(parser("", with_file=False), [])).goal
    assert (chosen.rays, chosen.error, chosen.filters) == (commands.rays, commands.error, commands.filters)


def test_rays_are_the_plain_estimate(scene: Any) -> None:
    scene.quality, scene.rays, scene.use_filter = "RAYS", 32, True
    goal = settings_of_panel(bpy.context.scene.occlusion_bake).goal
    assert (goal.rays, goal.error, goal.filters) == (32, None, False)


@pytest.mark.parametrize("quality", ["DRAFT", "GOOD", "FINAL", "RAYS"])
def test_the_number_of_rays_is_shown_where_it_counts(scene: Any, quality: str) -> None:
    scene.quality = quality
    panel = SimpleNamespace(layout=MagicMock(), _draw_button=lambda _: None)
    OCCLUSION_BAKE_PT_bake.draw(panel, bpy.context)
    shown = [call.args[1] for call in panel.layout.prop.call_args_list]
    assert "quality" in shown and ("rays" in shown) == (quality == "RAYS")


def test_the_errors_are_said() -> None:
    select(blender.plane("Floor"))
    blender.wall()
    assert press() == {"FINISHED"}
    (line,) = (each for each in lines() if each.startswith("Error: "))
    assert line.startswith("Error: AO ±0.") and "99 % within" in line


# What is refused


def refused(button: str = "bake") -> str:
    """The line of the error that the button reports."""
    with pytest.raises(RuntimeError) as caught:
        press(button)
    (line,) = str(caught.value).strip().splitlines()
    assert not ours()
    return line.removeprefix("Error: ")


@pytest.mark.parametrize("exponents", ["abc", "", "10 soft", "-1", "nan", "inf", "10 10.00000001"])
def test_exponents_that_are_none(scene: Any, exponents: str) -> None:
    select(blender.plane())
    scene.use_ro, scene.exponents = True, exponents
    line = refused()
    assert "xponent" in line or "ro_10" in line


def test_nothing_to_bake(scene: Any) -> None:
    select(blender.plane())
    scene.use_ao = False
    assert "nothing to bake" in refused()


def test_no_camera_to_reflect(scene: Any) -> None:
    select(blender.plane())
    scene.use_ro, scene.direction = True, "CAMERA"
    assert "camera" in refused()


def test_the_horizon_is_divided_where_that_is_asked_for(scene: Any) -> None:
    scene.use_ro, scene.direction = True, "CAMERA"
    for on in (False, True):
        scene.divide_horizon = on
        specs = settings_of_panel(bpy.context.scene.occlusion_bake).specs
        assert [(each.axis, each.divided) for each in specs] == [(Axis.NORMAL, False), (Axis.REFLECTED, on)]


def test_a_mesh_without_faces_is_named() -> None:
    select(blender.mesh("Points", ((0, 0, 0),), ()))
    assert refused().startswith("Points: ")


def test_of_several_those_that_can_be_baked_are() -> None:
    select(blender.plane("Good"), blender.mesh("Points", ((0, 0, 0),), ()))
    assert press() == {"FINISHED"}
    assert ours().keys() == {"Good AO"}
    assert any(line.startswith("Points: ") for line in lines())


@pytest.mark.parametrize("button", ["bake", "unwrap", "compare"])
def test_no_mesh_no_button(button: str) -> None:
    bpy.ops.object.light_add()
    assert not getattr(bpy.ops.occlusion_bake, button).poll()


# The same as the command's


@pytest.mark.parametrize(
    ("quality", "effort"), [("RAYS", ("--rays", "4")), ("GOOD", ()), ("DRAFT", ("--quality", "draft"))]
)
def test_the_images_are_the_commands_files_bit_for_bit(
    scene: Any, bake: Any, quality: str, effort: tuple[str, ...]
) -> None:
    select(blender.plane("Floor"))
    blender.wall()
    scene.use_ro, scene.seed, scene.width, scene.height = True, 5, 64, 32
    scene.quality = quality
    assert press() == {"FINISHED"}
    maps = (("ao", "Floor AO"), ("ro_10", "Floor RO 10"))
    images = {name: pixels(ours()[title])[..., 0] for name, title in maps}
    words = ("--maps", "ao", "ro", "--seed", "5", "--size", "64x32", "--format", "exr", "--depth", "32")
    result = bake("--objects", "Floor", *words, effort=effort)
    assert result.status == 0, result.err
    for name, image in images.items():
        assert image[:16, 32:].mean() < image[16:, :32].mean() - 0.02  # the wall is on the right, in the upper half
        np.testing.assert_array_equal(read_image(result.folder / f"Floor_{name}.exr")[0][..., 0], image)


def test_what_is_shown_can_be_translated(monkeypatch: pytest.MonkeyPatch) -> None:
    """A dictionary of another language reaches the lines that are put together from values, too."""
    german = {"Occluders: {}": "Verdecker: {}", "Error: {}": "Fehler: {}", "none": "keine"}
    monkeypatch.setattr(translate, "pgettext_rpt", lambda text: german.get(text, text))
    blender.plane("Floor")
    select(bpy.data.objects["Floor"])
    assert press() == {"FINISHED"}
    assert "Verdecker: Floor" in lines()
    assert [line for line in lines() if line.startswith("Fehler: AO ±")]


def test_what_is_shown_in_the_view_is_switched_without_a_word(capfd: pytest.CaptureFixture[str]) -> None:
    """Blender prints what goes wrong in a property's update, and goes on."""
    shown = bpy.context.window_manager.occlusion_bake
    for value in (False, True):
        shown.show = value
    assert capfd.readouterr() == ("", "")
