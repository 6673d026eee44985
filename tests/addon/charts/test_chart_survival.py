"""Meshes that modifiers make: which have charts, which bring UV maps of their own, and what is said of the others."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.addon.charts.chart_marks import CHART_MAP  # noqa: E402
from occlusion_bake.addon.read import rendered_maps  # noqa: E402
from occlusion_bake.addon.read.block_ref import refs_of  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402
from occlusion_bake.tests.oracles.blender import pixels, press, select, set_panel  # noqa: E402


@pytest.fixture(autouse=True)
def scene(registered: None, empty_scene: None) -> Any:
    return set_panel(width=64, height=64, quality="RAYS", rays=4, margin=2, threads=2)


def lines() -> list[str]:
    return bpy.context.window_manager.occlusion_bake.lines.split("\n")


def refused(button: str = "bake") -> str:
    with pytest.raises(RuntimeError):
        press(button)
    return lines()[0]


def add(obj: Any, kind: str, **values: Any) -> Any:
    """A modifier that is named like its kind."""
    modifier = obj.modifiers.new(kind, kind)
    for name, value in values.items():
        setattr(modifier, name, value)
    return obj


def remesh(obj: Any) -> Any:
    return add(obj, "REMESH", mode="VOXEL", voxel_size=0.5)


def by_ref(*objects: Any) -> rendered_maps.Objects:
    return dict(zip(refs_of(objects), objects, strict=True))


def line(name: str = "Bare") -> Any:
    """Two edges, no faces."""
    obj = blender.mesh(name, ((1, 0, -1), (1.2, 0, 0), (1, 0, 1)), ())
    obj.data.edges.add(2)
    obj.data.edges.foreach_set("vertices", (0, 1, 1, 2))
    return obj


def nodes(obj: Any, last: Callable[[Any, Any], Any]) -> Any:
    """A Geometry Nodes modifier. last: of a new node group and its input, the socket that gives the result."""
    group = bpy.data.node_groups.new("Made", "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    start, end = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    group.links.new(last(group, start.outputs[0]), end.inputs[0])
    return add(obj, "NODES", node_group=group)


def primitive(group: Any, _: Any) -> Any:
    return group.nodes.new("GeometryNodeMeshCube").outputs["Mesh"]


def dual(group: Any, mesh: Any) -> Any:
    """Each face's corners are those of one vertex, so that a map without seams there has no area."""
    other = group.nodes.new("GeometryNodeDualMesh")
    group.links.new(mesh, other.inputs[0])
    return other.outputs[0]


def with_own_map(group: Any, _: Any) -> Any:
    cube, store = group.nodes.new("GeometryNodeMeshCube"), group.nodes.new("GeometryNodeStoreNamedAttribute")
    store.data_type, store.domain = "FLOAT2", "CORNER"
    store.inputs["Name"].default_value = "Own"
    group.links.new(cube.outputs["Mesh"], store.inputs["Geometry"])
    value = next(socket for socket in store.inputs if socket.name == "Value" and socket.enabled)
    group.links.new(cube.outputs["UV Map"], value)
    return store.outputs["Geometry"]


def instances(group: Any, mesh: Any) -> Any:
    points, placed = group.nodes.new("GeometryNodeMeshToPoints"), group.nodes.new("GeometryNodeInstanceOnPoints")
    group.links.new(mesh, points.inputs[0])
    group.links.new(points.outputs[0], placed.inputs["Points"])
    group.links.new(group.nodes.new("GeometryNodeMeshCube").outputs["Mesh"], placed.inputs["Instance"])
    return placed.outputs[0]


def realized(group: Any, mesh: Any) -> Any:
    real = group.nodes.new("GeometryNodeRealizeInstances")
    group.links.new(instances(group, mesh), real.inputs[0])
    return real.outputs[0]


def without_map(group: Any, mesh: Any) -> Any:
    """The mesh as it is, but for the map that Blender gives a cube."""
    remove = group.nodes.new("GeometryNodeRemoveAttribute")
    remove.inputs["Name"].default_value = "UVMap"
    group.links.new(mesh, remove.inputs[0])
    return remove.outputs[0]


MAKERS: dict[str, Callable[[], Any]] = {
    "remeshed, without a map": lambda: remesh(blender.bare_cube()),
    "remeshed, with one": lambda: remesh(blender.cube("Bare")),
    "wires, whose UVs have no area": lambda: add(blender.cube("Bare"), "WIREFRAME", thickness=0.2),
    "screw of a line": lambda: add(line(), "SCREW"),
    "primitive": lambda: nodes(blender.bare_cube(), primitive),
    "dual mesh": lambda: nodes(blender.bare_cube(), dual),
}


@pytest.mark.parametrize("make", MAKERS.values(), ids=MAKERS)
def test_the_modifier_is_named_and_what_is_said_to_help_helps(make: Callable[[], Any]) -> None:
    obj = make()
    select(obj)
    before = [layer.name for layer in obj.data.uv_layers]
    said, kind = refused(), obj.modifiers[0].name
    assert said.startswith(f"Bare: its modifier {kind} makes faces that charts of the mesh do not reach; ")
    assert "apply it and unwrap the mesh" in said
    assert [layer.name for layer in obj.data.uv_layers] == before and not bpy.data.images
    assert refused("unwrap") == said
    bpy.ops.object.modifier_apply(modifier=kind)
    set_panel(uv="SMART")
    assert press() == {"FINISHED"} and pixels("Bare AO").max() == 1.0


