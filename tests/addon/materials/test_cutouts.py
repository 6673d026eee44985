"""What materials let through: the same as Cycles bakes close under them, and read from no more than it takes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

bpy = pytest.importorskip("bpy")

from occlusion_bake.addon.compare.cycles import CyclesSettings, bake_ao  # noqa: E402
from occlusion_bake.addon.materials import image_pixels  # noqa: E402
from occlusion_bake.addon.materials.cutouts import MaterialOpacities, cutout_of  # noqa: E402
from occlusion_bake.addon.read.mesh_arrays import corners_of  # noqa: E402
from occlusion_bake.core.scene.cutout import OPAQUE, Cutout, opacity  # noqa: E402
from occlusion_bake.core.scene.image_texture import Wrap  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402

pytestmark = pytest.mark.usefixtures("empty_scene")
TEXELS, SAMPLES = 8, 256
# A bake spreads its samples over the whole texel from 5.0 on, over the middle half before.
SPREAD = 1.0 if bpy.app.version >= (5, 0) else 0.5
GREY = np.random.default_rng(1).random((4, 4))
COLOURS = np.concatenate([np.random.default_rng(2).random((4, 4, 3)), np.ones((4, 4, 1))], axis=2)
LOOSE = ((-0.5, -0.5), (1.5, -0.5), (1.5, 1.5), (-0.5, 1.5))


class Tree:
    """A new material's nodes, its output alone among them."""

    def __init__(self, name: str = "leaf") -> None:
        self.material = bpy.data.materials.new(name)
        if not self.material.node_tree:
            self.material.use_nodes = True
        self.nodes, self.links = self.material.node_tree.nodes, self.material.node_tree.links
        self.nodes.clear()
        self.output = self.nodes.new("ShaderNodeOutputMaterial")

    def node(self, kind: str, *inputs: Any, **settings: Any) -> Any:
        """A node with its first inputs linked, or set, in order; None leaves one alone."""
        node = self.nodes.new(f"ShaderNode{kind}")
        for name, value in settings.items():
            setattr(node, name, value)
        for socket, value in zip([each for each in node.inputs if each.enabled], inputs, strict=False):
            self.put(value, socket)
        return node

    def put(self, value: Any, socket: Any) -> None:
        if isinstance(value, bpy.types.NodeSocket):
            self.links.new(value, socket)
        elif value is not None:
            socket.default_value = value

    def image(self, values: Any = GREY, **settings: Any) -> Any:
        """An Image Texture. values: (h, w) of alpha, (h, w, 4), or an image."""
        picture = values if isinstance(values, bpy.types.Image) else image(values)
        return self.node("TexImage", image=picture, **settings)

    def principled(self, alpha: Any) -> Any:
        """The surface: a Principled BSDF with this alpha. Returns the material."""
        shader = self.node("BsdfPrincipled")
        self.put(alpha, shader.inputs["Alpha"])
        return self.surface(shader)

    def mixed(self, factor: Any, *shaders: str) -> Any:
        """The surface: a Mix Shader of these, by default first a Transparent BSDF. Returns the material."""
        kinds = shaders or ("BsdfTransparent", "BsdfDiffuse")
        return self.surface(self.node("MixShader", factor, *(self.node(kind).outputs[0] for kind in kinds)))

    def surface(self, shader: Any) -> Any:
        self.links.new(shader.outputs[0], self.output.inputs["Surface"])
        return self.material


def image(values: Any, name: str = "picture", space: str = "Non-Color", **settings: Any) -> Any:
    """A packed image of bytes, row 0 at the top; where only alpha is given, the colours are grey."""
    values = np.asarray(values, dtype=np.float32)
    if values.ndim == 2:
        values = np.concatenate([np.full((*values.shape, 3), 0.5), values[..., np.newaxis]], axis=2)
    made = bpy.data.images.new(name, values.shape[1], values.shape[0], alpha=True)
    made.colorspace_settings.name = space
    for key, value in settings.items():
        setattr(made, key, value)
    made.pixels.foreach_set(np.ascontiguousarray(values[::-1], dtype=np.float32).ravel())
    made.pack()
    return made


