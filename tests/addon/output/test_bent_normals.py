"""Bent normals from Blender: MikkTSpace as Blender makes it, proved by Cycles' own reading of the texture."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.core.finish.image_file import read_image  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402
from occlusion_bake.tests.oracles.blender import bake_onto, pixels, set_panel  # noqa: E402

SIZE = 64
PANEL = {"width": SIZE, "height": SIZE, "margin": 8, "quality": "RAYS", "rays": 64, "use_ao": True}
pytestmark = pytest.mark.usefixtures("empty_scene")


@pytest.fixture
def cup(registered: None) -> Any:
    """A smooth, turned, unwrapped ring with a wall of its own to bend away from: tangents that vary, seams, mirrored
    charts."""
    bpy.ops.mesh.primitive_torus_add(major_segments=24, minor_segments=12, rotation=(0.5, -0.3, 1.1))
    obj = bpy.context.object
    obj.name = "Cup"
    for polygon in obj.data.polygons:
        polygon.use_smooth = True
    layer = obj.data.uv_layers.active.uv
    uv = np.empty((len(layer), 2), dtype=np.float32)
    layer.foreach_get("vector", uv.reshape(-1))
    half = np.repeat(
        np.arange(len(obj.data.polygons), dtype=np.int64) % 2 == 0, 4
    )  # every other face is a chart of its own, mirrored
    uv[half] = (1.0 - uv[half][:, :1]) * [1, 0] + uv[half][:, 1:] * [0, 1]
    layer.foreach_set("vector", (0.5 * uv + np.where(half, 0.0, 0.5)[:, None]).reshape(-1))
    return obj


def bake_normals_with_cycles(obj: Any, image: Any) -> np.ndarray:
    """What Cycles takes for the object-space normal where the material reads the image as a tangent-space map."""
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.samples, scene.cycles.device = "CYCLES", 1, "CPU"
    scene.render.bake.margin = 0
    material = bpy.data.materials.new("Bent")
    material.use_nodes = True
    obj.data.materials.clear()
    obj.data.materials.append(material)
    tree = material.node_tree
    read, normal = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeNormalMap")
    read.image, read.interpolation = image, "Closest"
    surface = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    tree.links.new(read.outputs["Color"], normal.inputs["Color"])
    tree.links.new(normal.outputs["Normal"], surface.inputs["Normal"])
    onto = tree.nodes.new("ShaderNodeTexImage")
    onto.image = bpy.data.images.new("Cycles Normals", SIZE, SIZE, float_buffer=True, is_data=True)
    tree.nodes.active = onto
    bpy.ops.object.bake(type="NORMAL", normal_space="OBJECT", margin=0, use_clear=True)
    return pixels("Cycles Normals")


def test_cycles_reads_the_tangent_space_map_as_the_object_space_one(cup: Any) -> None:
    """The same directions told in two ways; through Cycles' normal map node the one becomes the other."""
    found = {}
    for space in ("OBJECT", "TANGENT"):
        set_panel(**PANEL, use_bent=True, bent_space=space)
        assert bake_onto("Cup") == {"FINISHED"}
        found[space] = pixels("Cup Bent")[..., :3]
    seen = bake_normals_with_cycles(cup, bpy.data.images["Cup Bent"])
    covered = np.any(seen[..., :3] != 0.0, axis=2)
    assert 0.2 < covered.mean() < 0.6
    ours, cycles = (2.0 * each[covered][:, :3] - 1.0 for each in (found["OBJECT"], seen))
    cosines = np.sum(ours * cycles, axis=1) / np.linalg.norm(ours, axis=1) / np.linalg.norm(cycles, axis=1)
    assert np.quantile(cosines, 0.05) > np.cos(np.radians(4.0))  # the texel's middle and its footprint's differ
    assert np.median(cosines) > np.cos(np.radians(2.0))
    assert np.mean(found["TANGENT"][covered][:, 2]) > 0.8  # and is no object-space map itself


def test_panel_and_command_write_the_same(cup: Any, tmp_path: Path) -> None:
    set_panel(
        **PANEL, use_bent=True, bent_y="DOWN", bent_alpha=True, output="SAVED", path=str(tmp_path / "{object}_{map}"),
        format="PNG", depth="16",
    )  # fmt: skip
    assert bake_onto("Cup") == {"FINISHED"}
    values, told = read_image(tmp_path / "Cup_bent.png")
    assert values.shape == (SIZE, SIZE, 4)
    assert (told["map"], told["space"], told["green"]) == ("bent normal", "tangent", "down")
    ao, _ = read_image(tmp_path / "Cup_ao.png")
    np.testing.assert_allclose(values[..., 3], ao[..., 0], atol=1e-4)
    set_panel(bent_y="UP")
    bake_onto("Cup")
    up, _ = read_image(tmp_path / "Cup_bent.png")
    np.testing.assert_allclose(up[..., 1], 1.0 - values[..., 1], atol=2e-4)


def test_faces_without_tangents_are_refused_in_a_line(registered: None) -> None:
    ring = np.linspace(0, 2 * np.pi, 7)[:-1]
    corners = np.stack([np.cos(ring), np.sin(ring), 0 * ring], axis=1)
    blender.mesh("Hexagon", corners.tolist(), [range(6)], 0.5 + 0.4 * corners[:, :2])
    set_panel(**PANEL, use_bent=True, bent_space="TANGENT", output="PACKED")
    with pytest.raises(RuntimeError, match="Hexagon: it has faces of more than four corners"):
        bake_onto("Hexagon")
    set_panel(bent_space="OBJECT")
    assert bake_onto("Hexagon") == {"FINISHED"}
    np.testing.assert_allclose(pixels("Hexagon Bent")[SIZE // 2, SIZE // 2, :3], (0.5, 0.5, 1.0), atol=0.02)


def test_tiles_of_a_layout_have_every_map(registered: None) -> None:
    """A code as its pictures, as where there is one tile."""
    square = np.array([(0.1, 0.1), (0.9, 0.1), (0.9, 0.9), (0.1, 0.9)])
    corners = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], dtype=float)
    vertices = np.concatenate([corners, np.add(corners, (4, 0, 0))]).tolist()
    blender.mesh("Strip", vertices, (range(4), range(4, 8)), np.concatenate([square, np.add(square, (1, 0))]))
    set_panel(**PANEL, use_bent=True, bent_space="TANGENT", use_code=True, code="SH", code_degree=3, output="PACKED")
    assert bake_onto("Strip") == {"FINISHED"}
    names = ["Strip AO", "Strip Bent", *(f"Strip SH 3 {number}" for number in range(4))]
    for name in names:
        image = bpy.data.images[name]
        assert image.source == "TILED" and tuple(image.size) == (SIZE, SIZE)
        assert [tile.number for tile in image.tiles] == [1001, 1002]
