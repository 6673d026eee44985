"""Displacement of materials: places that are known exactly, AO as Cycles bakes it, and a line where it is not read."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.addon.materials.image_pixels import ImagePixels, Unreadable  # noqa: E402
from occlusion_bake.addon.materials.normal_maps import material_normal_map  # noqa: E402
from occlusion_bake.core.base.errors import InputError  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402

pytestmark = pytest.mark.usefixtures("empty_scene")
TURNED = (0.3, -0.2, 1.0)


class Mover:
    """A material that displaces by a constant, along object space."""

    def __init__(self, height: float = 0.3, *, kind: str = "Displacement", method: str = "DISPLACEMENT") -> None:
        self.material = blender.material("Mover")
        self.material.displacement_method = method
        self.tree = self.material.node_tree
        self.node = self.tree.nodes.new(f"ShaderNode{kind}")
        self.node.inputs["Midlevel"].default_value, self.node.inputs["Scale"].default_value = 0.0, 1.0
        self.node.inputs[0].default_value = height if kind == "Displacement" else (0.1, 0.2, height, 0.0)
        self.tree.links.new(self.node.outputs[0], self.tree.get_output_node("CYCLES").inputs["Displacement"])

    def by(self, kind: str, output: str | int, coordinates: str = "", **inputs: Any) -> Any:
        """Let a node's output give the height."""
        node = self.tree.nodes.new(f"ShaderNode{kind}")
        for name, value in inputs.items():
            node.inputs[name].default_value = value
        if coordinates:
            self.tree.links.new(self.tree.nodes.new("ShaderNodeTexCoord").outputs[coordinates], node.inputs["Vector"])
        self.tree.links.new(node.outputs[output], self.node.inputs[0])
        return node


def grid(name: str = "Terrain", cells: int = 12, size: float = 2.0) -> Any:
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=cells, y_subdivisions=cells, size=size, calc_uvs=True)
    obj = bpy.context.object
    obj.name = name
    obj.data.shade_smooth()
    return obj


def world(obj: Any, **request: Any) -> tuple[Any, Any]:
    """Where the vertices of an object are in the world, and its instance."""
    scene, lines = blender.read([obj.name], **request)
    assert lines == []
    (target,) = scene.targets
    return target.mesh.vertices @ target.matrix[:3, :3].T + target.matrix[:3, 3], target


@pytest.mark.parametrize("scale", [(1.0, 1.0, 1.0), (-2.0, 0.5, 3.0)])
@pytest.mark.parametrize("space", ["OBJECT", "WORLD"])
def test_a_constant_moves_a_plane_along_its_normal(space: str, scale: Any) -> None:
    obj, mover = grid(), Mover(0.3)
    obj.location, obj.rotation_euler, obj.scale = (5.0, -3.0, 2.0), TURNED, scale
    before, _ = world(obj)
    mover.node.space = space
    obj.data.materials.append(mover.material)
    after, target = world(obj)
    along = np.array(obj.matrix_world)[:3, 2]
    length = 1.0 if space == "OBJECT" else np.linalg.norm(along)
    np.testing.assert_allclose(after, before + 0.3 * along / length, atol=4e-5)  # normals of 5.2's Cycles have 16 bits
    np.testing.assert_allclose(target.mesh.normals[..., 2], 1.0, atol=1e-4)


@pytest.mark.parametrize("size", [2.0, 2e-3, 2e3])
@pytest.mark.parametrize("stray", [False, True])
def test_each_vertex_goes_where_its_own_height_says(size: float, stray: bool) -> None:
    """By a texture that is no image, at any size, and however fine the mesh, a loose vertex a million of its sizes
    away or not: h = s u, exactly; so the normals, too."""
    obj, mover = grid(cells=40, size=size), Mover()
    obj.data.color_attributes.new("Occlusion Bake", "FLOAT_COLOR", "POINT")  # a name that we use as well
    if stray:
        obj.data.vertices.add(1)
        obj.data.vertices[-1].co = (1e6 * size, 0.0, 0.0)
    split = mover.by("SeparateXYZ", "X")
    mover.tree.links.new(mover.tree.nodes.new("ShaderNodeTexCoord").outputs["UV"], split.inputs[0])
    mover.node.inputs["Scale"].default_value = size
    obj.data.materials.append(mover.material)
    after, target = world(obj)
    start = np.array([vertex.co for vertex in obj.data.vertices]) / size
    start[:, 2] = start[:, 0] + 0.5
    np.testing.assert_allclose(after[:1681] / size, start[:1681], atol=3e-5)  # as above
    assert np.abs(target.mesh.normals - np.array((-1.0, 0.0, 1.0)) / 2.0**0.5).max() < 2e-4


