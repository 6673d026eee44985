"""Normal maps of materials: AO about the normals that Cycles' bake takes, and one line on what is not read."""

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
LEANING = np.array((0.6, 0.0, 0.8))


def waves(size: int = 64) -> Any:
    """(h, w, 3): normals of a surface with waves along u and v, as colours."""
    v, u = (np.indices((size, size), dtype=np.int64) + 0.5) / size
    normals = np.stack([0.6 * np.sin(6 * np.pi * u), 0.5 * np.cos(4 * np.pi * v), np.ones_like(u)], axis=2)
    return 0.5 + 0.5 * normals / np.linalg.norm(normals, axis=2, keepdims=True)


def image(colours: Any, space: str = "Non-Color") -> Any:
    made = bpy.data.images.new("Normals", colours.shape[1], colours.shape[0])
    made.colorspace_settings.name = space
    pixels = np.ones((*colours.shape[:2], 4), dtype=np.float32)
    pixels[..., :3] = colours[::-1]
    made.pixels.foreach_set(pixels.ravel())
    made.pack()
    return made


class Paint:
    """A material with a normal map. values: colours of an image, or one colour."""

    def __init__(self, values: Any, *, strength: float = 1.0, uv: str = "", space: str = "Non-Color") -> None:
        self.material = bpy.data.materials.new("Paint")
        if bpy.app.version < (5, 0):
            self.material.use_nodes = True
        self.tree = self.material.node_tree
        self.surface = next(node for node in self.tree.nodes if node.type == "BSDF_PRINCIPLED")
        self.map = self.tree.nodes.new("ShaderNodeNormalMap")
        self.map.inputs["Strength"].default_value, self.map.uv_map = strength, uv
        self.tree.links.new(self.map.outputs[0], self.surface.inputs["Normal"])
        if np.ndim(values) == 1:
            self.map.inputs["Color"].default_value = (*(0.5 + 0.5 * np.asarray(values)), 1.0)
            return
        self.texture = self.tree.nodes.new("ShaderNodeTexImage")
        self.texture.image = image(values, space)
        self.tree.links.new(self.texture.outputs["Color"], self.map.inputs["Color"])

    def line(self) -> str:
        """Why the map is not read."""
        with pytest.raises(Unreadable) as unread:
            material_normal_map(self.material, ImagePixels())
        return unread.value.in_words("normal")