def card(*materials: Any, uv: Any = LOOSE, name: str = "Card") -> Any:
    """A square of side 1 just above the floor, its UVs one and a half pictures about the middle one."""
    corners = [(-0.5, -0.5, 1e-4), (0.5, -0.5, 1e-4), (0.5, 0.5, 1e-4), (-0.5, 0.5, 1e-4)]
    obj = blender.mesh(name, corners, [(0, 1, 2, 3)], uv)
    for material in materials:
        obj.data.materials.append(material)
    return obj


def read(obj: Any, opacities: MaterialOpacities | None = None) -> tuple[Cutout | None, list[str]]:
    evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = evaluated.data
    polygons = np.empty(len(mesh.loop_triangles), dtype=np.int32)
    mesh.loop_triangle_polygons.foreach_get("value", polygons)
    return cutout_of(evaluated, mesh, corners_of(mesh), polygons, opacities or MaterialOpacities())


def cut(obj: Any) -> Cutout:
    """What cuts an object of which nothing is to be said."""
    found, lines = read(obj)
    assert found is not None and lines == []
    return found


def line(obj: Any) -> str:
    """The one line on an object that is taken for opaque."""
    found, lines = read(obj)
    assert found is None and len(lines) == 1 and "\n" not in lines[0]
    assert "as if opaque; " in lines[0]
    return lines[0]


def one_value(obj: Any) -> float:
    """The opacity of an object that has one."""
    (alpha,) = cut(obj).alphas
    assert alpha.values.shape == (1, 1)
    return float(alpha.values[0, 0])


def means(found: Cutout) -> np.ndarray:
    """(TEXELS, TEXELS): the mean opacity of the card over each texel of the floor, row 0 at the top."""
    steps = (np.arange(16, dtype=np.int64) + 0.5) / 16 - 0.5
    along = ((np.arange(TEXELS, dtype=np.int64)[:, np.newaxis] + 0.5 + SPREAD * steps) / TEXELS).ravel()
    v, u = (each.ravel() for each in np.meshgrid(along[::-1], along, indexing="ij"))
    first = u > v  # triangles (0, 1, 2) and (0, 2, 3) of the unit square
    weights = np.where(first, [1 - u, u - v, v], [1 - v, u, v - u]).T.astype(np.float32)
    values = opacity(found, np.where(first, 0, 1).astype(np.int32), weights)
    return values.reshape(TEXELS, 16, TEXELS, 16).mean(axis=(1, 3))


def baked() -> np.ndarray:
    """(TEXELS, TEXELS): what the card stops of Cycles' rays from the floor, which all meet it beside their origin."""
    blender.mesh("Floor", [(-0.5, -0.5, 0), (0.5, -0.5, 0), (0.5, 0.5, 0), (-0.5, 0.5, 0)], [(0, 1, 2, 3)], LOOSE)
    layer = bpy.data.objects["Floor"].data.uv_layers[0]
    layer.uv.foreach_set("vector", np.float32([0, 0, 1, 0, 1, 1, 0, 1]))
    settings = CyclesSettings((TEXELS, TEXELS), SAMPLES, None, 2, 0)
    return 1.0 - bake_ao(bpy.context, bpy.data.objects["Floor"], settings).values


def assert_as_cycles(obj: Any, slack: float = 0.02) -> None:
    """On the floor's diagonal Cycles draws its samples anew where they leave a triangle, and its means are others."""
    off = ~np.eye(TEXELS, dtype=bool)[::-1]
    ours = means(cut(obj))
    assert np.ptp(ours) > 0.05
    assert_allclose(baked()[off], ours[off], atol=slack)


# Against Cycles