def test_vectors_and_slots() -> None:
    """A vertex moves where any of its faces does; what has no such material stays."""
    obj = grid(cells=2)
    for material in (blender.material("Still"), Mover(0.5, kind="VectorDisplacement").material):
        obj.data.materials.append(material)
    obj.data.polygons[3].material_index = 1  # of the square between 0 and 1
    before = np.array([vertex.co for vertex in obj.data.vertices])
    after, _ = world(obj)
    moved = (before[:, 0] > -0.1) & (before[:, 1] > -0.1)
    np.testing.assert_allclose(after, before + moved[:, np.newaxis] * (0.1, 0.5, 0.2), atol=1e-5)  # y up, tangent space


def test_instances_share_one_displaced_mesh() -> None:
    mover = Mover(0.25)
    rock = grid("Rock", cells=2)
    rock.data.materials.append(mover.material)
    other = bpy.data.objects.new("Other", rock.data)
    plain = bpy.data.objects.new("Plain", rock.data)
    for obj in (other, plain):
        bpy.context.scene.collection.objects.link(obj)
    plain.material_slots[0].link, plain.material_slots[0].material = "OBJECT", blender.material("Still")
    scene, _ = blender.read(["Rock"])
    meshes = {instance.name: instance.mesh for instance in scene.occluders}
    assert meshes["Rock"] is meshes["Other"] is scene.targets[0].mesh
    np.testing.assert_allclose(meshes["Rock"].vertices[:, 2], 0.25, atol=1e-5)
    np.testing.assert_array_equal(meshes["Plain"].vertices[:, 2], 0.0)


def test_nothing_is_left_in_the_file() -> None:
    obj, mover = grid(cells=2), Mover()
    obj.data.materials.append(mover.material)
    kinds = ("meshes", "materials", "objects", "scenes", "images", "worlds")
    before = {kind: [each.name for each in getattr(bpy.data, kind)] for kind in kinds}
    blender.read(["Terrain"])
    assert before == {kind: [each.name for each in getattr(bpy.data, kind)] for kind in kinds}
    assert len(obj.data.color_attributes) == 0


def compared(bake: Any, name: str, *words: str) -> Any:
    run = bake("--objects", name, "--compare-cycles", "128", "--size", "48", "--margin", "0", *words,
               effort=("--rays", "128"))  # fmt: skip
    assert run.status == 0, run.err
    (entry,) = run.report["objects"]
    return entry


