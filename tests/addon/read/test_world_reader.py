"""The World as light from far away: its image's pixels, Cycles' evaluation of all else, and nothing left changed."""

from __future__ import annotations

import json
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

bpy = pytest.importorskip("bpy")
pytest.importorskip("OpenImageIO")

from occlusion_bake.addon.read.world_bake import light_of_squares, world_scene  # noqa: E402
from occlusion_bake.addon.read.world_image import plain_image  # noqa: E402
from occlusion_bake.addon.read.world_reader import read_world  # noqa: E402
from occlusion_bake.core.base.errors import InputError  # noqa: E402
from occlusion_bake.core.finish.image_file import write_image  # noqa: E402
from occlusion_bake.core.spherical.environment import Environment  # noqa: E402
from occlusion_bake.core.spherical.equirectangular import pixel_angles  # noqa: E402
from occlusion_bake.core.spherical.octahedral_map import directions, middles, sample_weights, solid_angles  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402
from occlusion_bake.tests.oracles.light import energy  # noqa: E402

SIZE = 32
TURN = (0.4, -0.9, 2.1)


class Sky:
    """The World of the open scene, and nodes in it by their types."""

    def __init__(self) -> None:
        self.world = bpy.context.scene.world = bpy.data.worlds.new("Sky")
        if bpy.app.version < (5, 0):
            self.world.use_nodes = True
        self.tree = self.world.node_tree
        self.background = next(node for node in self.tree.nodes if node.type == "BACKGROUND")

    def add(self, kind: str, **inputs: Any) -> Any:
        node = self.tree.nodes.new(f"ShaderNode{kind}")
        for name, value in inputs.items():
            node.inputs[name].default_value = value
        return node

    def link(self, output: Any, socket: Any = None) -> None:
        self.tree.links.new(output, self.background.inputs["Color"] if socket is None else socket)

    def image(self, path: Path, *, turn: Any = None, kind: str = "POINT", strength: float = 1.0) -> Any:
        texture = self.add("TexEnvironment")
        texture.image = bpy.data.images.load(str(path))
        self.background.inputs["Strength"].default_value = strength
        self.link(texture.outputs[0])
        if turn is not None:
            mapping = self.add("Mapping", Rotation=turn)
            mapping.vector_type = kind
            self.link(self.add("TexCoord").outputs["Generated"], mapping.inputs["Vector"])
            self.link(mapping.outputs[0], texture.inputs["Vector"])
        return texture.image

    def veil(self) -> None:
        """Put a node that changes no colour before the Background, so that Cycles evaluates it all."""
        gamma = self.add("Gamma", Gamma=1.0)
        colour = self.background.inputs["Color"]
        self.link(colour.links[0].from_socket, gamma.inputs["Color"])
        self.link(gamma.outputs[0])

    def read(self, size: int = SIZE) -> Environment:
        return read_world(bpy.context.scene, size)


@pytest.fixture
def sky(empty_scene: None) -> Sky:
    return Sky()


def smooth(height: int = 256) -> Any:
    """An image with another colour in each direction, without a step at its seam."""
    polar, turn = (
        np.arange(0.5, height)[:, np.newaxis] * pi / height,
        np.arange(2 * height, dtype=np.int64) * pi / height,
    )
    ways = np.broadcast_arrays(np.cos(polar), np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn))
    return (0.5 + 0.5 * np.stack(ways, axis=-1)).astype(np.float32)


# What Cycles evaluates


def test_a_background_of_one_colour(sky: Sky) -> None:
    sky.background.inputs["Color"].default_value = (0.25, 0.5, 1.0, 1.0)
    sky.background.inputs["Strength"].default_value = 2.0
    assert_allclose(sky.read().radiance, np.broadcast_to((0.5, 1.0, 2.0), (SIZE, SIZE, 3)), rtol=1e-6)