@pytest.mark.parametrize("interpolation", ["Linear", "Closest"])
@pytest.mark.parametrize("extension", ["REPEAT", "EXTEND", "CLIP", "MIRROR"])
def test_an_image_in_the_alpha_is_what_cycles_sees(extension: str, interpolation: str) -> None:
    tree = Tree()
    texture = tree.image(extension=extension, interpolation=interpolation)
    obj = card(tree.principled(texture.outputs["Alpha"]))
    (alpha,) = cut(obj).alphas
    assert (alpha.wrap, alpha.linear) == (Wrap[extension], interpolation == "Linear")
    assert_as_cycles(obj)


@pytest.mark.parametrize("order", [("BsdfTransparent", "BsdfDiffuse"), ("Emission", "BsdfTransparent")])
def test_a_mix_with_transparent_is_what_cycles_sees_beyond_the_edges_too(order: Sequence[str]) -> None:
    tree = Tree()
    assert_as_cycles(card(tree.mixed(tree.image(extension="CLIP").outputs["Alpha"], *order)))


@pytest.mark.parametrize("space", ["sRGB", "Non-Color", "Linear Rec.709"])
def test_a_colour_is_its_luminance_in_linear_light(space: str) -> None:
    tree = Tree()
    assert_as_cycles(card(tree.mixed(tree.image(image(COLOURS, space=space)).outputs["Color"])))


@pytest.mark.parametrize("linked", [False, True])
@pytest.mark.parametrize("mode", ["STRAIGHT", "CHANNEL_PACKED", "NONE"])
def test_a_colour_counts_as_much_as_its_alpha(mode: str, linked: bool) -> None:
    """Unless the alpha is used beside it, or is none of it."""
    colours = COLOURS.copy()
    colours[..., 3] = GREY
    tree = Tree()
    texture = tree.image(image(colours, space="sRGB", alpha_mode=mode), interpolation="Closest")
    factor = texture.outputs["Color"]
    if linked:
        factor = tree.node("Math", factor, texture.outputs["Alpha"], operation="MULTIPLY").outputs[0]
    assert_as_cycles(card(tree.mixed(factor)))


@pytest.mark.parametrize(
    ("operation", "first", "second"),
    [
        ("GREATER_THAN", None, 0.3),
        ("LESS_THAN", 0.3, None),
        ("MULTIPLY", None, 1.7),
        ("SUBTRACT", 1.0, None),
        ("DIVIDE", 0.1, None),
        ("POWER", None, 3.0),
        ("ROUND", None, None),
    ],
)
def test_math_comes_after_interpolation(operation: str, first: Any, second: Any) -> None:
    tree = Tree()
    alpha = tree.image().outputs["Alpha"]
    node = tree.node("Math", first or alpha, second or alpha, operation=operation)
    assert_as_cycles(card(tree.principled(node.outputs[0])), slack=0.12)


def _ramp(tree: Tree, colour: Any) -> Any:
    node = tree.node("ValToRGB", colour)
    node.color_ramp.elements[0].position, node.color_ramp.elements[0].color = 0.2, (0.1, 0.6, 0.1, 0.3)
    node.color_ramp.elements[1].position = 0.7
    return node.outputs[0]


def _mix(tree: Tree, colour: Any) -> Any:
    node = tree.node("Mix", data_type="RGBA", blend_type="MULTIPLY")
    sockets = {socket.identifier: socket for socket in node.inputs}
    tree.put(0.7, sockets["Factor_Float"])
    tree.put(colour, sockets["A_Color"])
    tree.put((0.2, 0.6, 0.9, 1.0), sockets["B_Color"])
    return next(socket for socket in node.outputs if socket.identifier == "Result_Color")


