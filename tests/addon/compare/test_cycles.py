"""Cycles' side of a comparison: exact answers where geometry gives them, and nothing of the artist's left changed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.addon.compare import cycles as module  # noqa: E402
from occlusion_bake.addon.compare.cycles import CyclesBake, CyclesSettings, bake_ao  # noqa: E402
from occlusion_bake.core.base.errors import InputError  # noqa: E402
from occlusion_bake.core.scene.scene import Scene  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402

pytestmark = pytest.mark.usefixtures("empty_scene")


def bake(name: str = "Plane", *, uv: str | None = None, **options: Any) -> CyclesBake:
    settings = {"size": (16, 16), "samples": 16, "distance": None, "threads": 2, "seed": 0, **options}
    return bake_ao(bpy.context, bpy.data.objects[name], CyclesSettings(**settings), uv)


def read(name: str) -> Scene:
    return blender.read([name])[0]


def plane(name: str = "Plane", size: float = 2.0, z: float = 0.0) -> Any:
    bpy.ops.mesh.primitive_plane_add(size=size, location=(0, 0, z))
    bpy.context.object.name = name
    return bpy.context.object


def half(obj: Any) -> None:
    """Squeeze the plane's UVs into the lower half of the picture."""
    uv = blender.uv_of(obj.data) * np.array([1.0, 0.5], np.float32)
    obj.data.uv_layers.active.uv.foreach_set("vector", uv.ravel())


def test_an_open_plane_is_open_and_wholly_covered() -> None:
    plane()
    result = bake(size=(16, 8))
    assert result.values.shape == result.coverage.shape == (8, 16)
    assert result.values.dtype == np.float32 and result.coverage.dtype == np.bool_
    assert result.coverage.all() and (result.values == 1.0).all()
    assert result.seconds > 0.0


def test_coverage_is_the_lower_half_where_the_uvs_are() -> None:
    half(plane())
    result = bake()
    assert result.coverage[8:].all() and not result.coverage[:8].any()
    assert (result.values[:8] == 0.0).all() and (result.values[8:] == 1.0).all()


def test_an_infinite_ceiling_hides_a_cone_of_the_distance() -> None:
    plane()
    plane("Ceiling", size=2000.0, z=1.0)
    assert bake().values.max() == 0.0
    assert bake(distance=0.5).values.min() == 1.0
    limited = bake(distance=2.0, samples=256, size=(8, 8)).values
    assert limited.mean() == pytest.approx(0.25, abs=0.01)  # closed where cos θ > h / D: 1 - (1 - (h / D)²)


def test_no_limit_reaches_beyond_blenders_default_of_ten() -> None:
    plane()
    plane("Ceiling", size=1e6, z=500.0)
    assert bake().values.max() < 0.1


def test_more_samples_are_taken_to_the_last() -> None:
    plane()
    bpy.ops.mesh.primitive_cube_add(location=(0, 0, 1.2))
    levels = bake(samples=96).values * 96
    np.testing.assert_allclose(levels, np.round(levels), atol=1e-3)
    assert np.any(np.round(levels) % 6 != 0)  # adaptive sampling would have stopped at 80 or before


def test_the_same_seed_gives_the_same_bits_and_another_does_not() -> None:
    plane()
    bpy.ops.mesh.primitive_cube_add(location=(0, 0, 1.2))
    first, again, other = bake(seed=3), bake(seed=3, threads=1), bake(seed=4)
    np.testing.assert_array_equal(first.values, again.values)
    assert not np.array_equal(first.values, other.values)


def test_a_smooth_low_poly_surface_is_not_lifted_off_itself() -> None:
    bpy.ops.mesh.primitive_cube_add()
    bpy.ops.object.shade_smooth()
    result = bake("Cube", size=(64, 64), samples=64)
    assert result.values[result.coverage].mean() == pytest.approx(0.897, abs=0.01)


def material(name: str, alpha: float = 1.0) -> Any:
    made = blender.material(name)
    blender.principled(made).inputs["Alpha"].default_value = alpha
    return made


def test_alpha_in_a_material_counts() -> None:
    plane().data.materials.append(material("Glassy", 0.3))
    assert bake().values.mean() == pytest.approx(0.3, abs=0.01)


def test_the_uv_map_asked_for() -> None:
    obj = plane()
    obj.data.uv_layers.new(name="Half")
    obj.data.uv_layers.active = obj.data.uv_layers["Half"]
    half(obj)
    obj.data.uv_layers.active = obj.data.uv_layers["UVMap"]
    assert bake().coverage.all()
    assert bake(uv="Half").coverage.sum() == 128
    obj.data.uv_layers.active = obj.data.uv_layers["Half"]
    assert bake().coverage.sum() == 128
    assert bake(uv="UVMap").coverage.all()