@pytest.mark.skipif(bpy.app.version >= (5, 0), reason="Worlds always have nodes")
def test_a_world_without_nodes(sky: Sky) -> None:
    sky.world.use_nodes = False
    sky.world.color = (0.1, 0.2, 0.3)
    assert_allclose(sky.read().radiance, np.broadcast_to((0.1, 0.2, 0.3), (SIZE, SIZE, 3)), rtol=1e-6)


def test_nodes_get_the_direction_in_world_axes(sky: Sky) -> None:
    """(1 + ω) / 2 in red, green and blue."""
    shift = sky.add("VectorMath")
    shift.operation = "MULTIPLY_ADD"
    shift.inputs[1].default_value = shift.inputs[2].default_value = (0.5, 0.5, 0.5)
    sky.link(sky.add("TexCoord").outputs["Generated"], shift.inputs[0])
    sky.link(shift.outputs[0])
    environment = sky.read()
    fine = 0.5 + 0.5 * directions(middles(SIZE * 8))
    weights = sample_weights(SIZE, 8)[..., np.newaxis]
    means = (fine * weights).reshape(SIZE, 8, SIZE, 8, 3).sum(axis=(1, 3)) / solid_angles(SIZE)[..., np.newaxis]
    assert_allclose(environment.radiance, means, atol=2e-3)
    assert_allclose(energy(environment), 2 * pi, rtol=1e-4)


def test_the_disc_of_a_sun_keeps_its_energy(sky: Sky) -> None:
    """Against 512 × 512 points of a square about it."""
    texture = sky.add("TexSky")
    texture.sun_elevation, texture.sun_rotation = 0.6, 1.0
    sky.link(texture.outputs[0])
    whole = sky.read()
    middle = middles(SIZE).reshape(-1, 2)[whole.luminance.argmax()]
    width = 1.5 / SIZE
    corner = middle - width
    with world_scene(bpy.context.scene, sky.world) as passing:
        seen = light_of_squares(passing, corner[np.newaxis], 512, 2 * width)[0]
    points = corner + (middles(512) + 1.0) * width
    angles = np.abs(directions(points)).sum(axis=-1) ** 3 * (2 * width / 512) ** 2
    disc = seen[..., 1] > 1000.0
    assert angles[disc].sum() == pytest.approx(pi * (texture.sun_size / 2) ** 2, rel=0.06)  # edges count whole
    shine = (seen * (angles * disc)[..., np.newaxis]).sum(axis=(0, 1))
    texture.sun_disc = False
    assert_allclose(energy(whole) - energy(sky.read()), shine, rtol=5e-3)


@pytest.mark.parametrize("grouped", [False, True])
def test_it_is_seen_as_by_diffuse_rays(sky: Sky, grouped: bool) -> None:
    """A backdrop for the camera is no light."""
    tree = sky.tree
    if grouped:
        tree = bpy.data.node_groups.new("Rays", "ShaderNodeTree")
        tree.interface.new_socket("Value", in_out="OUTPUT", socket_type="NodeSocketFloat")
        end = tree.nodes.new("NodeGroupOutput")
        group = sky.add("Group")
        group.node_tree = tree
    light_path = tree.nodes.new("ShaderNodeLightPath")
    camera = light_path.outputs["Is Camera Ray"]
    if grouped:
        tree.links.new(camera, end.inputs[0])
        camera = group.outputs[0]
    mix = sky.add("MixRGB", Color1=(0.5, 0.5, 0.5, 1.0), Color2=(9.0, 0.0, 0.0, 1.0))
    sky.link(camera, mix.inputs["Fac"])
    sky.link(mix.outputs[0])
    assert_allclose(sky.read().radiance, 0.5, rtol=1e-6)
    assert len(bpy.data.node_groups) == grouped
    assert light_path.outputs["Is Camera Ray"].is_linked