@pytest.mark.parametrize(
    "build",
    [
        lambda tree, colour: tree.node("SeparateColor", colour).outputs["Green"],
        lambda tree, colour: tree.node("RGBToBW", colour).outputs[0],
        lambda tree, colour: tree.node("Invert", 0.8, colour).outputs[0],
        lambda tree, colour: tree.node("Clamp", colour, 0.4, 0.6).outputs[0],
        _ramp,
        _mix,
    ],
    ids=["channel", "grey", "invert", "clamp", "ramp", "mix"],
)
def test_nodes_on_the_way_are_what_cycles_makes_of_them(build: Callable[[Tree, Any], Any]) -> None:
    tree = Tree()
    colour = tree.image(image(COLOURS), interpolation="Closest").outputs["Color"]
    assert_as_cycles(card(tree.principled(build(tree, colour))))


@pytest.mark.parametrize("kind", ["POINT", "TEXTURE", "VECTOR"])
def test_a_mapping_is_what_cycles_makes_of_it(kind: str) -> None:
    """Of another UV map than the one for renders."""
    tree = Tree()
    mapping = tree.node("Mapping", tree.node("UVMap", uv_map="Other").outputs[0], vector_type=kind)
    if kind != "VECTOR":
        mapping.inputs["Location"].default_value = (0.3, -0.2, 0.5)
    mapping.inputs["Rotation"].default_value = (0.2, 0.0, 0.6)
    mapping.inputs["Scale"].default_value = (1.5, 0.7, 2.0)
    texture = tree.image(extension="MIRROR", interpolation="Closest")
    tree.put(mapping.outputs[0], texture.inputs["Vector"])
    obj = card(tree.principled(texture.outputs["Alpha"]))
    obj.data.uv_layers.new(name="Other").uv.foreach_set("vector", np.float32([0, 0, 0, 1, 1, 1, 1, 0]))
    assert_as_cycles(obj, slack=0.04)


def test_light_that_passes_is_what_cycles_counts() -> None:
    """At a height, where rays of all slopes go through different texels: the mean over them from each texel's middle,
    through a card far larger than the floor."""
    tree = Tree()
    obj = card(tree.principled(tree.image(np.eye(4)).outputs["Alpha"]), uv=((0, 0), (64, 0), (64, 64), (0, 64)))
    obj.scale, obj.location.z = (64.0, 64.0, 1.0), 0.15
    seen = 1.0 - baked()
    assert np.ptp(seen) > 0.2
    ours = _open(cut(obj), 0.1501)
    off = ~np.eye(TEXELS, dtype=bool)[::-1]
    assert seen[off].mean() == pytest.approx(ours[off].mean(), abs=3 * 0.5 / np.sqrt(SAMPLES * off.sum()))
    assert_allclose(seen[off], ours[off], atol=4 * 0.5 / np.sqrt(SAMPLES))


def _open(found: Cutout, height: float) -> np.ndarray:
    """(TEXELS, TEXELS): light that passes a square of side 64 about the origin at this height."""
    squared, turn = (each.ravel() for each in np.meshgrid(*[(np.arange(64, dtype=np.int64) + 0.5) / 64] * 2))
    slope = height * np.sqrt(squared / (1.0 - squared))  # radii at which cosine-weighted rays meet the plane
    along = (np.arange(TEXELS, dtype=np.int64) + 0.5) / TEXELS - 0.5
    y, x = np.meshgrid(along[::-1], along, indexing="ij")
    u = (x[..., np.newaxis] + slope * np.cos(2 * np.pi * turn)).ravel() / 64 + 0.5
    v = (y[..., np.newaxis] + slope * np.sin(2 * np.pi * turn)).ravel() / 64 + 0.5
    first, within = u > v, (np.abs(u - 0.5) < 0.5) & (np.abs(v - 0.5) < 0.5)
    weights = np.where(first, [1 - u, u - v, v], [1 - v, u, v - u]).T.astype(np.float32)
    stopped = np.where(within, opacity(found, np.where(first, 0, 1).astype(np.int32), weights), 0.0)
    return (1.0 - stopped.reshape(TEXELS, TEXELS, -1)).mean(axis=2)