def sphere() -> Any:
    """Smooth, with UVs, a second map of which is turned and larger; in a corner that shades it."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=24, ring_count=12)
    obj = bpy.context.object
    obj.name = "Ball"
    obj.data.shade_smooth()
    uv = blender.uv_of(obj.data)
    second = obj.data.uv_layers.new(name="Second")
    second.uv.foreach_set("vector", (uv @ np.float32([[0, 2], [-2, 0]])).ravel())
    obj.data.uv_layers.active = obj.data.uv_layers[0]
    obj.data.uv_layers[0].active_render = True
    return obj


def compared(bake: Any, *words: str) -> Any:
    run = bake("--objects", "Ball", "--compare-cycles", "256", "--size", "64", "--margin", "0", *words,
               effort=("--rays", "256"))  # fmt: skip
    assert run.status == 0, run.err
    (entry,) = run.report["objects"]
    return entry


@pytest.mark.parametrize(
    "paint",
    [
        {},
        {"strength": 2.0, "uv": "Second"},
        {"space": "sRGB"},
    ],
)
def test_ao_is_as_cycles_bakes_it(paint: Any, bake: Any) -> None:
    obj = sphere()
    floor = blender.plane("Floor", location=(0.0, 0.0, -1.05))
    floor.scale = (4.0, 4.0, 1.0)
    coat = Paint(waves(), **paint)
    if paint.get("uv"):
        place = coat.tree.nodes.new("ShaderNodeUVMap")
        place.uv_map = "Second"
        coat.tree.links.new(place.outputs[0], coat.texture.inputs["Vector"])
    obj.data.materials.append(coat.material)
    entry = compared(bake, "--normal-maps")
    assert abs(entry["cycles"]["bias"]) < 1e-3 and entry["cycles"]["rmse"] < 0.015
    assert not any(reason.startswith("Normals: ") for reason in entry["cycles"]["reasons"])


def test_without_them_the_comparison_says_why_it_differs(bake: Any) -> None:
    sphere().data.materials.append(Paint(waves()).material)
    entry = compared(bake)
    assert any(reason.startswith("Normals: Cycles follows") for reason in entry["cycles"]["reasons"])
    assert entry["cycles"]["rmse"] > 0.04 and entry["mean"]["ao"] > entry["cycles"]["rmse"]


def test_it_is_read_through_groups_and_mixes() -> None:
    """Of several shaders those without normals, as a transparent one, do not count."""
    coat = Paint(LEANING)
    mix, clear = (coat.tree.nodes.new(f"Shader{kind}") for kind in ("NodeMixShader", "NodeBsdfTransparent"))
    end = coat.tree.get_output_node("CYCLES")
    coat.tree.links.new(clear.outputs[0], mix.inputs[1])
    coat.tree.links.new(coat.surface.outputs[0], mix.inputs[2])
    coat.tree.links.new(mix.outputs[0], end.inputs["Surface"])
    found = material_normal_map(coat.material, ImagePixels())
    assert found is not None and found.lookup is None
    np.testing.assert_allclose(found.texture.values, [[[0.8, 0.5, 0.9]]], atol=1e-6)
    coat.tree.links.new(coat.tree.nodes.new("ShaderNodeBsdfDiffuse").outputs[0], mix.inputs[1])
    assert "not the same in all of its shaders" in coat.line()


def test_what_is_not_read_is_said() -> None:
    bumped = Paint(LEANING)
    bumped.tree.links.new(bumped.tree.nodes.new("ShaderNodeBump").outputs[0], bumped.surface.inputs["Normal"])
    assert bumped.line() == "what reaches its normal is a node Bump, which is not read"
    world = Paint(LEANING)
    world.map.space = "WORLD"
    assert "a node Normal Map of World" in world.line()
    linked = Paint(LEANING)
    linked.tree.links.new(linked.tree.nodes.new("ShaderNodeValue").outputs[0], linked.map.inputs["Strength"])
    assert "strength is linked" in linked.line()
    assert material_normal_map(Paint((0.0, 0.0, 1.0)).material, ImagePixels()) is None


def test_directx_green_points_down() -> None:
    coat = Paint((0.0, 0.6, 0.8))
    if not hasattr(coat.map, "convention"):
        pytest.skip("this Blender's Normal Map node has no convention")
    coat.map.convention = "DIRECTX"
    found = material_normal_map(coat.material, ImagePixels())
    assert found is not None
    np.testing.assert_allclose(found.texture.values, [[[0.5, 0.2, 0.9]]], atol=1e-6)


def read(*names: str) -> tuple[Any, list[str]]:
    scene, lines = blender.read(names, normal_maps=True)
    return scene.targets[0].normal_map, lines


def test_slots_have_their_own() -> None:
    """And an object that is baked without them is not looked at."""
    cube = blender.cube("Cube")
    plain, coat = bpy.data.materials.new("Plain"), Paint(waves())
    for material in (plain, coat.material):
        cube.data.materials.append(material)
    cube.data.polygons[2].material_index = 1
    found, lines = read("Cube")
    assert lines == [] and len(found.layers) == 1
    assert (found.layer >= 0).sum() == 2 and (found.layer[4:6] == 0).all()
    scene, _ = blender.read(["Cube"])
    assert scene.targets[0].normal_map is None


def test_a_material_that_stands_for_all_counts_without_slots() -> None:
    blender.cube("Cube")
    bpy.context.view_layer.material_override = Paint(waves()).material
    found, lines = read("Cube")
    assert lines == [] and (found.layer == 0).all()


def test_tangents_that_do_not_exist(bake: Any) -> None:
    cube = blender.cube("Cube")
    cube.data.materials.append(Paint(waves(), uv="Elsewhere").material)
    found, lines = read("Cube")
    assert found is None and lines[0].startswith("Cube: it has no UV map Elsewhere")
    ring = np.linspace(0, 2 * np.pi, 6)[:-1]
    corners = np.stack([np.cos(ring), np.sin(ring), 0 * ring], axis=1)
    fan = blender.mesh("Pentagon", corners.tolist(), [range(5)], 0.5 + 0.4 * corners[:, :2])
    fan.data.materials.append(Paint(waves()).material)
    with pytest.raises(InputError, match=r"Pentagon: it has faces of more than four corners.*without normal maps"):
        read("Pentagon")
    run = bake("--objects", "Pentagon", "--normal-maps")
    assert run.status == 2 and "Pentagon: it has faces" in run.err