def test_it_is_the_one_among_several_and_others_are_baked() -> None:
    both = blender.bare_cube("Fine"), blender.bare_cube("Made", location=(4, 0, 0))
    for kind in ("BEVEL", "REMESH", "SMOOTH", "WELD"):
        add(both[1], kind)
    both[1].modifiers["BEVEL"].show_render = False
    select(*both)
    assert press() == {"FINISHED"} and [image.name for image in bpy.data.images] == ["Fine AO"]
    assert any(each.startswith("Made: its modifier REMESH makes faces") for each in lines())
    assert [modifier.show_render for modifier in both[1].modifiers] == [False, True, True, True]


@pytest.mark.parametrize("charted", [False, True])
def test_what_nodes_lay_out_is_baked_as_it_is(charted: bool) -> None:
    """Onto the map that the nodes store, and the material shows that, even where the mesh has charts of an earlier
    bake."""
    obj = blender.bare_cube()
    select(obj)
    set_panel(use_material=True)
    if charted:
        press()
    nodes(obj, with_own_map)
    before = [layer.name for layer in obj.data.uv_layers]
    assert before == [CHART_MAP] * charted
    assert press() == {"FINISHED"} and not any("charts" in each for each in lines())
    assert [layer.name for layer in obj.data.uv_layers] == before
    tree = obj.material_slots[0].material.node_tree
    assert [node.uv_map for node in tree.nodes if node.type == "UVMAP"] == ["Own"]
    (target,) = blender.read(["Bare"])[0].targets
    assert target.mesh.uv_map == "Own"
    set_panel(uv="CHARTS")
    assert "bake onto the UV map that it has then, Own" in refused()


def test_charts_are_made_where_they_survive() -> None:
    """Nodes that drop the artist's map leave a map of ours."""
    obj = nodes(blender.cube("Bare"), without_map)
    assert press() == {"FINISHED"}
    assert [layer.name for layer in obj.data.uv_layers] == ["UVMap", CHART_MAP] and pixels("Bare AO").max() == 1.0


def test_a_cutters_map_does_not_stand_for_the_meshs() -> None:
    """A Boolean brings it, and it lies over the cut alone."""
    cutter = blender.cube("Cutter", size=1.2, location=(1, 1, 1))
    cutter.hide_render = True
    obj = add(blender.bare_cube(), "BOOLEAN", object=cutter)
    select(obj)
    assert press() == {"FINISHED"} and CHART_MAP in obj.data.uv_layers
    assert (pixels("Bare AO")[..., 0] == 1.0).mean() > 0.2


def test_a_mesh_without_room_for_charts_is_told_so() -> None:
    obj = nodes(blender.bare_cube(), lambda _, mesh: mesh)
    for i in range(8):
        obj.data.uv_layers.new(name=f"Map {i}")
    set_panel(uv="SMART")
    assert refused() == "Bare: Blender has no room for another UV map on its mesh; remove one"


def test_the_viewport_does_not_matter() -> None:
    obj = remesh(blender.cube("Bare"))
    obj.modifiers[0].show_render = False
    assert press() == {"FINISHED"}


def test_a_map_that_is_asked_for_and_dropped(bake: Any) -> None:
    remesh(blender.cube("Made"))
    blender.cube("Fine", location=(4, 0, 0))
    made = bake("--uv", "UVMap")
    assert made.status != 0 and made.files == ["Fine_ao.png", "report.json"]
    assert "Made: its modifier REMESH drops the UV map UVMap; apply it and unwrap the mesh" in made.out + made.err


@pytest.mark.parametrize("output", ["PACKED", "COLOURS"])
def test_instances_alone_are_no_faces(output: str) -> None:
    obj = nodes(blender.bare_cube(), instances)
    set_panel(output=output)
    said = refused()
    assert said.startswith("Bare: its modifier NODES leaves it no faces to bake; end its nodes with Realize Instances")
    obj.modifiers.clear()
    nodes(obj, realized)
    (maps,) = rendered_maps.rendered_maps(bpy.context, by_ref(obj)).values()
    assert maps.has_faces


def test_what_keeps_uv_maps_keeps_them() -> None:
    """All kinds of modifiers that are not looked at more closely, as they are when they are new."""
    known = {item.identifier for item in bpy.types.Modifier.bl_rna.properties["type"].enum_items}
    assert known >= rendered_maps._KEEPING
    objects = [add(blender.cube(kind), kind) for kind in rendered_maps._KEEPING - {"SURFACE"}]
    bare = add(blender.bare_cube(), "SUBSURF")
    assert not any(map(rendered_maps.remakes_mesh, [*objects, bare]))
    found = rendered_maps.as_rendered(
        bpy.context, by_ref(*objects, bare), lambda mesh: [each.name for each in mesh.uv_layers]
    )
    assert {ref.label: names for ref, names in found.items()} == {
        **{obj.name: ["UVMap"] for obj in objects},
        "Bare": [],
    }