def test_a_volume_is_left_out(sky: Sky) -> None:
    output = sky.tree.get_output_node("CYCLES")
    sky.link(sky.add("VolumeScatter").outputs[0], output.inputs["Volume"])
    assert sky.read().radiance.min() > 0.0
    assert output.inputs["Volume"].is_linked


# Images


@pytest.mark.parametrize(("turn", "kind"), [(None, "POINT"), (TURN, "POINT"), (TURN, "TEXTURE"), (TURN, "VECTOR")])
def test_an_image_lies_as_cycles_lays_it(sky: Sky, tmp_path: Path, turn: Any, kind: str) -> None:
    write_image(tmp_path / "sky.exr", smooth(), depth=32)
    sky.image(tmp_path / "sky.exr", turn=turn, kind=kind, strength=3.0)
    assert plain_image(sky.world) is not None
    own = sky.read()
    sky.veil()
    assert plain_image(sky.world) is None
    assert_allclose(own.radiance, sky.read().radiance, atol=0.02)
    assert_allclose(energy(own), 6 * pi, rtol=1e-3)
    assert own.radiance.max() > 2.7


def test_one_bright_pixel_keeps_its_energy_either_way(sky: Sky, tmp_path: Path) -> None:
    pixels = np.full((256, 512, 3), 0.01, np.float32)
    pixels[90, 200] = 5e4
    write_image(tmp_path / "sun.exr", pixels, depth=32)
    wanted = (pixels.astype(np.float64) * pixel_angles((256, 512))[..., np.newaxis]).sum(axis=(0, 1))
    sky.image(tmp_path / "sun.exr", turn=TURN)
    assert_allclose(energy(sky.read()), wanted, rtol=1e-3)
    sky.veil()
    assert_allclose(energy(sky.read()), wanted, rtol=1e-2)


@pytest.mark.parametrize("packed", [False, True])
def test_an_8_bit_picture_becomes_linear(sky: Sky, tmp_path: Path, packed: bool) -> None:
    write_image(tmp_path / "sky.png", np.full((8, 16, 3), (0.0, 128 / 255, 1.0), np.float32), depth=8)
    image = sky.image(tmp_path / "sky.png")
    if packed:
        image.pack()
        (tmp_path / "sky.png").unlink()
    assert plain_image(sky.world) is not None
    wanted = np.broadcast_to((0.0, 0.2158605, 1.0), (SIZE, SIZE, 3))
    assert_allclose(sky.read().radiance, wanted, atol=1e-6)
    image.colorspace_settings.name = "Non-Color"
    assert_allclose(sky.read().radiance[0, 0], (0.0, 128 / 255, 1.0), atol=1e-6)


def test_a_radiance_picture_and_what_is_below_zero(sky: Sky, tmp_path: Path) -> None:
    pixels = np.full((8, 16, 3), (-0.25, 0.5, 2.0), np.float32)
    write_image(tmp_path / "sky.exr", pixels, depth=16)
    sky.image(tmp_path / "sky.exr", strength=2.0)
    assert_allclose(sky.read().radiance, np.broadcast_to((0.0, 1.0, 4.0), (SIZE, SIZE, 3)), rtol=1e-6)


def test_a_picture_that_was_painted_on_is_not_read_from_its_file(sky: Sky, tmp_path: Path) -> None:
    write_image(tmp_path / "sky.exr", np.full((8, 16, 3), 0.5, np.float32), depth=32)
    image = sky.image(tmp_path / "sky.exr")
    image.pixels.foreach_set(np.full(4 * 8 * 16, 0.25, np.float32))
    image.update()
    assert image.is_dirty and plain_image(sky.world) is None


# What is left


