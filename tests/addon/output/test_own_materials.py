"""Each object shows its own maps, whoever else uses its materials, and gives back what it was lent."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.addon.output.material_links import has_linked_images, link_images, unlink_images  # noqa: E402
from occlusion_bake.core.finish.image_file import read_image  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402
from occlusion_bake.tests.oracles.blender import bake_onto, base_colour, material, press, select, set_panel  # noqa: E402

pytestmark = pytest.mark.usefixtures("empty_scene")


def image(value: float, name: str = "Thing AO") -> Any:
    """Of one value, packed."""
    made = bpy.data.images.new(name, 4, 4, float_buffer=True, is_data=True)
    made.pixels.foreach_set([value, value, value, 1.0] * 16)
    made.pack()
    return made


def paint() -> Any:
    """White, without a gleam."""
    made = material()
    base_colour(made).default_value = (1.0, 1.0, 1.0, 1.0)
    blender.principled(made).inputs["Specular IOR Level"].default_value = 0.0
    return made


def row(count: int, *, one_mesh: bool = False, of: Any = None) -> list[Any]:
    """Planes beside each other, of a material if one is given, and of one mesh if asked for."""
    objects: list[Any] = []
    for index in range(count):
        if one_mesh and objects:
            made = objects[0].copy()
            bpy.context.scene.collection.objects.link(made)
        else:
            made = blender.plane(f"Plane {index}")
            if of is not None:
                made.data.materials.append(of)
        made.location = (3.0 * index, 0.0, 0.0)
        objects.append(made)
    return objects


def slots(objects: Sequence[Any]) -> list[Any]:
    return [[(slot.link, slot.material) for slot in obj.material_slots] for obj in objects]


def shown(obj: Any) -> set[str]:
    """The names of the images in an object's materials."""
    trees = [slot.material.node_tree for slot in obj.material_slots if slot.material is not None]
    return {node.image.name for tree in trees if tree for node in tree.nodes if node.type == "TEX_IMAGE"}