SHADERS = {
    "half": lambda tree: tree.principled(0.5),
    "negative": lambda tree: tree.principled(-1.0),
    "clear": lambda tree: tree.surface(tree.node("BsdfTransparent")),
    "grey": lambda tree: tree.surface(tree.node("BsdfTransparent", (0.4, 0.4, 0.4, 1.0))),
    "a quarter": lambda tree: tree.mixed(0.25),
    "three quarters": lambda tree: tree.mixed(0.25, "BsdfDiffuse", "BsdfTransparent"),
    "a mix with nothing": lambda tree: tree.mixed(0.25, "BsdfTransparent"),
    "a sum": lambda tree: tree.surface(
        tree.node("AddShader", tree.node("Emission").outputs[0], tree.node("BsdfTransparent").outputs[0])
    ),
    "no shadow": lambda tree: tree.mixed(
        tree.node("LightPath").outputs["Is Shadow Ray"], "BsdfDiffuse", "BsdfTransparent"
    ),
    "a sum of parts": lambda tree: tree.surface(
        tree.node(
            "AddShader",
            tree.node("BsdfTransparent", (0.2, 0.2, 0.2, 1.0)).outputs[0],
            tree.node("BsdfTransparent", (0.3, 0.3, 0.3, 1.0)).outputs[0],
        )
    ),
}


@pytest.mark.parametrize("build", SHADERS.values(), ids=SHADERS.keys())
def test_constants_are_what_cycles_sees(build: Callable[[Tree], Any]) -> None:
    obj = card(build(Tree()))
    assert baked().mean() == pytest.approx(one_value(obj), abs=0.01)


OPAQUES = {
    "no nodes linked": lambda tree: tree.material,
    "alpha 1": lambda tree: tree.principled(1.0),
    "alpha 2": lambda tree: tree.principled(2.0),
    "glass": lambda tree: tree.surface(tree.node("BsdfGlass")),
    "holdout": lambda tree: tree.surface(tree.node("Holdout")),
    "seen by the camera alone": lambda tree: tree.mixed(
        tree.node("LightPath").outputs["Is Camera Ray"], "BsdfDiffuse", "BsdfTransparent"
    ),
    "a factor of 1": lambda tree: tree.mixed(1.0),
}


@pytest.mark.parametrize("build", OPAQUES.values(), ids=OPAQUES.keys())
def test_what_is_opaque_to_cycles_is_so_without_a_word(build: Callable[[Tree], Any]) -> None:
    obj = card(build(Tree()))
    assert baked().min() > 0.98
    assert read(obj) == (None, [])


def test_a_material_without_transparent_shadows_is_opaque() -> None:
    material = Tree().principled(0.3)
    material.use_transparent_shadow = False
    obj = card(material)
    assert baked().min() > 0.98
    assert read(obj) == (None, [])


def test_a_map_that_is_not_there_lies_at_its_origin() -> None:
    for uv, name in ((LOOSE, "Nope"), (None, "")):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        tree = Tree()
        texture = tree.image(interpolation="Closest")
        tree.put(tree.node("UVMap", uv_map=name).outputs[0], texture.inputs["Vector"])
        obj = card(tree.principled(texture.outputs["Alpha"]), uv=uv)
        assert_allclose(means(cut(obj)), GREY[3, 0], atol=0.003)
        assert_allclose(baked(), GREY[3, 0], atol=0.01)


# Slots


def test_each_polygon_has_the_opacity_of_its_slot() -> None:
    """Five faces side by side: of an opaque material, a clear one, an empty slot, an image, a slot that is not."""
    corners = [(x, y, 0.0) for x in range(6) for y in range(2)]
    faces = [(2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1) for i in range(5)]
    obj = blender.mesh("Row", corners, faces, [LOOSE] * 5)
    tree = Tree("image")
    materials = [Tree("shut").principled(1.0), Tree("clear").principled(0.0), None]
    for material in (*materials, tree.principled(tree.image().outputs["Alpha"])):
        obj.data.materials.append(material)
    obj.data.polygons.foreach_set("material_index", [0, 1, 2, 3, 9])
    found = cut(obj)
    assert [alpha.values.shape for alpha in found.alphas] == [(1, 1), (4, 4)]
    assert found.alpha.tolist() == [OPAQUE, OPAQUE, 0, 0, OPAQUE, OPAQUE, 1, 1, 1, 1]
    loose = np.float32(LOOSE)
    assert_array_equal(found.uv[6:8], loose[corners_of(obj.data)[6:8] % 4])


