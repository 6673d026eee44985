"""The light of a World that gets to a surface: beside Cycles' diffuse bake by the same World, without bounces."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.core.finish.image_file import read_image  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402
from occlusion_bake.tests.oracles.blender import bake_onto, set_panel  # noqa: E402

SIZE, SAMPLES = 32, 1024
pytestmark = pytest.mark.usefixtures("empty_scene")


@pytest.fixture
def lit() -> None:
    """A floor beside a wall, under a sky that is warm on one side."""
    blender.plane("Floor")
    blender.wall()
    world = bpy.data.worlds.new("Sky")
    bpy.context.scene.world = world
    if bpy.app.version < (5, 0):
        world.use_nodes = True
    tree = world.node_tree
    place, split, ramp = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("TexCoord", "SeparateXYZ", "CombineColor"))
    tree.links.new(place.outputs["Generated"], split.inputs[0])
    ramp.inputs[2].default_value = 0.4
    lift = tree.nodes.new("ShaderNodeMath")
    lift.inputs[1].default_value = 1.0
    tree.links.new(split.outputs["X"], lift.inputs[0])
    tree.links.new(lift.outputs[0], ramp.inputs[0])
    tree.links.new(ramp.outputs[0], tree.nodes["Background"].inputs["Color"])


def diffuse_by_cycles(name: str) -> np.ndarray:
    """(H, W, 3), row 0 at the top."""
    scene, obj = bpy.context.scene, bpy.data.objects[name]
    scene.render.engine, scene.cycles.device, scene.cycles.samples = "CYCLES", "CPU", SAMPLES
    material = bpy.data.materials.new("White")
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    obj.data.materials.append(material)
    texture = material.node_tree.nodes.new("ShaderNodeTexImage")
    texture.image = bpy.data.images.new("Diffuse", SIZE, SIZE, float_buffer=True, is_data=True)
    material.node_tree.nodes.active = texture
    bpy.ops.object.select_all(action="DESELECT")
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.bake(type="DIFFUSE", pass_filter={"DIRECT"}, margin=0)
    values = np.empty((SIZE, SIZE, 4), dtype=np.float32)
    texture.image.pixels.foreach_get(values.reshape(-1))
    return values[::-1, :, :3]


def test_the_light_is_that_of_cycles_diffuse_bake(lit: None, bake: Any) -> None:
    words = ("--maps", "light", "light-share", "--format", "exr", "--depth", "32", "--margin", "0")
    run = bake("--objects", "Floor", "--size", str(SIZE), *words, effort=("--rays", "1024"))
    assert run.status == 0, run.err
    ours, told = read_image(run.folder / "Floor_light.exr")
    share, _ = read_image(run.folder / "Floor_light_ratio.exr")
    cycles = diffuse_by_cycles("Floor")
    for channel in (0, 2):  # there is no green light
        light, truth = ours[..., channel].astype(np.float64), cycles[..., channel].astype(np.float64)
        apart = light - truth
        assert abs(apart.mean()) < 4e-3 * truth.mean()
        assert np.sqrt(np.mean(apart**2)) < 0.04 * truth.mean()
        assert truth.min() < 0.9 * truth.max()  # there is something to agree on
    assert np.all(ours[..., 1] == 0.0) and told["map"] == "environment's light"
    assert 0.2 < share[..., 0].min() < 0.95 and share.max() <= 1.0


def test_without_a_world_a_line_says_so(bake: Any) -> None:
    blender.plane("Floor")
    bpy.context.scene.world = None
    bake("--maps", "light-share").refused("no World")


def test_the_panel_bakes_coloured_pictures(lit: None, registered: None) -> None:
    set_panel(width=SIZE, height=SIZE, quality="RAYS", rays=64, use_ao=False, use_light=True, light_picture="BOTH")
    assert bake_onto("Floor") == {"FINISHED"}
    names = {image.name for image in bpy.data.images}
    assert {"Floor Light", "Floor Light ratio"} <= names