def rendered(count: int, folder: Path) -> list[float]:
    """What Cycles shows of each of a row under white light: its colour."""
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("White")
    if bpy.app.version < (5, 0):
        scene.world.use_nodes = True
    background = next(node for node in scene.world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    camera = bpy.data.cameras.new("Above")
    camera.type, camera.ortho_scale = "ORTHO", 3.0 * count
    scene.camera = bpy.data.objects.new("Above", camera)
    scene.camera.location = (1.5 * (count - 1), 0.0, 5.0)
    scene.collection.objects.link(scene.camera)
    render = scene.render
    render.engine, render.resolution_x, render.resolution_y, render.resolution_percentage = "CYCLES", 8 * count, 8, 100
    render.image_settings.file_format, render.filepath = "OPEN_EXR", str(folder / "row.exr")
    scene.cycles.samples, scene.cycles.device, scene.cycles.use_denoising = 16, "CPU", False
    bpy.ops.render.render(write_still=True)
    pixels, _ = read_image(folder / "row.exr")
    return [float(np.mean(pixels[3:5, 8 * index + 3 : 8 * index + 5, 0])) for index in range(count)]


@pytest.mark.parametrize("one_mesh", [False, True])
def test_each_object_shows_its_own(one_mesh: bool, tmp_path: Path) -> None:
    """And one that was not baked shows none. A convex world of white light is seen in the colour of what it lights."""
    common = paint()
    objects = row(3, one_mesh=one_mesh, of=common)
    before, materials = slots(objects), set(bpy.data.materials)
    for _ in range(2):
        for obj, value in zip(objects[:2], (0.2, 0.7), strict=True):
            assert not link_images(obj, {"ao": image(value)}, None, gltf=True)
    assert len(bpy.data.materials) == 3
    # Cycles' sampling leaves a few thousandths; the light that planes throw at each other is none, they lie in one.
    assert rendered(3, tmp_path) == pytest.approx([0.2, 0.7, 1.0], abs=0.03)
    assert all(unlink_images(obj) for obj in objects[:2])
    assert slots(objects) == before and set(bpy.data.materials) == materials
    assert not any(has_linked_images(obj) for obj in objects)


def test_the_button_does_so_and_undo_takes_it_back(registered: None) -> None:
    common = paint()
    objects = row(2, of=common)
    set_panel(width=32, height=32, quality="RAYS", rays=4, use_material=True)
    select(*objects)
    bpy.ops.ed.undo_push(message="before")
    assert press() == {"FINISHED"}
    bpy.ops.ed.undo_push(message="baked")
    names = ["Plane 0", "Plane 1"]
    assert [shown(bpy.data.objects[name]) for name in names] == [{"Plane 0 AO"}, {"Plane 1 AO"}]
    bpy.ops.ed.undo()
    assert [slot.material.name for name in names for slot in bpy.data.objects[name].material_slots] == ["Paint"] * 2
    assert [each.name for each in bpy.data.materials] == ["Paint"] and not shown(bpy.data.objects["Plane 0"])
    bpy.ops.ed.redo()
    assert [shown(bpy.data.objects[name]) for name in names] == [{"Plane 0 AO"}, {"Plane 1 AO"}]


def test_blenders_gltf_exporter_finds_each(tmp_path: Path) -> None:
    for index, obj in enumerate(row(2, one_mesh=True, of=paint())):
        link_images(obj, {"ao": image(0.5, f"AO {index}")}, None, preview=False, gltf=True)
    bpy.ops.preferences.addon_enable(module="io_scene_gltf2")
    bpy.ops.export_scene.gltf(filepath=str(tmp_path / "row.gltf"), export_format="GLTF_SEPARATE")
    told = json.loads((tmp_path / "row.gltf").read_text())
    textures = {each["name"]: told["textures"][each["occlusionTexture"]["index"]] for each in told["materials"]}
    assert {told["images"][each["source"]]["name"] for each in textures.values()} == {"AO 0", "AO 1"}


def test_a_material_of_one_object_is_no_copy() -> None:
    (obj,) = row(1, of=paint())
    before = slots([obj])
    link_images(obj, {"ao": image(0.5)}, None)
    assert slots([obj]) == before and shown(obj)


def test_of_what_was_duplicated_each_keeps_its_own() -> None:
    """In place for the first; the duplicate's is a copy of that, which stays when the images go."""
    (obj,) = row(1, of=paint())
    link_images(obj, {"ao": image(0.5, "First")}, None)
    duplicate = obj.copy()
    bpy.context.scene.collection.objects.link(duplicate)
    link_images(duplicate, {"ao": image(0.5, "Second")}, None)
    link_images(obj, {"ao": image(0.5, "Third")}, None)
    assert (shown(obj), shown(duplicate)) == ({"Third"}, {"Second"})
    assert unlink_images(duplicate) and (shown(obj), shown(duplicate)) == ({"Third"}, set())


def test_a_copy_of_a_copy_gives_back_the_first() -> None:
    common = paint()
    objects = row(2, of=common)
    link_images(objects[0], {"ao": image(0.5, "First")}, None)
    objects.append(objects[0].copy())
    bpy.context.scene.collection.objects.link(objects[2])
    link_images(objects[2], {"ao": image(0.5, "Second")}, None)
    assert [shown(obj) for obj in objects] == [{"First"}, set(), {"Second"}]
    for obj in objects:
        unlink_images(obj)
    assert slots(objects) == [[("DATA", common)]] * 3 and list(bpy.data.materials) == [common]


@pytest.mark.parametrize("with_others", [False, True])
def test_objects_that_show_one_image_share_a_material(with_others: bool) -> None:
    common = paint()
    objects = row(3 if with_others else 2, of=common)
    atlas = image(0.5)
    for obj in objects[:2]:
        link_images(obj, {"ao": atlas}, "UVMap", among=objects[:2])
    first, second = (obj.material_slots[0].material for obj in objects[:2])
    assert first == second and (first == common) != with_others
    for obj in objects[:2]:
        unlink_images(obj)
    assert list(bpy.data.materials) == [common] and not shown(objects[0])


@pytest.mark.parametrize("in_slot", [False, True])
def test_what_nodes_give_shows_the_maps_by_a_slot_or_a_line_says_so(in_slot: bool, registered: None) -> None:
    common = paint()
    objects = row(2, of=common) if in_slot else [blender.plane("Plane 0")]
    nodes = bpy.data.node_groups.new("Nodes", "GeometryNodeTree")
    for side in ("INPUT", "OUTPUT"):
        nodes.interface.new_socket("Geometry", in_out=side, socket_type="NodeSocketGeometry")
    kinds = ("NodeGroupInput", "GeometryNodeSetMaterial", "NodeGroupOutput")
    first, given, last = (nodes.nodes.new(kind) for kind in kinds)
    given.inputs["Material"].default_value = common
    nodes.links.new(first.outputs[0], given.inputs[0])
    nodes.links.new(given.outputs[0], last.inputs[0])
    objects[0].modifiers.new("Painter", "NODES").node_group = nodes
    set_panel(width=8, height=8, quality="RAYS", rays=4, use_material=True)
    assert bake_onto("Plane 0") == {"FINISHED"}
    line = "Plane 0: its modifier Painter gives faces the material Paint, which is in no slot"
    assert (line in bpy.context.window_manager.occlusion_bake.lines) != in_slot
    evaluated = objects[0].evaluated_get(bpy.context.evaluated_depsgraph_get())
    slot = evaluated.data.polygons[0].material_index
    assert any("occlusion_bake" in node for node in evaluated.material_slots[slot].material.node_tree.nodes) == in_slot


def test_a_part_of_those_shares_a_new_copy() -> None:
    """As an atlas of some of an atlas' objects."""
    common = paint()
    objects = row(4, of=common)
    for shared in (objects[:3], objects[:2]):
        atlas = image(0.5, f"Atlas of {len(shared)}")
        for obj in shared:
            link_images(obj, {"ao": atlas}, "UVMap", among=shared)
    assert [shown(obj) for obj in objects] == [{"Atlas of 2"}, {"Atlas of 2"}, {"Atlas of 3"}, set()]
    first, second, *_ = (obj.material_slots[0].material for obj in objects)
    assert first == second
    for obj in objects:
        unlink_images(obj)
    assert list(bpy.data.materials) == [common] and slots(objects) == [[("DATA", common)]] * 4


@pytest.mark.parametrize("by_input", [False, True])
def test_what_nodes_of_others_give_them_stays(by_input: bool) -> None:
    common = paint()
    (obj,), other = row(1, of=common), blender.plane("Other")
    nodes = bpy.data.node_groups.new("Nodes", "GeometryNodeTree")
    nodes.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    modifier: Any = other.modifiers.new("Nodes", "NODES")
    if by_input:
        socket = nodes.interface.new_socket("Material", in_out="INPUT", socket_type="NodeSocketMaterial")
        modifier.node_group = nodes
        if bpy.app.version >= (5, 2):
            getattr(modifier.properties.inputs, socket.identifier).value = common
        else:
            modifier[socket.identifier] = common
    else:
        outer = bpy.data.node_groups.new("Outer", "GeometryNodeTree")
        outer.nodes.new("GeometryNodeGroup").node_tree = nodes
        nodes.nodes.new("GeometryNodeSetMaterial").inputs["Material"].default_value = common
        modifier.node_group = outer
    link_images(obj, {"ao": image(0.5)}, None)
    assert shown(obj) and not any("occlusion_bake" in node for node in common.node_tree.nodes)


@pytest.mark.parametrize("order", [1, -1])
def test_of_one_mesh_without_materials_each_gets_one(order: int) -> None:
    objects = row(2, one_mesh=True)
    for index, obj in enumerate(objects):
        link_images(obj, {"ao": image(0.5, f"AO {index}")}, None)
    assert [shown(obj) for obj in objects] == [{"AO 0"}, {"AO 1"}]
    for obj in objects[::order]:
        assert unlink_images(obj)
    assert not objects[0].material_slots and not bpy.data.materials


@pytest.fixture
def library(tmp_path: Path) -> str:
    """A file of an object with a material, and of one without any."""
    row(1, of=paint())
    blender.plane("Bare")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"))
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    return str(tmp_path / "library.blend")


def test_what_is_linked_is_copied_or_a_line_says_why_not(library: str, registered: None) -> None:
    with bpy.data.libraries.load(library, link=True) as (_, wanted):
        wanted.objects, wanted.materials = ["Plane 0", "Bare"], ["Paint"]
    linked, bare = (bpy.data.objects[name] for name in ("Plane 0", "Bare"))
    things = [linked, linked.override_create(), bpy.data.objects.new("Of a mesh", bare.data)]
    for thing in things:
        bpy.context.scene.collection.objects.link(thing)
    things.append(blender.plane("Local"))
    things[3].data.materials.append(bpy.data.materials["Paint"])
    set_panel(width=32, height=32, quality="RAYS", rays=4, use_material=True)
    select(*things)
    assert press() == {"FINISHED"}
    lines = bpy.context.window_manager.occlusion_bake.lines
    assert f"{linked.name}: it is linked from {library}" in lines and "make a library override" in lines
    assert "Of a mesh: its mesh is linked from" in lines and "has no slot for a material" in lines
    assert [len(shown(obj)) for obj in things] == [0, 1, 0, 1]
    assert all(unlink_images(things[index]) for index in (1, 3)) and len(bpy.data.materials) == 1


def test_a_material_without_nodes_gets_them_in_a_copy() -> None:
    if bpy.app.version >= (5, 0):
        pytest.skip("all materials have nodes")
    (obj,) = row(1, of=bpy.data.materials.new("Plain"))
    before = slots([obj])
    before[0][0][1].diffuse_color = (0.2, 0.4, 0.6, 1.0)
    assert not link_images(obj, {"ao": image(0.5)}, None)
    mix = base_colour(obj.material_slots[0].material).links[0].from_node
    colour = next(socket for socket in mix.inputs if socket.type == "RGBA")
    assert tuple(colour.default_value) == pytest.approx((0.2, 0.4, 0.6, 1.0))
    assert unlink_images(obj) and slots([obj]) == before and before[0][0][1].node_tree is None


def test_a_material_that_cannot_show_maps_is_said_and_left_alone() -> None:
    """Its Principled BSDF leads nowhere."""
    glowing = paint()
    tree = glowing.node_tree
    output = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL")
    tree.links.new(tree.nodes.new("ShaderNodeEmission").outputs[0], output.inputs["Surface"])
    objects = row(2, of=glowing)
    (line,) = link_images(objects[0], {"ao": image(0.5)}, None)
    assert line.startswith("Plane 0: no Principled BSDF leads to the output of its material Paint")
    assert not has_linked_images(objects[0]) and slots(objects) == [[("DATA", glowing)]] * 2


def test_of_several_shaders_each_shows_the_maps(tmp_path: Path) -> None:
    mixed = paint()
    tree, first = mixed.node_tree, blender.principled(mixed)
    second, mixer = tree.nodes.new("ShaderNodeBsdfPrincipled"), tree.nodes.new("ShaderNodeMixShader")
    second.inputs["Base Color"].default_value = (0.5, 0.5, 0.5, 1.0)
    second.inputs["Specular IOR Level"].default_value = 0.0
    tree.links.new(first.outputs[0], mixer.inputs[1])
    tree.links.new(second.outputs[0], mixer.inputs[2])
    tree.links.new(mixer.outputs[0], next(n for n in tree.nodes if n.type == "OUTPUT_MATERIAL").inputs["Surface"])
    (obj,) = row(1, of=mixed)
    for _ in range(2):
        link_images(obj, {"ao": image(0.4), "ro_10": image(0.4)}, None)
    assert rendered(1, tmp_path) == pytest.approx([0.4 * 0.75], abs=0.02)
    assert unlink_images(obj) and len(tree.nodes) == 4
    assert not first.inputs["Base Color"].is_linked and not second.inputs["Specular IOR Level"].is_linked


def test_by_the_button_an_atlas_shares_a_material(registered: None) -> None:
    objects = row(2, of=paint())
    set_panel(width=64, height=64, quality="RAYS", rays=4, use_material=True, layout="ATLAS", atlas="Both", uv="CHARTS")
    assert bake_onto(*(obj.name for obj in objects)) == {"FINISHED"}
    assert [shown(obj) for obj in objects] == [{"Both AO"}] * 2
    assert objects[0].material_slots[0].material == objects[1].material_slots[0].material
