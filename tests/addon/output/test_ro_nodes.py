"""RO rebuilt in a material, rendered by Cycles, against what the core rebuilds for the same views."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from mathutils import Vector  # noqa: E402
from occlusion_bake.addon.output.ro_nodes import GROUP, add_rebuild, lobe_texture  # noqa: E402
from occlusion_bake.core.base.errors import InputError  # noqa: E402
from occlusion_bake.core.finish.image_file import read_image  # noqa: E402
from occlusion_bake.core.spherical.hemisphere_cells import subcells  # noqa: E402
from occlusion_bake.core.spherical.lobe import open_horizon  # noqa: E402
from occlusion_bake.core.spherical.spherical_harmonics import fit, rebuild  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402

pytestmark = pytest.mark.usefixtures("empty_scene")
Array = np.ndarray[Any, Any]

PIXELS = 24
EYE = (0.3, -1.2, 0.9)
PLAIN, MIRRORED = ((0, 0), (1, 0), (1, 1), (0, 1)), ((1, 0), (0, 0), (0, 1), (1, 1))
TURNED = ((1, 0), (1, 1), (0, 1), (0, 0))


def code_of_a_corner() -> Array:
    """Walls on two sides, unequal, so that every turn and mirror image tells."""
    ways = subcells(16, 1)[:, 0]
    seen = (ways[:, 2] > 0.7 * ways[:, 0]) & (ways[:, 2] > 0.2 * ways[:, 1])
    return fit(seen.reshape(1, 16, 16).astype(np.float32), 3)


def images_of(code: Array) -> list[Any]:
    """Four float images of 2 x 2 texels that are all one code."""
    made = []
    for number in range(4):
        image = bpy.data.images.new(f"Code {number}", 2, 2, alpha=True, float_buffer=True, is_data=True)
        image.pixels.foreach_set(np.tile(code[0, 4 * number : 4 * number + 4], 4).astype(np.float32))
        image.pack()
        made.append(image)
    return made


def shown(obj: Any, code: Array, output: str, exponent: float) -> None:
    """Let the object shine by an output of the rebuilding node."""
    paint = bpy.data.materials.new("Paint")
    if bpy.app.version < (5, 0):
        paint.use_nodes = True
    tree = paint.node_tree
    tree.nodes.clear()
    node = add_rebuild(tree, images_of(code), obj.data.uv_layers.active.name)
    node.inputs["Exponent"].default_value = exponent
    light, end = tree.nodes.new("ShaderNodeEmission"), tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(node.outputs[output], light.inputs["Color"])
    tree.links.new(light.outputs[0], end.inputs["Surface"])
    obj.data.materials.append(paint)


def camera_at(eye: Sequence[float]) -> Any:
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.angle = 1.0
    camera.location = eye
    camera.rotation_euler = (-Vector(eye)).to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.collection.objects.link(camera)
    bpy.context.scene.camera = camera
    bpy.context.view_layer.update()
    return camera


def rendered(path: Path) -> Array:
    """(PIXELS, PIXELS) values in the middles of pixels, the top row first."""
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.device = "CYCLES", "CPU"
    scene.cycles.samples, scene.cycles.use_denoising = 1, False
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BOX", 0.01
    scene.render.resolution_x = scene.render.resolution_y = PIXELS
    scene.render.resolution_percentage = 100
    scene.view_settings.view_transform = "Raw"
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    return read_image(path)[0][..., 0]


def views_of(camera: Any) -> Array:
    """(PIXELS², 3): from what each pixel sees to the camera, in world space."""
    half = np.tan(0.5 * camera.data.angle)
    steps = ((np.arange(PIXELS, dtype=np.int64) + 0.5) / PIXELS * 2 - 1) * half
    across, up = np.meshgrid(steps, -steps)
    rays = np.stack([across, up, np.full_like(across, -1.0)], axis=-1).reshape(-1, 3)
    rays = rays @ np.array(camera.matrix_world.to_3x3()).T
    return -rays / np.linalg.norm(rays, axis=1, keepdims=True)


@pytest.fixture
def floor() -> Callable[..., Any]:
    def made(uv: Any) -> Any:
        obj = blender.plane(uv=uv)
        obj.scale = (50.0, 50.0, 1.0)
        return obj

    return made


@pytest.mark.parametrize(
    ("uv", "tangent", "bitangent"),
    [
        (PLAIN, (1, 0, 0), (0, 1, 0)),
        (MIRRORED, (-1, 0, 0), (0, 1, 0)),
        (TURNED, (0, -1, 0), (1, 0, 0)),
    ],
)
def test_it_is_what_the_core_rebuilds(
    uv: Any, tangent: Any, bitangent: Any, floor: Callable[..., Any], tmp_path: Path
) -> None:
    code, exponent = code_of_a_corner(), 12.0
    shown(floor(uv), code, "RO", exponent)
    camera = camera_at(EYE)
    found = rendered(tmp_path / "seen.exr").ravel()
    views = views_of(camera)
    on_floor = views[:, 2] > 0.05
    local = np.stack([-views @ tangent, -views @ bitangent, views[:, 2]], axis=1)[on_floor]
    expected = rebuild(np.repeat(code, len(local), axis=0), local, exponent)
    assert expected.std() > 0.08 and on_floor.mean() > 0.8
    np.testing.assert_allclose(found[on_floor], expected, atol=1e-3)


@pytest.mark.parametrize("uv", [PLAIN, MIRRORED])
def test_about_a_normal_that_is_given(uv: Any, floor: Callable[..., Any], tmp_path: Path) -> None:
    code, exponent = code_of_a_corner(), 12.0
    normal = np.array([0.48, -0.36, 0.8])
    obj = floor(uv)
    shown(obj, code, "RO", exponent)
    tree = obj.active_material.node_tree
    given = tree.nodes.new("ShaderNodeCombineXYZ")
    for socket, value in zip(given.inputs, normal, strict=True):
        socket.default_value = value
    node = next(each for each in tree.nodes if each.type == "GROUP")
    tree.links.new(given.outputs[0], node.inputs["Normal"])
    camera = camera_at(EYE)
    found = rendered(tmp_path / "seen.exr").ravel()
    views = views_of(camera)
    seen = (views[:, 2] > 0.05) & (views @ normal > 0.02)
    tangent = np.array([1.0 if uv == PLAIN else -1.0, 0.0, 0.0])
    tangent -= normal * (tangent @ normal)
    tangent /= np.linalg.norm(tangent)
    bitangent = np.cross(normal, tangent) * (1.0 if uv == PLAIN else -1.0)
    local = np.stack([-views @ tangent, -views @ bitangent, views @ normal], axis=1)[seen]
    expected = rebuild(np.repeat(code, len(local), axis=0), local, exponent)
    assert expected.std() > 0.05 and seen.mean() > 0.8
    np.testing.assert_allclose(found[seen], expected, atol=1e-3)


@pytest.mark.parametrize("output", ["Open Horizon", "RO over Horizon"])
def test_of_an_open_surface(output: str, floor: Callable[..., Any], tmp_path: Path) -> None:
    shown(floor(PLAIN), fit(np.ones((1, 8, 8), np.float32), 3), output, 40.0)
    camera = camera_at(EYE)
    found, cosines = rendered(tmp_path / "seen.exr").ravel(), views_of(camera)[:, 2]
    on_floor = cosines > 0.05
    expected = open_horizon(40.0, cosines[on_floor]) if output == "Open Horizon" else 1.0
    np.testing.assert_allclose(found[on_floor], expected, atol=2e-4)


def test_one_group_and_one_image_serve_all() -> None:
    tree = bpy.data.node_groups.new("Tree", "ShaderNodeTree")
    images = images_of(code_of_a_corner())
    first, second, other = (add_rebuild(tree, images, name) for name in ("UVMap", "UVMap", "Charts"))
    assert first.node_tree == second.node_tree != other.node_tree
    assert first.node_tree.name == GROUP and lobe_texture().users >= 1
    assert sum(image.get("occlusion_bake") == "lobe splines" for image in bpy.data.images) == 1


def test_eevee_takes_no_mip_maps_of_the_lobe() -> None:
    tree = bpy.data.node_groups.new("Tree", "ShaderNodeTree")
    group = add_rebuild(tree, images_of(code_of_a_corner()), "UVMap").node_tree
    textures = [node for node in group.nodes if node.type == "TEX_IMAGE"]
    assert len(textures) == 4 and all(node.interpolation == "Cubic" for node in textures)
    assert not lobe_texture().use_half_precision


def test_other_numbers_of_images_are_refused() -> None:
    tree = bpy.data.node_groups.new("Tree", "ShaderNodeTree")
    with pytest.raises(InputError, match="3 images"):
        add_rebuild(tree, images_of(code_of_a_corner())[:3], "UVMap")
