"""Baked images in materials, and out of them again."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.addon.charts.chart_marks import CHART_MAP  # noqa: E402
from occlusion_bake.addon.output.material_links import has_linked_images, link_images, unlink_images  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402
from occlusion_bake.tests.oracles.blender import bake_onto, base_colour, material, set_panel  # noqa: E402

pytestmark = pytest.mark.usefixtures("empty_scene")


def image(name: str = "Thing AO") -> Any:
    return bpy.data.images.new(name, 4, 4, is_data=True)


def mix(material: Any) -> Any:
    """The node that multiplies, which must be what the base colour comes from: its two colours and factor."""
    (link,) = base_colour(material).links
    node = link.from_node
    assert (node.type, node.data_type, node.blend_type) == ("MIX", "RGBA", "MULTIPLY")
    assert node.inputs["Factor"].default_value == 1.0
    return [socket for socket in node.inputs if socket.type == "RGBA"]


def texture(material: Any) -> Any:
    (link,) = mix(material)[1].links
    assert link.from_node.type == "TEX_IMAGE"
    return link.from_node


def test_the_ao_is_multiplied_into_the_base_colour() -> None:
    obj, paint = blender.plane(), material()
    obj.data.materials.append(paint)
    base_colour(paint).default_value = (0.2, 0.4, 0.6, 1.0)
    ao = image()
    link_images(obj, {"ao": ao}, None)
    assert tuple(mix(paint)[0].default_value) == pytest.approx((0.2, 0.4, 0.6, 1.0))
    assert texture(paint).image == ao and not texture(paint).inputs["Vector"].is_linked


def test_what_was_linked_to_the_base_colour_stays() -> None:
    obj, paint = blender.plane(), material()
    obj.data.materials.append(paint)
    noise = paint.node_tree.nodes.new("ShaderNodeTexNoise")
    paint.node_tree.links.new(noise.outputs["Color"], base_colour(paint))
    link_images(obj, {"ao": image()}, None)
    assert mix(paint)[0].links[0].from_node == noise


def test_the_uv_map_that_was_baked_onto() -> None:
    obj, paint = blender.plane(), material()
    obj.data.materials.append(paint)
    link_images(obj, {"ao": image()}, "Charts")
    node = texture(paint).inputs["Vector"].links[0].from_node
    assert node.type == "UVMAP" and node.uv_map == "Charts"


def test_again_only_the_image_is_exchanged() -> None:
    obj, paint = blender.plane(), material()
    obj.data.materials.append(paint)
    link_images(obj, {"ao": image()}, None)
    count = len(paint.node_tree.nodes)
    other = image("Other")
    link_images(obj, {"ao": other}, None)
    assert len(paint.node_tree.nodes) == count and texture(paint).image == other


@pytest.mark.parametrize("slots", [0, 1, 2])
def test_an_object_without_a_material_gets_one(slots: int) -> None:
    obj = blender.plane()
    for _ in range(slots):
        obj.data.materials.append(None)
    ao = image()
    link_images(obj, {"ao": ao}, None)
    (made,) = bpy.data.materials
    assert obj.material_slots[0].material == made and texture(made).image == ao


def test_every_material_of_the_object_is_hooked_up() -> None:
    obj = blender.plane()
    paints = [material("One"), material("Two")]
    for paint in paints:
        obj.data.materials.append(paint)
    ao = image()
    link_images(obj, {"ao": ao}, None)
    assert [texture(paint).image for paint in paints] == [ao, ao]


def specular(material: Any) -> Any:
    return material.node_tree.nodes["Principled BSDF"].inputs["Specular IOR Level"]


def shape(material: Any) -> Any:
    """All nodes and links of a material."""
    tree = material.node_tree
    ends = [(link.from_socket, link.to_socket) for link in tree.links]
    links = {(start.node.name, start.name, end.node.name, end.name) for start, end in ends}
    return {node.name for node in tree.nodes}, links


def test_the_ro_is_multiplied_into_the_specular_level() -> None:
    obj, paint = blender.plane(), material()
    obj.data.materials.append(paint)
    specular(paint).default_value = 0.25
    ro = image("Thing RO 10")
    link_images(obj, {"ao": image(), "ro_10": ro, "ro_100": image("Thing RO 100")}, None)
    product = specular(paint).links[0].from_node
    assert (product.type, product.operation, product.inputs[0].default_value) == ("MATH", "MULTIPLY", 0.25)
    assert product.inputs[1].links[0].from_node.image == ro
    assert mix(paint)  # the AO beside it


@pytest.mark.parametrize("linked", [False, True])
def test_removed_all_is_as_it_was(linked: bool) -> None:
    obj, paint = blender.plane(), material()
    obj.data.materials.append(paint)
    base_colour(paint).default_value = (0.2, 0.4, 0.6, 1.0)
    if linked:
        noise = paint.node_tree.nodes.new("ShaderNodeTexNoise")
        paint.node_tree.links.new(noise.outputs["Color"], base_colour(paint))
        paint.node_tree.links.new(noise.outputs[0], specular(paint))
    before = shape(paint)
    link_images(obj, {"ao": image(), "ro_10": image("RO")}, "Charts", gltf=True)
    assert has_linked_images(obj) and shape(paint) != before
    assert unlink_images(obj) and shape(paint) == before and not has_linked_images(obj)
    assert tuple(base_colour(paint).default_value) == pytest.approx((0.2, 0.4, 0.6, 1.0))
    assert not bpy.data.node_groups and not unlink_images(obj)


@pytest.mark.parametrize("slots", [0, 1])
def test_a_material_that_was_made_goes_too(slots: int) -> None:
    obj = blender.plane()
    for _ in range(slots):
        obj.data.materials.append(None)
    link_images(obj, {"ao": image()}, None)
    assert unlink_images(obj)
    assert len(obj.material_slots) == slots and not bpy.data.materials


def test_a_material_that_others_use_by_now_stays() -> None:
    obj, other = blender.plane("One"), blender.plane("Two")
    link_images(obj, {"ao": image()}, None)
    other.data.materials.append(obj.material_slots[0].material)
    assert unlink_images(obj)
    assert obj.material_slots[0].material == other.material_slots[0].material
    assert not has_linked_images(other)


def test_neither_preview_nor_gltf_leaves_all_alone() -> None:
    obj = blender.plane()
    link_images(obj, {"ao": image()}, None, preview=False)
    assert not obj.material_slots and not bpy.data.materials


def test_blenders_gltf_exporter_finds_the_occlusion(tmp_path: Path) -> None:
    obj = blender.plane()
    ao = image()
    ao.pack()
    link_images(obj, {"ao": ao}, None, preview=False, gltf=True)
    bpy.ops.preferences.addon_enable(module="io_scene_gltf2")
    bpy.ops.export_scene.gltf(filepath=str(tmp_path / "thing.gltf"), export_format="GLTF_SEPARATE")
    (exported,) = json.loads((tmp_path / "thing.gltf").read_text())["materials"]
    assert exported["occlusionTexture"]["index"] == 0
    assert "baseColorTexture" not in exported.get("pbrMetallicRoughness", {})


def test_a_directional_code_goes_into_the_specular_level(registered: None) -> None:
    """And comes out again, with what was there before linked as it was."""
    plane = blender.plane("Coded")
    paint = material("Plain")
    plane.data.materials.append(paint)
    surface = next(node for node in paint.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    surface.inputs["Specular IOR Level"].default_value = 0.3
    before = len(paint.node_tree.nodes)
    set_panel(width=32, height=32, quality="RAYS", rays=4, use_code=True, code="SH", use_material=True)
    for _ in range(2):
        assert bake_onto("Coded") == {"FINISHED"}
    (product,) = (link.from_node for link in surface.inputs["Specular IOR Level"].links)
    assert product.inputs[0].default_value == pytest.approx(0.3)
    assert product.inputs[1].links[0].from_socket.name == "RO over Horizon"
    assert {f"Coded SH 3 {number}" for number in range(4)} <= {image.name for image in bpy.data.images}
    rebuilt = product.inputs[1].links[0].from_node
    rebuilt.inputs["Exponent"].default_value = 30.0
    set_panel(uv="CHARTS")
    assert bake_onto("Coded") == {"FINISHED"}
    places = {node.uv_map for node in paint.node_tree.nodes if node.type == "UVMAP"}
    assert places == {CHART_MAP} and product.inputs[1].links[0].from_node == rebuilt
    frames = {node.uv_map for node in rebuilt.node_tree.nodes if node.type == "NORMAL_MAP"}
    assert frames == {CHART_MAP} and rebuilt.inputs["Exponent"].default_value == 30.0
    bpy.ops.occlusion_bake.unhook()
    assert len(paint.node_tree.nodes) == before
    assert surface.inputs["Specular IOR Level"].default_value == pytest.approx(0.3)


@pytest.mark.parametrize(("code", "files", "packed"), [("SH", 4, 4), ("MASK8", 1, 0)])
def test_of_codes_in_files_the_one_for_the_nodes_is_packed(
    code: str, files: int, packed: int, registered: None, tmp_path: Path
) -> None:
    blender.plane("Coded")
    set_panel(width=32, height=32, quality="RAYS", rays=4, use_ao=False, use_code=True, code=code, use_material=True)
    set_panel(output="SAVED", path=str(tmp_path / "{object}_{map}"), format="PNG", depth="16")
    assert bake_onto("Coded") == {"FINISHED"}
    assert len(list(tmp_path.glob("Coded_*.png"))) == files
    ours = [image for image in bpy.data.images if image.name.startswith("Coded") and image.packed_file is not None]
    assert len(ours) == packed and all(image.is_float for image in ours)
    shown = [node.image for slot in bpy.data.objects["Coded"].material_slots for node in slot.material.node_tree.nodes
             if node.type == "TEX_IMAGE"]  # fmt: skip
    assert set(shown) == set(ours)


@pytest.mark.parametrize("normal_maps", [False, True])
def test_a_code_about_mapped_normals_is_read_about_them(normal_maps: bool, registered: None) -> None:
    obj, paint = blender.plane("Coded"), material()
    obj.data.materials.append(paint)
    tree = paint.node_tree
    normal_map = tree.nodes.new("ShaderNodeNormalMap")
    normal_map.inputs["Color"].default_value = (0.8, 0.5, 0.9, 1.0)
    tree.links.new(normal_map.outputs[0], tree.nodes["Principled BSDF"].inputs["Normal"])
    set_panel(width=32, height=32, quality="RAYS", rays=4, use_code=True, code="SH", use_material=True)
    set_panel(use_normal_maps=True)
    assert bake_onto("Coded") == {"FINISHED"}
    set_panel(use_normal_maps=normal_maps)
    assert bake_onto("Coded") == {"FINISHED"}
    rebuilt = next(node for node in tree.nodes if node.type == "GROUP")
    assert [link.from_node for link in rebuilt.inputs["Normal"].links] == ([normal_map] if normal_maps else [])
    tree.links.new(tree.nodes.new("ShaderNodeBump").outputs[0], tree.nodes["Principled BSDF"].inputs["Normal"])
    assert bake_onto("Coded") == {"FINISHED"}  # about the mesh's own normals, as a line says
    assert not rebuilt.inputs["Normal"].is_linked


def test_a_channel_of_an_image_fills_the_slot_too(registered: None, tmp_path: Path) -> None:
    """And the exporter takes it from there."""
    obj, paint = blender.plane("Packed"), material()
    obj.data.materials.append(paint)
    orm = bpy.data.images.new("ORM", 32, 32, is_data=True)
    orm.pack()
    set_panel(width=32, height=32, quality="RAYS", rays=4, output="CHANNEL", image=orm, channel="R")
    set_panel(use_material=True, use_gltf=True)
    for _ in range(2):
        assert bake_onto("Packed") == {"FINISHED"}
    assert mix(paint)[1].links[0].from_node.type == "SEPARATE_COLOR"
    assert mix(paint)[1].links[0].from_socket.name == "Red"
    assert sum(node.type == "SEPARATE_COLOR" for node in paint.node_tree.nodes) == 1
    bpy.ops.preferences.addon_enable(module="io_scene_gltf2")
    bpy.ops.export_scene.gltf(filepath=str(tmp_path / "thing.gltf"), export_format="GLTF_SEPARATE")
    (exported,) = json.loads((tmp_path / "thing.gltf").read_text())["materials"]
    assert "index" in exported["occlusionTexture"]
    assert unlink_images(obj) and not base_colour(paint).is_linked
    set_panel(channel="A", image=bpy.data.images.new("RGBA", 32, 32, alpha=True, is_data=True))
    bpy.data.images["RGBA"].colorspace_settings.name = "sRGB"  # which does not concern alpha
    assert bake_onto("Packed") == {"FINISHED"}
    assert "color space" not in bpy.context.window_manager.occlusion_bake.lines
    assert mix(paint)[1].links[0].from_socket.name == "Alpha"
    assert not any(node.type == "SEPARATE_COLOR" for node in paint.node_tree.nodes)