def state() -> str:
    """Names of all data, and what a bake would have changed."""
    scene, context = bpy.context.scene, bpy.context
    kinds = ("scenes", "worlds", "materials", "meshes", "objects", "images", "node_groups", "cameras", "textures")
    data = {kind: [each.name for each in getattr(bpy.data, kind)] for kind in kinds}
    chosen = [scene.name, context.view_layer.objects.active.name, context.mode, scene.render.engine, scene.world.name]
    selected = [each.name for each in context.selected_objects]
    nodes = [[node.name for node in world.node_tree.nodes] for world in bpy.data.worlds if world.node_tree]
    numbers = [scene.frame_current, scene.cycles.samples, scene.world.cycles.sampling_method, scene.render.bake.margin]
    return json.dumps([data, chosen, selected, nodes, numbers, len(bpy.app.handlers.object_bake_pre)])


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_nothing_changes(sky: Sky, mode: str) -> None:
    blender.cube()
    calls: list[str] = []
    bpy.app.handlers.object_bake_pre.append(lambda *_: calls.append("bake"))
    bpy.app.handlers.render_pre.append(lambda *_: calls.append("render"))
    try:
        bpy.ops.object.mode_set(mode=mode)
        before = state()
        sky.read()
        assert state() == before
    finally:
        bpy.app.handlers.object_bake_pre.clear()
        bpy.app.handlers.render_pre.clear()
    assert not calls
    assert "Render Result" not in bpy.data.images


def test_nothing_changes_where_it_fails(sky: Sky, monkeypatch: pytest.MonkeyPatch) -> None:
    blender.cube()
    before = state()

    def fail(*_: Any) -> None:
        raise InputError("Sky: no")

    monkeypatch.setattr("occlusion_bake.addon.read.world_bake._bake", fail)
    with pytest.raises(InputError):
        sky.read()
    assert state() == before


# What is refused


def refused(*words: str) -> None:
    with pytest.raises(InputError) as refusal:
        read_world(bpy.context.scene, SIZE)
    assert "\n" not in str(refusal.value)
    for word in words:
        assert word in str(refusal.value)


def test_no_world(empty_scene: None) -> None:
    bpy.context.scene.world = None
    refused("Scene: the scene has no World", "add one")


@pytest.mark.parametrize("cause", ["strength", "colour", "unlinked", "hidden"])
def test_no_light(sky: Sky, cause: str) -> None:
    if cause == "strength":
        sky.background.inputs["Strength"].default_value = 0.0
    elif cause == "colour":
        sky.background.inputs["Color"].default_value = (0.0, 0.0, 0.0, 1.0)
    elif cause == "unlinked":
        sky.tree.links.clear()
    else:
        sky.world.cycles_visibility.diffuse = False
    refused("Sky: it gives no light", "strength above 0")


@pytest.mark.parametrize("veiled", [False, True])
def test_a_missing_and_a_broken_file(sky: Sky, tmp_path: Path, veiled: bool) -> None:
    path = tmp_path / "sky.exr"
    write_image(path, smooth(8), depth=32)
    image = sky.image(path)
    if veiled:
        sky.veil()
    path.write_bytes(b"no image")
    image.reload()
    refused("sky.exr", "cannot be read as an image")
    path.unlink()
    refused("sky.exr: its file", "is missing", "choose another")


def test_an_image_texture_without_an_image(sky: Sky) -> None:
    stray = sky.add("TexEnvironment")
    sky.read()  # it leads nowhere
    sky.link(stray.outputs[0])
    refused("Sky: its Environment Texture node", "has no image")


def test_pixels_that_are_not_finite(sky: Sky, tmp_path: Path) -> None:
    import OpenImageIO

    pixels = smooth(8)
    pixels[1, 2], pixels[3, 4, 1], pixels[5, 6, 0] = np.inf, np.nan, -np.inf
    output = OpenImageIO.ImageOutput.create(str(tmp_path / "sky.exr"))
    assert output.open(str(tmp_path / "sky.exr"), OpenImageIO.ImageSpec(16, 8, 3, "float")) and output.write_image(
        pixels
    )
    output.close()
    sky.image(tmp_path / "sky.exr")
    refused("sky.exr: 3 pixels are not finite", "clamp")