def test_a_slot_of_the_object_comes_before_the_meshs() -> None:
    obj = card(Tree("shut").principled(1.0))
    assert read(obj) == (None, [])
    obj.material_slots[0].link = "OBJECT"
    obj.material_slots[0].material = Tree("half").principled(0.5)
    assert one_value(obj) == 0.5


def test_a_material_can_stand_for_all() -> None:
    """As Cycles has it where the view layer says so; also on an object without a slot."""
    override = Tree("override").principled(0.25)
    for obj in (card(Tree("shut").principled(1.0)), card(name="Bare")):
        found, _ = read(obj, MaterialOpacities(override))
        assert found is not None and found.alphas[0].values.tolist() == [[0.25]]


def test_an_object_without_materials_is_opaque() -> None:
    assert read(card()) == (None, [])
    assert read(card(None, name="Empty slot")) == (None, [])


# Through the tree


def group_of(build: Callable[[Any, Any, Any], None], *sockets: tuple[str, str, str]) -> Any:
    """A node group. build: fills it, given the tree and its ends."""
    group = bpy.data.node_groups.new("Group", "ShaderNodeTree")
    for name, direction, kind in sockets:
        group.interface.new_socket(name, in_out=direction, socket_type=f"NodeSocket{kind}")
    ends = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    build(group, *ends)
    return group


def test_groups_are_followed_in_and_out_again() -> None:
    """An alpha that goes into a group, into one within it, and comes out as a shader; and one that stays as it is."""

    def halve(group: Any, entry: Any, leave: Any) -> None:
        node = group.nodes.new("ShaderNodeMath")
        node.operation = "MULTIPLY"
        node.inputs[1].default_value = 0.5
        group.links.new(entry.outputs[0], node.inputs[0])
        group.links.new(node.outputs[0], leave.inputs[0])

    inner = group_of(halve, ("Value", "INPUT", "Float"), ("Value", "OUTPUT", "Float"))

    def shade(group: Any, entry: Any, leave: Any) -> None:
        node, shader = group.nodes.new("ShaderNodeGroup"), group.nodes.new("ShaderNodeBsdfPrincipled")
        node.node_tree = inner
        group.links.new(entry.outputs[0], node.inputs[0])
        group.links.new(node.outputs[0], shader.inputs["Alpha"])
        group.links.new(shader.outputs[0], leave.inputs[0])

    outer = group_of(shade, ("Alpha", "INPUT", "Float"), ("Shader", "OUTPUT", "Shader"))
    tree = Tree()
    node = tree.node("Group", node_tree=outer)
    node.inputs[0].default_value = 0.6
    obj = card(tree.surface(node))
    assert one_value(obj) == pytest.approx(0.3)
    tree.put(tree.image().outputs["Alpha"], node.inputs[0])
    assert_as_cycles(obj)


def test_reroutes_and_muted_nodes_are_passed() -> None:
    tree = Tree()
    muted = tree.node("Math", tree.image().outputs["Alpha"], 0.2, operation="POWER")
    muted.mute = True
    reroute = tree.nodes.new("NodeReroute")
    tree.put(muted.outputs[0], reroute.inputs[0])
    assert_as_cycles(card(tree.principled(reroute.outputs[0])))


def test_a_muted_link_leaves_the_sockets_own_value() -> None:
    tree = Tree()
    material = tree.mixed(tree.image().outputs["Alpha"])
    mixer = next(node for node in tree.nodes if node.type == "MIX_SHADER")
    mixer.inputs[0].default_value = 0.75
    mixer.inputs[0].links[0].is_muted = True
    assert one_value(card(material)) == 0.75