def slots_case(kind: str) -> Any:
    obj = plane()
    shared = material("Shared")
    if kind == "none":
        obj.data.polygons[0].material_index = 2  # as its nodes, or an object's own slots, had it
        return obj
    if kind == "nodeless":
        bare = bpy.data.materials.new("Bare")
        if bpy.app.version < (5, 0):
            bare.use_nodes = False
        obj.data.materials.append(bare)
    if kind == "empty slot":
        obj.data.materials.append(None)
    if kind in ("several", "shared mesh"):
        for entry in (shared, None, shared, material("Other")):
            obj.data.materials.append(entry)
        obj.material_slots[3].link = "OBJECT"
        obj.material_slots[3].material = material("On the Object")
        obj.data.polygons[0].material_index = 3
    if kind == "shared mesh":
        bpy.context.scene.collection.objects.link(bpy.data.objects.new("Twin", obj.data))
        bpy.data.objects["Twin"].location.z = 500.0
    return obj


def plain(value: Any) -> Any:
    return value.name if isinstance(value, bpy.types.ID) else value


def values_of(owner: Any) -> dict[str, Any]:
    properties = (p for p in owner.bl_rna.properties if p.type in {"BOOLEAN", "INT", "FLOAT", "STRING", "ENUM"})
    return {p.identifier: getattr(owner, p.identifier) for p in properties if not getattr(p, "is_array", False)}


def state() -> dict[str, Any]:
    context, scene = bpy.context, bpy.context.scene
    return {
        "data": {kind: [(item.name, item.users) for item in getattr(bpy.data, kind)] for kind in
                 ("objects", "meshes", "images", "materials", "worlds", "scenes", "node_groups")},
        "render": values_of(scene.render), "bake": values_of(scene.render.bake), "cycles": values_of(scene.cycles),
        "world": plain(scene.world),
        "slots": [[(slot.link, plain(slot.material)) for slot in obj.material_slots] for obj in bpy.data.objects],
        "materials": [[plain(entry) for entry in mesh.materials] for mesh in bpy.data.meshes],
        "nodes": [(m.name, [node.name for node in m.node_tree.nodes], plain(m.node_tree.nodes.active) and
                   m.node_tree.nodes.active.name) for m in bpy.data.materials if m.node_tree],
        "faces": [[face.material_index for face in mesh.polygons] for mesh in bpy.data.meshes],
        "offsets": [obj.shadow_terminator_geometry_offset for obj in bpy.data.objects],
        "hidden": [(obj.hide_viewport, obj.hide_select, obj.hide_get()) for obj in bpy.data.objects],
        "uv": [[(layer.name, layer.active, layer.active_render) for layer in mesh.uv_layers]
               for mesh in bpy.data.meshes],
        "mode": context.object and context.object.mode, "active": plain(context.view_layer.objects.active),
        "selected": sorted(obj.name for obj in context.view_layer.objects if obj.select_get()),
    }  # fmt: skip


@pytest.mark.parametrize("kind", ["none", "nodeless", "empty slot", "several", "shared mesh"])
def test_all_kinds_of_slots_bake_and_come_back(kind: str) -> None:
    slots_case(kind)
    before = state()
    assert (bake().values == 1.0).all()
    assert state() == before


def test_nothing_of_the_artists_changes() -> None:
    obj = slots_case("several")
    obj.data.uv_layers.new(name="Second")
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("Mine")
    scene.cycles.samples, scene.cycles.use_adaptive_sampling, scene.cycles.seed = 7, True, 9
    scene.render.threads_mode = "AUTO"
    obj.shadow_terminator_geometry_offset = 0.2
    obj.hide_select = True
    other = plane("Other", z=-50.0)
    before = state()
    heard: list[str] = []
    bpy.app.handlers.object_bake_pre.append(lambda *_: heard.append("pre"))
    assert (bake(uv="Second").values == 1.0).all()
    assert state() == before and not heard
    assert bpy.context.view_layer.objects.active == other
    assert scene.world.light_settings.distance == bpy.data.worlds.new("Fresh").light_settings.distance


@pytest.mark.parametrize("hide", ["hide_viewport", "hide_select", "eye"])
def test_an_object_hidden_in_the_viewport_bakes(hide: str) -> None:
    obj = plane()
    if hide == "eye":
        obj.hide_set(True)
    else:
        setattr(obj, hide, True)
    before = state()
    assert (bake().values == 1.0).all()
    assert state() == before