def rough_sphere() -> str:
    """By noise in object space, turned, scaled and mirrored, over a floor that moves, too."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24)
    ball, mover, floor = bpy.context.object, Mover(), grid("Floor", cells=4)
    ball.name = "Ball"
    ball.data.shade_smooth()
    ball.scale, ball.rotation_euler = (1.5, -1.0, 1.0), TURNED
    mover.by("TexNoise", 0, "Object", Scale=4.0)
    mover.node.inputs["Scale"].default_value = 0.4
    ball.data.materials.append(mover.material)
    floor.location, floor.scale = (0.0, 0.0, -2.0), (3.0, 3.0, 1.0)
    floor.data.materials.append(Mover(0.6).material)
    return "Ball"


def sharp_box() -> str:
    """Subdivided with sharp edges, where Cycles before 5.2 tears it: by generated coordinates."""
    box, mover = blender.cube("Box"), Mover()
    box.data.shade_smooth()
    for edge in box.data.edges:
        edge.use_edge_sharp = edge.index % 2 == 0
    cuts = box.modifiers.new("Cuts", "SUBSURF")
    cuts.subdivision_type, cuts.render_levels = "SIMPLE", 4
    mover.by("TexVoronoi", "Distance", Scale=3.0)
    mover.node.inputs["Scale"].default_value = 0.4
    box.data.materials.append(mover.material)
    return "Box"


def bent_terrain() -> str:
    """By waves along UVs over a shape key, on one of two slots, half of it flat."""
    obj, mover = grid(cells=48), Mover()
    obj.shape_key_add(name="Flat")
    key = obj.shape_key_add(name="Bent")
    for point in key.data:
        point.co.z = 0.4 * point.co.x**2
    key.value = 1.0
    mover.by("TexWave", 1, "Generated", Scale=1.0)
    for material in (mover.material, blender.material("Still")):
        obj.data.materials.append(material)
    for polygon in obj.data.polygons:
        polygon.material_index, polygon.use_smooth = int(polygon.center.x > 0.5), polygon.center.y > 0.0
    return "Terrain"


@pytest.mark.parametrize("build", [rough_sphere, sharp_box, bent_terrain])
def test_ao_is_as_cycles_bakes_it(build: Any, bake: Any) -> None:
    entry = compared(bake, build())
    assert abs(entry["cycles"]["bias"]) < 0.008 and entry["cycles"]["rmse"] < 0.06
    assert entry["mean"]["ao"] < 0.99
    assert not any("displac" in reason for reason in entry["cycles"]["reasons"])


def test_a_lid_that_its_material_pushes_down_closes(bake: Any) -> None:
    """As does the same lid moved: to a hundredth above the floor."""
    blender.plane("Floor")
    lid = grid("Lid", cells=4)
    lid.location.z = 1.0
    lid.data.materials.append(Mover(-0.99).material)
    displaced = compared(bake, "Floor")
    lid = bpy.data.objects["Lid"]  # of the file that was baked
    lid.data.materials.clear()
    lid.location.z = 0.01
    moved = compared(bake, "Floor")
    assert displaced["mean"]["ao"] == pytest.approx(moved["mean"]["ao"], abs=1e-3) and moved["mean"]["ao"] < 0.02
    assert abs(displaced["cycles"]["bias"]) < 6e-3  # at the edges texels are seen in part before Blender 5


def normal_line(mover: Mover) -> str:
    with pytest.raises(Unreadable) as unread:
        material_normal_map(mover.material, ImagePixels())
    return unread.value.in_words("normal")


def test_bump_is_said_not_to_be_read(bake: Any) -> None:
    """Where normal maps are asked for; and Cycles has it always."""
    assert normal_line(Mover(method="BUMP")) == "its displacement is bump, which is not read"
    assert normal_line(Mover(method="BOTH")) == "a part of its displacement is bump, which is not read"
    assert material_normal_map(Mover().material, ImagePixels()) is None
    obj = grid(cells=2)
    obj.data.materials.append(Mover(method="BUMP").material)
    after, _ = world(obj)
    assert not after[:, 2].any()
    reasons = compared(bake, "Terrain")["cycles"]["reasons"]
    assert any("its displacement is bump" in reason and "Displacement Only" in reason for reason in reasons)


def test_what_depends_on_others_is_said(bake: Any) -> None:
    obj, mover = grid(cells=2), Mover()
    mover.by("ObjectInfo", "Random")
    obj.data.materials.append(mover.material)
    _, lines = blender.read(["Terrain"])
    assert len(lines) == 1 and lines[0].startswith("Terrain: Mover displaces it by Random of a node Object Info, which")
    assert lines[0] in compared(bake, "Terrain")["cycles"]["reasons"]


def test_adaptive_subdivision_is_said_not_to_be_followed() -> None:
    obj = grid(cells=2)
    rounder = obj.modifiers.new("Rounder", "SUBSURF")
    rounder.render_levels = 2
    bpy.context.scene.render.engine = "CYCLES"
    if hasattr(rounder, "use_adaptive_subdivision"):
        rounder.use_adaptive_subdivision = True
    else:
        bpy.context.scene.cycles.feature_set, obj.cycles.use_adaptive_subdivision = "EXPERIMENTAL", True
    assert blender.read(["Terrain"])[1] == []  # nothing displaces it
    obj.data.materials.append(Mover().material)
    scene, lines = blender.read(["Terrain"])
    assert len(lines) == 1 and lines[0].startswith("Terrain: its adaptive subdivision is not followed")
    assert len(scene.targets[0].mesh.vertices) == 81


def test_without_cycles_it_is_baked_as_it_was_and_said(monkeypatch: pytest.MonkeyPatch) -> None:
    def none(*_: Any) -> Any:
        raise InputError("Terrain: its displacement by Mover cannot be read without Cycles; enable it")

    monkeypatch.setattr("occlusion_bake.addon.read.displacement.passing_scene", none)
    obj = grid(cells=2)
    obj.data.materials.append(Mover().material)
    scene, lines = blender.read(["Terrain"])
    assert not scene.targets[0].mesh.vertices[:, 2].any() and len(bpy.data.meshes) == 1
    assert len(lines) == 1 and lines[0].endswith("it is baked as if Mover did not displace it")