def test_the_output_that_cycles_takes_is_read() -> None:
    """Of several, not that for EEVEE."""
    tree = Tree()
    tree.output.target = "CYCLES"
    material = tree.principled(0.5)
    other = tree.nodes.new("ShaderNodeOutputMaterial")
    other.target = "EEVEE"
    other.is_active_output = True
    tree.links.new(tree.node("BsdfTransparent").outputs[0], other.inputs["Surface"])
    assert one_value(card(material)) == 0.5


def test_two_sockets_of_one_image_are_combined() -> None:
    colours = COLOURS.copy()
    colours[..., 3] = GREY
    tree = Tree()
    texture = tree.image(image(colours, space="sRGB"))
    product = tree.node("Math", texture.outputs["Color"], texture.outputs["Alpha"], operation="MULTIPLY")
    assert_as_cycles(card(tree.principled(product.outputs[0])), slack=0.04)


# What is not read


def wave(tree: Tree) -> Any:
    return tree.principled(tree.node("TexWave").outputs["Color"])


def two_images(tree: Tree) -> Any:
    alphas = (tree.image(image(GREY, name)).outputs["Alpha"] for name in ("a", "b"))
    return tree.principled(tree.node("Math", *alphas, operation="MULTIPLY").outputs[0])


def boxed(tree: Tree) -> Any:
    return tree.principled(tree.image(projection="BOX").outputs["Alpha"])


def by_position(tree: Tree) -> Any:
    texture = tree.image()
    tree.put(tree.node("TexCoord").outputs["Object"], texture.inputs["Vector"])
    return tree.principled(texture.outputs["Alpha"])


def display(tree: Tree) -> Any:
    return tree.principled(tree.image(image(GREY, space="AgX Log")).outputs["Color"])


def lost(tree: Tree) -> Any:
    picture = bpy.data.images.new("lost", 4, 4)
    picture.source, picture.filepath = "FILE", "//nowhere.png"
    return tree.principled(tree.image(picture).outputs["Alpha"])


def tiles(tree: Tree) -> Any:
    return tree.principled(tree.image(bpy.data.images.new("tiles", 4, 4, tiled=True)).outputs["Alpha"])


def movie(tree: Tree) -> Any:
    picture = image(GREY, "film")
    picture.source = "SEQUENCE"
    return tree.principled(tree.image(picture).outputs["Alpha"])


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (wave, ("a node Wave Texture", "bake its opacity into an image")),
        (two_images, ("more than one image",)),
        (boxed, ("projection Box",)),
        (by_position, ("Object of a node Texture Coordinate",)),
        (display, ("AgX Log", "sRGB or Non-Color")),
        (lost, ("image lost cannot be loaded", "find the file")),
        (tiles, ("tiles, UDIM tiles", "single image")),
        (movie, ("film, an image sequence", "single image")),
        (lambda tree: tree.principled(tree.node("TexImage").outputs["Alpha"]), ("has no image", "choose one")),
        (lambda tree: tree.principled(tree.node("Math", 0.3, operation="SINE").outputs[0]), ("Math set to Sine",)),
        (lambda tree: tree.mixed(tree.node("NewGeometry").outputs["Backfacing"]), ("a node Geometry",)),
        (lambda tree: tree.mixed(tree.node("LightPath").outputs["Ray Length"]), ("Ray Length of a node Light Path",)),
    ],
)
def test_what_is_not_read_blocks_light_and_is_said(build: Callable[[Tree], Any], words: Sequence[str]) -> None:
    said = line(card(build(Tree("leaf"))))
    assert said.startswith("leaf: ")
    for word in words:
        assert word in said