def test_from_edit_mode_and_back() -> None:
    obj = plane()
    bpy.ops.object.mode_set(mode="EDIT")
    before = state()
    assert (bake().values == 1.0).all()
    assert state() == before and obj.mode == "EDIT"


def failing_cases() -> list[Any]:
    return [
        ("Elsewhere", {}, r"^Elsewhere: no such mesh object in the view layer; .+$"),
        ("Plane", {"uv": "Third"}, r"^Plane: Cycles bakes onto .+ none named Third; .+$"),
        ("Hidden", {}, r"^Hidden: Cycles cannot bake it: .+$"),
        ("Bare", {}, r"^Bare: Cycles cannot bake it: .+$"),
    ]


@pytest.mark.parametrize(("name", "options", "cause"), failing_cases())
def test_a_refusal_is_one_line_and_all_comes_back(name: str, options: dict[str, Any], cause: str) -> None:
    bare = plane("Bare")
    bare.data.uv_layers.remove(bare.data.uv_layers[0])
    plane("Hidden").hide_render = True
    bpy.data.objects.new("Elsewhere", bare.data)  # in no scene
    slots_case("several")
    before = state()
    with pytest.raises(InputError, match=cause) as caught:
        bake(name, **options)
    assert "\n" not in str(caught.value)
    assert state() == before


def test_a_fault_of_ours_leaves_nothing_behind(monkeypatch: pytest.MonkeyPatch) -> None:
    slots_case("several")
    before = state()

    def broken(_: Any) -> Any:
        raise ArithmeticError("on purpose")

    monkeypatch.setattr(module, "_pixels", broken)
    with pytest.raises(ArithmeticError):
        bake()
    assert state() == before


def linked(tmp_path: Path, kind: str) -> Any:
    """The plane of `slots_case`, linked from a library."""
    slots_case(kind)
    library = str(tmp_path / "library.blend")
    bpy.data.libraries.write(library, {bpy.data.objects["Plane"]})
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(library, link=True) as (_, wanted):
        wanted.objects = ["Plane"]
    return wanted.objects[0]


def show(obj: Any) -> None:
    bpy.context.scene.collection.objects.link(obj)
    _ = bpy.context.view_layer.objects.active


@pytest.mark.parametrize("kind", ["none", "empty slot", "several"])
def test_a_linked_mesh_and_its_materials_bake_and_come_back(tmp_path: Path, kind: str) -> None:
    mesh = linked(tmp_path, kind).data
    obj = bpy.data.objects.new("Here", mesh)
    show(obj)
    before = state()
    assert (bake("Here").values == 1.0).all()
    assert state() == before and obj.data.library is not None


def test_linked_materials_on_a_local_mesh(tmp_path: Path) -> None:
    materials = list(linked(tmp_path, "several").data.materials)
    obj = plane("Here")
    for entry in materials:
        obj.data.materials.append(entry)
    before = state()
    assert (bake("Here").values == 1.0).all()
    assert state() == before and obj.data.materials[0].library is not None


def test_a_linked_object_is_refused(tmp_path: Path) -> None:
    show(linked(tmp_path, "several"))
    before = state()
    with pytest.raises(InputError, match=r"^Plane: Cycles bakes no object linked from a library; make it local first$"):
        bake()
    assert state() == before


def above(data: Any, **flags: Any) -> None:
    obj = bpy.data.objects.new("Ceiling", data)
    obj.location.z = 1.0
    for name, value in flags.items():
        setattr(obj, name, value)
    show(obj)


def instanced(data: Any, parent: dict[str, Any], child: dict[str, Any]) -> None:
    inside = bpy.data.objects.new("Inside", data)
    library = bpy.data.collections.new("Library")
    library.objects.link(inside)
    outer = bpy.data.objects.new("Outer", None)
    outer.location.z, outer.instance_type, outer.instance_collection = 1.0, "COLLECTION", library
    for obj, flags in ((outer, parent), (inside, child)):
        for name, value in flags.items():
            setattr(obj, name, value)
    show(outer)


def collected(data: Any, flag: str) -> None:
    collection = bpy.data.collections.new("Sub")
    bpy.context.scene.collection.children.link(collection)
    inside = bpy.data.objects.new("Inside", data)
    inside.location.z = 1.0
    collection.objects.link(inside)
    layer = bpy.context.view_layer.layer_collection.children["Sub"]
    setattr(collection if hasattr(collection, flag) else layer, flag, True)


