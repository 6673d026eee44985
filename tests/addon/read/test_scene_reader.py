"""Scenes built by script; what `read_scene` returns must be what Cycles would see of them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.addon.charts.base_mesh import base_triangles  # noqa: E402
from occlusion_bake.addon.charts.uv_maps import check_map, write_uv  # noqa: E402
from occlusion_bake.addon.read.depsgraph import evaluated  # noqa: E402
from occlusion_bake.addon.read.mesh_arrays import corners_of  # noqa: E402
from occlusion_bake.addon.read.scene_reader import SceneRequest, read_scene  # noqa: E402
from occlusion_bake.core.base.errors import InputError  # noqa: E402
from occlusion_bake.core.scene.scene import Scene  # noqa: E402
from occlusion_bake.tests.oracles import blender, shapes  # noqa: E402

pytestmark = pytest.mark.usefixtures("empty_scene")


def add(name: str, data: Any = None, location: tuple[float, float, float] = (0, 0, 0)) -> Any:
    obj = bpy.data.objects.new(name, data)
    obj.location = location
    bpy.context.scene.collection.objects.link(obj)
    return obj


def cube(name: str = "Cube", **options: Any) -> Any:
    bpy.ops.mesh.primitive_cube_add(**options)
    bpy.context.object.name = name
    return bpy.context.object


def folded(smooth: tuple[bool, bool] = (False, False), uv: bool = True) -> Any:
    """Two quads bent along their diagonals, side by side in UV."""
    mesh = bpy.data.meshes.new("Folded")
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0.5), (0, 1, 0), (3, 0, 0), (4, 0, 0), (4, 1, 0.2), (3, 1, 0)]
    mesh.from_pydata(corners, [], [(0, 1, 2, 3), (4, 5, 6, 7)])
    mesh.polygons.foreach_set("use_smooth", smooth)
    if uv:
        layout = [(0, 0), (0.5, 0), (0.5, 1), (0, 1), (0.5, 0), (1, 0), (1, 1), (0.5, 1)]
        mesh.uv_layers.new(name="Map").uv.foreach_set("vector", np.array(layout, np.float32).reshape(-1))
    mesh.update()
    return mesh


def take(*targets: str, uv: str | None = None, warnings: list[str] | None = None) -> Scene:
    scene, lines = blender.read(targets, uv=uv)
    if warnings is not None:
        warnings += lines
    return scene


def names(scene: Scene) -> list[str]:
    return sorted(instance.name for instance in scene.occluders)


def test_a_cube_arrives_whole() -> None:
    cube(location=(1, 2, 3)).scale = (-1, 2, 0.5)
    scene = take("Cube")
    (target,) = scene.targets
    mesh = target.mesh
    assert scene.occluders[0].mesh is mesh and scene.occluders[0].name == target.name == "Cube"
    assert mesh.vertices.shape == (8, 3) and mesh.vertices.dtype == np.float32
    assert mesh.triangles.shape == (12, 3) and mesh.triangles.dtype == np.int32
    assert mesh.uv is not None and mesh.uv.shape == (12, 3, 2) and mesh.uv.dtype == np.float32
    assert mesh.normals is None
    a, b, c = (mesh.vertices[mesh.triangles[:, corner]] for corner in range(3))
    assert (np.einsum("ij,ij->i", np.cross(b - a, c - a), a + b + c) > 0).all()
    assert target.matrix.dtype == np.float64
    np.testing.assert_allclose(target.matrix, [[-1, 0, 0, 1], [0, 2, 0, 2], [0, 0, 0.5, 3], [0, 0, 0, 1]])


def test_modifiers_count_at_render_level() -> None:
    obj = cube()
    level = obj.modifiers.new("Subdivision", "SUBSURF")
    level.levels, level.render_levels = 0, 2
    viewport_only = obj.modifiers.new("Array", "ARRAY")
    viewport_only.show_render = False
    assert len(take("Cube").targets[0].mesh.triangles) == 6 * 4**2 * 2
    bpy.context.scene.render.use_simplify = True
    bpy.context.scene.render.simplify_subdivision_render = 1
    assert len(take("Cube").targets[0].mesh.triangles) == 6 * 4 * 2


def test_what_is_hidden_from_render_or_casts_no_shadow_does_not_occlude() -> None:
    data = cube("Target").data
    add("Hidden", data).hide_render = True
    add("No Shadow", data).visible_shadow = False
    add("Not in Viewport", data).hide_viewport = True
    add("Not to the Camera", data).visible_camera = False
    add("Holdout", data).is_holdout = True
    add("Put Away", data).hide_set(True)
    for name, flag in (("Off", "hide_render"), ("Excluded", "exclude"), ("Indirect", "indirect_only")):
        collection = bpy.data.collections.new(name)
        bpy.context.scene.collection.children.link(collection)
        collection.objects.link(bpy.data.objects.new(f"In {name}", data))
        owner = collection if hasattr(collection, flag) else bpy.context.view_layer.layer_collection.children[name]
        setattr(owner, flag, True)
    assert names(take("Target")) == [
        "Holdout", "In Indirect", "Not in Viewport", "Not to the Camera", "Put Away", "Target",
    ]  # fmt: skip


def test_a_target_without_shadow_is_still_baked() -> None:
    cube().visible_shadow = False
    scene = take("Cube")
    assert len(scene.targets) == 1 and not scene.occluders


def test_only_geometry_occludes() -> None:
    cube()
    add("Empty")
    add("Lamp", bpy.data.lights.new("Lamp", "SUN"))
    add("Camera", bpy.data.cameras.new("Camera"))
    add("Volume", bpy.data.volumes.new("Volume"))
    wire = bpy.data.meshes.new("Wire")
    wire.from_pydata([(0, 0, 0), (1, 0, 0)], [(0, 1)], [])
    add("Wire", wire)
    add("No Points", bpy.data.meshes.new("Nothing"))
    assert names(take("Cube")) == ["Cube"]


def test_curves_text_surfaces_and_metaballs_occlude_as_the_meshes_they_make() -> None:
    cube()
    bpy.ops.object.text_add()
    bpy.ops.curve.primitive_bezier_circle_add()
    bpy.context.object.data.bevel_depth = 0.1
    bpy.ops.curve.primitive_nurbs_path_add()
    bpy.ops.surface.primitive_nurbs_surface_sphere_add()
    bpy.ops.object.metaball_add(location=(0, 0, 9))
    bpy.ops.object.metaball_add(location=(1, 0, 9))
    scene = take("Cube")
    assert names(scene) == ["BézierCircle/BézierCircle", "Cube", "Mball/Mball", "SurfSphere/SurfSphere", "Text/Text"]
    assert all(len(instance.mesh.triangles) > 50 for instance in scene.occluders if instance.name != "Cube")


def test_instances_share_one_mesh_and_bear_their_own_places() -> None:
    data = cube("Target").data
    add("Twin", data, (5, 0, 0))
    add("Other", folded(), (0, 5, 0))
    library = bpy.data.collections.new("Library")
    library.objects.link(bpy.data.objects.new("Inside", data))
    outer = add("Outer", None, (0, 0, 7))
    outer.instance_type, outer.instance_collection = "COLLECTION", library
    scene = take("Target")
    by_name = {instance.name: instance for instance in scene.occluders}
    assert set(by_name) == {"Target", "Twin", "Other", "Outer/Inside"}
    assert by_name["Twin"].mesh is by_name["Outer/Inside"].mesh is scene.targets[0].mesh
    np.testing.assert_array_equal(by_name["Outer/Inside"].matrix[:3, 3], (0, 0, 7))
    np.testing.assert_array_equal(by_name["Twin"].matrix[:3, 3], (5, 0, 0))
    assert by_name["Other"].mesh.uv is None and by_name["Other"].mesh.normals is None


def test_an_instancer_hidden_from_render_leaves_its_instances() -> None:
    parent = cube("Parent", size=4)
    child = cube("Child")
    child.parent = parent
    parent.instance_type = "VERTS"
    parent.show_instancer_for_render = False
    add("Else", folded())
    scene = take("Else")
    assert names(scene) == ["Else"] + ["Parent/Child"] * 8
    assert len({id(instance.mesh) for instance in scene.occluders}) == 2
    with pytest.raises(InputError, match=r"^Parent: an instancer hidden from render"):
        take("Parent")


def scattering(owner: Any, instanced: Any, keep: bool) -> None:
    """Geometry nodes: `instanced` on each vertex of the mesh, which itself is kept or not."""
    group = bpy.data.node_groups.new("Scatter", "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    made = {kind: group.nodes.new(kind) for kind in (
        "NodeGroupInput", "NodeGroupOutput", "GeometryNodeInstanceOnPoints", "GeometryNodeObjectInfo",
        "GeometryNodeJoinGeometry",
    )}  # fmt: skip
    source, out, scatter, info, join = made.values()
    info.inputs["Object"].default_value = instanced
    link = group.links.new
    link(source.outputs[0], scatter.inputs["Points"])
    link(info.outputs["Geometry"], scatter.inputs["Instance"])
    link(scatter.outputs[0], join.inputs[0])
    if keep:
        link(source.outputs[0], join.inputs[0])
    link(join.outputs[0], out.inputs[0])
    owner.modifiers.new("Scatter", "NODES").node_group = group


def test_geometry_nodes_instances_occlude() -> None:
    seed = cube("Seed")
    seed.hide_render = True
    owner = cube("Owner", size=10)
    scattering(owner, seed, keep=True)
    scene = take("Owner")
    assert len(scene.occluders) == 1 + 8
    assert len({id(instance.mesh) for instance in scene.occluders}) == 2
    assert scene.targets[0].mesh.uv is not None
    assert len(scene.targets[0].mesh.triangles) == 12


def test_a_target_whose_nodes_leave_instances_alone_has_no_surface() -> None:
    owner = cube("Owner")
    scattering(owner, cube("Seed"), keep=False)
    scene = take("Owner")
    assert len(scene.targets[0].mesh.triangles) == 0
    assert names(scene) == ["Owner/Owner"] * 8 + ["Seed"]


def test_particles_that_render_as_objects_occlude() -> None:
    seed = cube("Seed", size=0.1)
    owner = cube("Owner")
    owner.modifiers.new("Particles", "PARTICLE_SYSTEM")
    settings = owner.particle_systems[0].settings
    settings.type, settings.count, settings.use_advanced_hair = "HAIR", 25, True
    settings.render_type, settings.instance_object = "OBJECT", seed
    scene = take("Owner")
    assert names(scene) == ["Owner"] + ["Owner/Seed"] * 25 + ["Seed"]


def test_hair_and_points_are_named_in_one_line_each() -> None:
    owner = cube("Owner")
    owner.modifiers.new("Particles", "PARTICLE_SYSTEM")
    owner.particle_systems[0].settings.type = "HAIR"
    add("Fur", bpy.data.hair_curves.new("Fur"))
    add("Shaved", bpy.data.hair_curves.new("Shaved")).visible_shadow = False
    warnings: list[str] = []
    assert names(take("Owner", warnings=warnings)) == ["Owner"]
    assert sorted(warnings) == [
        "Fur: its hair curves are not traced and block no light here; convert them to a mesh",
        "Owner: its hair particles are not traced and block no light here; convert them to a mesh",
    ]


def test_a_parent_without_shadow_takes_it_from_its_instances() -> None:
    data = cube().data
    library = bpy.data.collections.new("Library")
    library.objects.link(bpy.data.objects.new("Inside", data))
    outer = add("Outer")
    outer.instance_type, outer.instance_collection = "COLLECTION", library
    outer.visible_shadow = False
    assert names(take("Cube")) == ["Cube"]


def test_the_uv_map_asked_for_or_the_active_one() -> None:
    obj = cube()
    second = obj.data.uv_layers.new(name="Second")
    second.uv.foreach_set("vector", np.full(48, 0.25, np.float32))
    first_active = take("Cube").targets[0].mesh.uv
    assert first_active is not None and np.ptp(first_active) > 0.5
    np.testing.assert_array_equal(take("Cube", uv="Second").targets[0].mesh.uv, np.full((12, 3, 2), 0.25))
    obj.data.uv_layers.active = second
    np.testing.assert_array_equal(take("Cube").targets[0].mesh.uv, np.full((12, 3, 2), 0.25))
    with pytest.raises(InputError, match=r"^Cube: no UV map named Third; choose one of those it has: UVMap, Second$"):
        take("Cube", uv="Third")


def test_no_uv_map_is_left_to_the_caller() -> None:
    add("Bare", folded(uv=False))
    assert take("Bare").targets[0].mesh.uv is None
    with pytest.raises(InputError, match=r"^Bare: no UV map named Map; unwrap it first$"):
        take("Bare", uv="Map")


def test_uv_corners_follow_the_triangles() -> None:
    add("Folded", folded())
    mesh = take("Folded").targets[0].mesh
    assert mesh.uv is not None
    expected = np.where(mesh.vertices[:, :1] > 2, mesh.vertices[:, :2] / 2 - (1, 0), mesh.vertices[:, :2] / 2)
    np.testing.assert_allclose(mesh.uv[..., 0], expected[mesh.triangles][..., 0])
    np.testing.assert_allclose(mesh.uv[..., 1], mesh.vertices[mesh.triangles][..., 1])


@pytest.mark.parametrize(
    ("name", "cause"),
    [
        ("Nobody", r"^Nobody: no such object in the file; .+$"),
        ("Elsewhere", r"^Elsewhere: no such object in the view layer ViewLayer; .+$"),
        ("Empty", r"^Empty: is of type empty, .+$"),
        ("Hidden", r"^Hidden: hidden from render; .+$"),
        ("In Off", r"^In Off: hidden from render; .+$"),
    ],
)
def test_what_cannot_be_a_target_is_refused_in_a_line(name: str, cause: str) -> None:
    data = cube().data
    bpy.data.objects.new("Elsewhere", data)
    add("Empty")
    add("Hidden", data).hide_render = True
    collection = bpy.data.collections.new("Off")
    bpy.context.scene.collection.children.link(collection)
    collection.objects.link(bpy.data.objects.new("In Off", data))
    collection.hide_render = True
    with pytest.raises(InputError, match=cause):
        take("Cube", name)


def unit(vectors: Any) -> Any:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def test_a_smooth_sphere_has_its_points_for_normals() -> None:
    bpy.ops.mesh.primitive_uv_sphere_add(segments=32, ring_count=16)
    bpy.ops.object.shade_smooth()
    mesh = take("Sphere").targets[0].mesh
    assert mesh.normals is not None and mesh.normals.dtype == np.float32
    np.testing.assert_allclose(mesh.normals, mesh.vertices[mesh.triangles], atol=0.01)


def test_a_wholly_flat_mesh_has_no_normals() -> None:
    add("Folded", folded())
    assert take("Folded").targets[0].mesh.normals is None


def test_a_flat_polygon_beside_smooth_ones_is_shaded_as_cycles_does() -> None:
    add("Folded", folded((False, True)))
    mesh = take("Folded").targets[0].mesh
    assert mesh.normals is not None
    by_triangle = shapes.face_normals(mesh)
    one = unit(by_triangle[:2].sum(axis=0))
    flat = np.broadcast_to(one, (2, 3)) if bpy.app.version >= (5, 2) else by_triangle[:2]
    np.testing.assert_allclose(mesh.normals[:2], np.repeat(flat[:, np.newaxis], 3, axis=1), atol=1e-6)
    diagonal = mesh.normals[2:].reshape(-1, 3)
    assert np.abs(unit(by_triangle[2:].sum(axis=0)) - diagonal).max(axis=1).min() < 1e-6


def test_custom_normals_count_on_flat_faces_too() -> None:
    mesh = folded()
    mesh.normals_split_custom_set([(0, 0.6, 0.8)] * 8)
    add("Folded", mesh)
    np.testing.assert_allclose(
        take("Folded").targets[0].mesh.normals, np.broadcast_to(np.float32((0, 0.6, 0.8)), (4, 3, 3)), atol=1e-3
    )


def test_the_short_way_to_the_triangles_agrees_with_blenders_own() -> None:
    bpy.ops.mesh.primitive_uv_sphere_add(segments=40, ring_count=30)
    mesh = bpy.context.object.data
    expected = np.empty(3 * len(mesh.loop_triangles), np.int32)
    mesh.loop_triangles.foreach_get("loops", expected)
    np.testing.assert_array_equal(corners_of(mesh).reshape(-1), expected)
    assert corners_of(bpy.data.meshes.new("Empty")).shape == (0, 3)


class Strange:
    """Triangles whose memory is not laid out as hoped."""

    def __init__(self, mesh: Any) -> None:
        self.loop_triangles = self
        self.inner = mesh.loop_triangles
        self.foreach_get = self.inner.foreach_get

    def __len__(self) -> int:
        return len(self.inner)

    def __getitem__(self, index: int) -> Any:
        item = self.inner[index]

        class Triangle:
            loops = item.loops

            @staticmethod
            def as_pointer() -> int:
                return int(item.as_pointer() + 4 * index)

        return Triangle


def test_another_memory_layout_is_noticed() -> None:
    mesh = cube().data
    expected = corners_of(mesh)
    np.testing.assert_array_equal(corners_of(Strange(mesh)), expected)


def test_the_camera() -> None:
    cube()
    assert take("Cube").camera is None
    camera = add("Camera", bpy.data.cameras.new("Camera"), (1, 2, 3))
    camera.rotation_euler = (np.pi / 2, 0, 0)
    camera.scale = (2, 2, 2)
    bpy.context.scene.camera = camera
    found = take("Cube").camera
    assert found is not None and not found.orthographic
    np.testing.assert_allclose(found.position, (1, 2, 3))
    np.testing.assert_allclose(found.forward, (0, 1, 0), atol=1e-6)
    camera.data.type = "ORTHO"
    orthographic = take("Cube").camera
    assert orthographic is not None and orthographic.orthographic


def test_non_finite_vertices_pass() -> None:
    mesh = folded()
    mesh.vertices[0].co.x = float("nan")
    add("Folded", mesh)
    assert np.isnan(take("Folded").targets[0].mesh.vertices).any()


def test_targets_keep_their_order_and_count_once() -> None:
    data = cube("A").data
    add("B", data)
    scene = take("B", "A", "B")
    assert [target.name for target in scene.targets] == ["B", "A"]
    assert scene.targets[0].mesh is scene.targets[1].mesh


def test_another_view_layer_has_objects_of_its_own() -> None:
    data = cube().data
    add("Other", data)
    collection = bpy.data.collections.new("Extra")
    bpy.context.scene.collection.children.link(collection)
    collection.objects.link(bpy.data.objects.new("Extra", data))
    second = bpy.context.scene.view_layers.new("Second")
    bpy.context.view_layer.layer_collection.children["Extra"].exclude = True
    assert names(read_scene(bpy.context, second, SceneRequest(blender.refs("Cube")))[0]) == ["Cube", "Extra", "Other"]
    assert names(take("Cube")) == ["Cube", "Other"]


def state() -> dict[str, Any]:
    context, scene = bpy.context, bpy.context.scene
    return {
        "data": {kind: [item.name for item in getattr(bpy.data, kind)] for kind in
                 ("objects", "meshes", "images", "materials", "cameras", "worlds", "scenes", "collections")},
        "engine": scene.render.engine, "camera": scene.camera, "frame": scene.frame_current,
        "resolution": (scene.render.resolution_x, scene.render.resolution_percentage),
        "mode": context.object and context.object.mode, "active": context.object and context.object.name,
        "selected": sorted(obj.name for obj in context.selected_objects),
        "handlers": [list(getattr(bpy.app.handlers, name)) for name in ("object_bake_pre", "render_pre")],
        "engines": [c.__name__ for c in bpy.types.RenderEngine.__subclasses__() if c.is_registered],
    }  # fmt: skip


def test_nothing_of_the_artists_changes_and_no_handler_hears_of_it() -> None:
    cube("Active")
    add("Other", folded()).select_set(True)
    heard: list[str] = []
    kinds = ("object_bake_pre", "object_bake_complete", "render_init", "render_pre", "render_post", "frame_change_pre")
    for kind in kinds:
        getattr(bpy.app.handlers, kind).append(lambda *_, kind=kind: heard.append(kind))
    before = state()
    take("Active")
    assert state() == before and not heard
    with pytest.raises(InputError):
        take("Active", uv="None")
    assert state() == before and not heard


def test_an_error_while_reading_comes_through() -> None:
    cube()
    before = state()

    def broken(_: Any) -> None:
        raise ArithmeticError("on purpose")

    with pytest.raises(ArithmeticError, match="on purpose"):
        evaluated(bpy.context, bpy.context.view_layer, broken)
    assert state() == before


def test_edits_in_progress_count_with_their_modifiers_and_edit_mode_stays() -> None:
    obj, other = cube("One"), cube("Two")
    level = obj.modifiers.new("Subdivision", "SUBSURF")
    level.levels, level.render_levels, level.show_in_editmode = 0, 1, False
    cube("Bystander")
    obj.select_set(True)
    other.select_set(True)
    bpy.data.objects["Bystander"].select_set(False)
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.subdivide(number_cuts=1)
    obj.select_set(False)
    before = state()
    assert obj.mode == other.mode == "EDIT"
    scene = take("One", "Two")
    assert [len(target.mesh.triangles) for target in scene.targets] == [6 * 4 * 4 * 2, 6 * 4 * 2]
    assert state() == before and obj.mode == other.mode == "EDIT"


def test_linked_library_objects_occlude_and_can_be_targets(tmp_path: Path) -> None:
    cube("Lib Cube")
    library = str(tmp_path / "library.blend")
    bpy.data.libraries.write(library, {bpy.data.objects["Lib Cube"]})
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(library, link=True) as (_, wanted):
        wanted.objects = ["Lib Cube"]
    bpy.context.scene.collection.objects.link(wanted.objects[0])
    scene = take("Lib Cube")
    assert names(scene) == ["Lib Cube"] and scene.targets[0].mesh.uv is not None
    assert len(base_triangles(bpy.context, wanted.objects[0]).triangles) == 12
    with pytest.raises(InputError, match=r"^Lib Cube: its mesh is linked from .+; make it local first$"):
        check_map(wanted.objects[0], "Lib Cube", "Charts")


def test_base_triangles_are_those_before_modifiers() -> None:
    obj = add("Folded", folded())
    obj.modifiers.new("Subdivision", "SUBSURF")
    base = base_triangles(bpy.context, obj)
    assert base.vertices.shape == (8, 3) and base.polygons.tolist() == [0, 0, 1, 1]
    assert np.array_equal(np.unique(base.loops), np.arange(8, dtype=np.int64))
    vertex_of_loop = np.array([loop.vertex_index for loop in obj.data.loops])
    np.testing.assert_array_equal(vertex_of_loop[base.loops], base.triangles)


def charted(obj: Any, offset: float) -> tuple[Any, Any]:
    base = base_triangles(bpy.context, obj)
    return (base.vertices[base.triangles][..., :2] * 0.1 + offset).astype(np.float32), base.loops


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_a_written_uv_map_comes_back_and_leaves_the_others(mode: str) -> None:
    obj = add("Folded", folded())
    bpy.context.view_layer.objects.active = obj
    obj.select_set(True)
    original = take("Folded").targets[0].mesh.uv
    bpy.ops.object.mode_set(mode=mode)
    for offset in (0.0, 0.5):
        uv, loops = charted(obj, offset)
        write_uv(bpy.context, obj, "Charts", uv, loops)
        np.testing.assert_array_equal(take("Folded", uv="Charts").targets[0].mesh.uv, uv)
    assert obj.mode == mode
    assert [layer.name for layer in obj.data.uv_layers] == ["Map", "Charts"]
    assert obj.data.uv_layers.active.name == "Map"
    assert obj.data.uv_layers["Map"].active_render
    np.testing.assert_array_equal(take("Folded", uv="Map").targets[0].mesh.uv, original)


def test_the_first_uv_map_of_a_mesh() -> None:
    obj = add("Bare", folded(uv=False))
    uv, loops = charted(obj, 0.0)
    write_uv(bpy.context, obj, "Charts", uv, loops)
    np.testing.assert_array_equal(take("Bare").targets[0].mesh.uv, uv)