def test_an_image_of_one_side_of_a_mix_does_not_matter_where_the_factor_leaves_it_out() -> None:
    tree = Tree()
    inner = tree.node("MixShader", tree.node("TexWave").outputs["Color"])
    mixer = tree.node("MixShader", 0.0, tree.node("BsdfTransparent").outputs[0], inner.outputs[0])
    assert one_value(card(tree.surface(mixer))) == 0.0


def test_coloured_transparency_is_grey_and_said() -> None:
    tree = Tree("glass")
    found, lines = read(card(tree.surface(tree.node("BsdfTransparent", (0.2, 0.5, 0.9, 1.0)))))
    assert found is not None
    assert found.alphas[0].values[0, 0] == pytest.approx(1.0 - 0.2126 * 0.2 - 0.7152 * 0.5 - 0.0722 * 0.9, abs=1e-3)
    assert lines == ["glass: its transparency is coloured; light passes as if it were grey"]


def test_a_volume_alone_is_clear_and_said() -> None:
    tree = Tree("fog")
    volume = tree.node("VolumeAbsorption")
    tree.links.new(volume.outputs[0], tree.output.inputs["Volume"])
    found, lines = read(card(tree.material))
    assert found is not None and found.alphas[0].values[0, 0] == 0.0
    assert lines == ["fog: it is a volume alone; light passes through it as if it were clear"]


def test_a_line_is_said_once_a_material() -> None:
    opacities, material = MaterialOpacities(), wave(Tree("leaf"))
    first, second = card(material, material), card(material, name="Other")
    assert len(read(first, opacities)[1]) == 1
    assert read(second, opacities)[1] == []


# How often images are read


@pytest.fixture
def reads(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The names of the images whose pixels were read."""
    names: list[str] = []
    plain = image_pixels._pixels
    monkeypatch.setattr(image_pixels, "_pixels", lambda image: names.append(image.name) or plain(image))
    return names


def test_an_image_is_read_once_and_held_once(reads: list[str]) -> None:
    picture, opacities = image(GREY), MaterialOpacities()
    found = []
    for number in range(3):
        tree = Tree(f"leaf {number}")
        material = tree.principled(tree.image(picture).outputs["Alpha"])
        found.append(read(card(material, name=f"Card {number}"), opacities)[0])
    assert reads == ["picture"]
    assert found[0].alphas[0] is found[1].alphas[0] is found[2].alphas[0]


def test_a_colour_is_no_reason_to_read_an_image(reads: list[str]) -> None:
    tree = Tree()
    tree.principled(1.0)
    shader = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    tree.put(tree.image().outputs["Color"], shader.inputs["Base Color"])
    assert read(card(tree.material)) == (None, [])
    assert reads == []


def test_an_image_without_alpha_is_opaque(tmp_path: Path, reads: list[str]) -> None:
    """None in its file, or none of it used; the latter is known without its pixels."""
    for mode, picture in (("NONE", image(GREY, alpha_mode="NONE")), ("full", image(np.ones((4, 4))))):
        tree = Tree(mode)
        assert read(card(tree.principled(tree.image(picture).outputs["Alpha"]), name=mode)) == (None, [])
    assert reads == ["picture.001"]
    picture = bpy.data.images.new("plain", 4, 4, alpha=False)
    picture.filepath_raw, picture.file_format = str(tmp_path / "plain.png"), "PNG"
    picture.save()
    loaded = bpy.data.images.load(str(tmp_path / "plain.png"))
    tree = Tree("file")
    assert read(card(tree.principled(tree.image(loaded).outputs["Alpha"]), name="file")) == (None, [])


def test_a_file_is_read_as_well_as_a_packed_image(tmp_path: Path) -> None:
    picture = image(COLOURS * (1.0, 1.0, 1.0, 0.5), space="sRGB")
    picture.filepath_raw, picture.file_format = str(tmp_path / "leaf.png"), "PNG"
    picture.save()
    loaded = bpy.data.images.load(str(tmp_path / "leaf.png"))
    tree = Tree()
    assert_as_cycles(card(tree.mixed(tree.image(loaded).outputs["Color"])))