OCCLUDING = {
    "plain": lambda data: above(data),
    "hidden from render": lambda data: above(data, hide_render=True),
    "no shadow": lambda data: above(data, visible_shadow=False),
    "no camera ray": lambda data: above(data, visible_camera=False),
    "hidden in the viewport": lambda data: above(data, hide_viewport=True),
    "holdout": lambda data: above(data, is_holdout=True),
    "shadow catcher": lambda data: above(data, is_shadow_catcher=True),
    "mirrored": lambda data: above(data, scale=(-1, 1, 1)),
    "instance": lambda data: instanced(data, {}, {}),
    "instance, parent no shadow": lambda data: instanced(data, {"visible_shadow": False}, {}),
    "instance, child no shadow": lambda data: instanced(data, {}, {"visible_shadow": False}),
    "instance, parent hidden": lambda data: instanced(data, {"hide_render": True}, {}),
    "instance, child hidden": lambda data: instanced(data, {}, {"hide_render": True}),
    **{flag: lambda data, flag=flag: collected(data, flag)
       for flag in ("hide_render", "hide_viewport", "exclude", "holdout", "indirect_only")},
}  # fmt: skip


@pytest.mark.parametrize("kind", OCCLUDING)
def test_what_occludes_for_cycles_is_what_extract_finds(kind: str) -> None:
    plane()
    data = plane("Source", size=2000.0).data
    bpy.data.objects.remove(bpy.data.objects["Source"])
    OCCLUDING[kind](data)
    scene = read("Plane")
    value = bake(size=(4, 4)).values.mean()
    assert value in (0.0, 1.0)
    assert len(scene.occluders) == (2 if value == 0.0 else 1)


def bent(smooth: tuple[bool, bool], custom: bool) -> Any:
    """Two quads bent along their diagonals: a normal a triangle or one a quad makes a difference."""
    mesh = bpy.data.meshes.new("Bent")
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0.5), (0, 1, 0), (3, 0, 0), (4, 0, 0), (4, 1, 0.2), (3, 1, 0)]
    mesh.from_pydata(corners, [], [(0, 1, 2, 3), (4, 5, 6, 7)])
    mesh.polygons.foreach_set("use_smooth", smooth)
    layout = [(0, 0), (0.5, 0), (0.5, 1), (0, 1), (0.5, 0), (1, 0), (1, 1), (0.5, 1)]
    mesh.uv_layers.new(name="Map").uv.foreach_set("vector", np.array(layout, np.float32).reshape(-1))
    if custom:
        mesh.normals_split_custom_set([(0, 0.6, 0.8)] * 8)
    mesh.update()
    return mesh


@pytest.mark.parametrize("custom", [False, True])
@pytest.mark.parametrize("smooth", [(False, False), (False, True), (True, True)])
def test_normals_are_those_that_cycles_shades_with(
    monkeypatch: pytest.MonkeyPatch, smooth: tuple[bool, bool], custom: bool
) -> None:
    show(bpy.data.objects.new("Bent", bent(smooth, custom)))
    mesh = read("Bent").targets[0].mesh
    monkeypatch.setattr(module, "run_bake", bake_normals)
    monkeypatch.setattr(module, "_pixels", all_channels)
    shaded = bake("Bent", size=(64, 64), samples=1).values
    assert mesh.uv is not None
    a, b, c = (mesh.vertices[mesh.triangles[:, corner]] for corner in range(3))
    flat = np.repeat(np.cross(b - a, c - a)[:, np.newaxis], 3, axis=1)
    ours = (flat if mesh.normals is None else mesh.normals).mean(axis=1)
    ours /= np.linalg.norm(ours, axis=1, keepdims=True)
    for normal, (u, v) in zip(ours, mesh.uv.mean(axis=1), strict=True):
        texel = shaded[63 - int(v * 64), int(u * 64)] * 2.0 - 1.0
        np.testing.assert_allclose(texel, normal, atol=0.02)


def bake_normals(*_: Any, **__: Any) -> float:
    bpy.ops.object.bake(
        type="NORMAL", normal_space="OBJECT", target="IMAGE_TEXTURES", save_mode="INTERNAL", margin=0, use_clear=False
    )
    return 0.0


def all_channels(image: Any) -> Any:
    pixels = np.empty((64, 64, 4), np.float32)
    image.pixels.foreach_get(pixels.reshape(-1))
    return pixels[::-1, :, :3]
