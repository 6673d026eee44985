"""RO for the view that is rendered, in a material: the nodes of `rebuild.glsl` for the numbers of degree 3.

One group holds all that is the same for every object: the reflected direction in the frame of the texel, the lobe's
terms from their image, and the sum. An object's own are four images of its numbers, which go into the group.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import pi, sqrt
from typing import Any

import bpy
import numpy as np

from ...core.base.errors import InputError
from ...core.spherical.directional_format import DirectionalFormat
from ...core.spherical.lobe_lut import DEGREE, PADDED, SIDE, TILES, lobe_splines
from ..typed import pixels_in
from .ownership import MARK

GROUP, LOBES = "Occlusion Bake RO", "Occlusion Bake lobes"
IMAGES = 4  # of four numbers each
CODE = DirectionalFormat("sh", DEGREE).name
CODES = tuple(f"{CODE}_{number}" for number in range(IMAGES))  # what these are called among an object's
NORMAL = "Normal"  # the input of that name
_EXPONENT = 10.0
_SPLINES = "lobe splines"  # marks their image; an older file's "lobes" is another
# Colours that a Normal Map node takes for the axes of the tangent frame: 0.5 is 0.
_TANGENT, _BITANGENT = (1.0, 0.5, 0.5, 1.0), (0.5, 1.0, 0.5, 1.0)


def add_rebuild(tree: Any, images: Sequence[bpy.types.Image], uv: str) -> Any:
    """Add a group node whose outputs are RO, the open horizon and RO over it, of the object's numbers.

    tree: of a material. images: four of floats, Non-Color, R, G, B and A the numbers of degree 3 in order. uv: the UV
    map that they were baked onto. The exponent is an input of the node, and so is the normal that they were baked
    about, in world space: without one it is the surface's own. Raises InputError for another number of images.
    """
    if len(images) != IMAGES:
        raise InputError(f"RO nodes: {len(images)} images of numbers; give the {IMAGES} of degree 3 (sh_3)")
    place = tree.nodes.new("ShaderNodeUVMap")
    place.location = (-650.0, 0.0)
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = _group(uv)
    for number in range(IMAGES):
        texture = tree.nodes.new("ShaderNodeTexImage")
        texture.location = (-400.0, -280.0 * number)
        tree.links.new(place.outputs["UV"], texture.inputs["Vector"])
        for output, name in (("Color", _colour(number)), ("Alpha", _alpha(number))):
            tree.links.new(texture.outputs[output], node.inputs[name])
    set_rebuild(node, images, uv)
    return node


def set_rebuild(node: Any, images: Sequence[bpy.types.Image], uv: str) -> None:
    """Give the node of `add_rebuild` other images and another UV map; what the artist unlinked stays so."""
    node.node_tree = _group(uv)
    for number, image in enumerate(images):
        image.alpha_mode = "CHANNEL_PACKED"  # the fourth is a number like the others
        for texture in _linked(node.inputs[_colour(number)], "TEX_IMAGE"):
            texture.image = image
            for place in _linked(texture.inputs["Vector"], "UVMAP"):
                place.uv_map = uv


def _linked(socket: Any, kind: str) -> list[Any]:
    """The node of this type that is linked to an input, if there is one."""
    return [link.from_node for link in socket.links if link.from_node.type == kind]


def _colour(number: int) -> str:
    return f"Numbers {4 * number} to {4 * number + 2}"


def _alpha(number: int) -> str:
    return f"Number {4 * number + 3}"


def lobe_texture() -> bpy.types.Image:
    """`lobe_splines` as an image of the file, packed, its first row at the bottom."""
    found = next((each for each in bpy.data.images if each.get(MARK) == _SPLINES and each.library is None), None)
    if found is not None:
        return found
    image = bpy.data.images.new(LOBES, TILES * PADDED, PADDED, alpha=False, float_buffer=True, is_data=True)
    image[MARK] = _SPLINES
    image.use_half_precision = False  # on the graphics card, where it would cost a thousandth
    pixels = np.ones((PADDED, TILES * PADDED, 4), dtype=np.float32)
    pixels[..., :3] = lobe_splines()
    pixels_in(image).foreach_set(pixels.ravel())
    image.update()
    image.pack()
    return image


def _group(uv: str) -> Any:
    """The group for one name of UV map, whose tangents it takes; made where there is none."""
    mark = f"ro by splines/{uv}"
    found = next((each for each in bpy.data.node_groups if each.get(MARK) == mark and each.library is None), None)
    if found is not None:
        return found
    group: Any = bpy.data.node_groups.new(GROUP, "ShaderNodeTree")
    group[MARK] = mark
    for number in range(IMAGES):
        group.interface.new_socket(_colour(number), in_out="INPUT", socket_type="NodeSocketColor")
        group.interface.new_socket(_alpha(number), in_out="INPUT", socket_type="NodeSocketFloat")
    exponent = group.interface.new_socket("Exponent", in_out="INPUT", socket_type="NodeSocketFloat")
    exponent.default_value, exponent.min_value = _EXPONENT, 0.0
    normal = group.interface.new_socket(NORMAL, in_out="INPUT", socket_type="NodeSocketVector")
    normal.hide_value = True
    for name in ("RO", "Open Horizon", "RO over Horizon"):
        group.interface.new_socket(name, in_out="OUTPUT", socket_type="NodeSocketFloat")
    _Nodes(group).fill(uv)
    return group


class _Nodes:
    """Formulas as nodes: operands are sockets or numbers, and so are results."""

    def __init__(self, group: Any) -> None:
        self._group = group
        self._count = 0

    def fill(self, uv: str) -> None:
        """All nodes of the group."""
        given = self._new("NodeGroupInput")
        numbers: list[Any] = []
        for number in range(IMAGES):
            numbers += [*self._channels(given.outputs[_colour(number)]), given.outputs[_alpha(number)]]
        x, y, z = self._reflected(uv, given.outputs[NORMAL])
        terms = self._terms(z, given.outputs["Exponent"])
        open_horizon = self._math("MULTIPLY", terms[0, 0], sqrt(4.0 * pi))
        whole = self._sum(numbers, terms, x, y)
        ro = self._math("MINIMUM", self._math("MAXIMUM", whole, 0.0), open_horizon)
        result = self._new("NodeGroupOutput")
        self._link(ro, result.inputs["RO"])
        self._link(open_horizon, result.inputs["Open Horizon"])
        self._link(self._math("DIVIDE", ro, open_horizon), result.inputs["RO over Horizon"])

    def _reflected(self, uv: str, given: Any) -> tuple[Any, Any, Any]:
        """R = (−v·t, −v·b, v·n), t made upright on the normal, b as handed as the UVs; v·n 0 at least."""
        surface = self._new("ShaderNodeNewGeometry")
        own, view = surface.outputs["Normal"], surface.outputs["Incoming"]
        is_given = self._math("GREATER_THAN", self._vector("DOT_PRODUCT", given, given), 0.25)
        normal = self._vector("ADD", own, self._vector("SCALE", self._vector("SUBTRACT", given, own), scale=is_given))
        tangent, bitangent = self._axis(uv, _TANGENT), self._axis(uv, _BITANGENT)
        along = self._vector("SCALE", normal, scale=self._vector("DOT_PRODUCT", tangent, normal))
        upright = self._vector("NORMALIZE", self._vector("SUBTRACT", tangent, along))
        across = self._vector("CROSS_PRODUCT", normal, upright)
        handed = self._math("SIGN", self._vector("DOT_PRODUCT", across, bitangent))
        x = self._math("MULTIPLY", self._vector("DOT_PRODUCT", view, upright), -1.0)
        y = self._math("MULTIPLY", self._vector("DOT_PRODUCT", view, across), self._math("MULTIPLY", handed, -1.0))
        return x, y, self._math("MAXIMUM", self._vector("DOT_PRODUCT", view, normal), 0.0)

    def _axis(self, uv: str, colour: tuple[float, float, float, float]) -> Any:
        """An axis of the tangent frame in world space, its sign included, which no other node tells."""
        node = self._new("ShaderNodeNormalMap")
        node.space, node.uv_map = "TANGENT", uv
        node.inputs["Color"].default_value = colour
        return node.outputs["Normal"]

    def _terms(self, cosine: Any, exponent: Any) -> dict[tuple[int, int], Any]:
        """f_lm of `lobe_image`, from their splines: of "Linear" EEVEE takes mip maps, which blur the lobe over the
        cosines of neighbouring pixels and its terms into one another; of "Cubic" it takes none."""
        width = self._math("SQRT", self._math("DIVIDE", 2.0, self._math("ADD", exponent, 2.0)))
        across, down = (self._math("MULTIPLY_ADD", each, (SIDE - 1) / PADDED, 1.5 / PADDED) for each in (cosine, width))
        found: list[Any] = []
        for tile in range(TILES):
            place = self._new("ShaderNodeCombineXYZ")
            self._link(self._math("MULTIPLY_ADD", across, 1.0 / TILES, tile / TILES), place.inputs["X"])
            self._link(down, place.inputs["Y"])
            texture = self._new("ShaderNodeTexImage")
            texture.image, texture.interpolation, texture.extension = lobe_texture(), "Cubic", "EXTEND"
            self._link(place.outputs["Vector"], texture.inputs["Vector"])
            found += self._channels(texture.outputs["Color"])
        return dict(zip(((l, m) for m in range(4) for l in range(m, 4)), found, strict=False))  # noqa: E741

    def _sum(self, numbers: Sequence[Any], terms: dict[tuple[int, int], Any], x: Any, y: Any) -> Any:
        """Σ f_lm (c_l,m Re (x + iy)^m + c_l,−m Im (x + iy)^m)."""
        power: tuple[Any, Any] = (1.0, 0.0)
        whole: Any = 0.0
        for m in range(4):
            if m:
                power = self._times(power, (x, y)) if m > 1 else (x, y)
            for l in range(m, 4):  # noqa: E741
                about = self._math("MULTIPLY", numbers[l * (l + 1) + m], power[0])
                if m:
                    about = self._math("MULTIPLY_ADD", numbers[l * (l + 1) - m], power[1], about)
                whole = self._math("MULTIPLY_ADD", terms[l, m], about, whole)
        return whole

    def _times(self, a: tuple[Any, Any], b: tuple[Any, Any]) -> tuple[Any, Any]:
        """The product of complex numbers."""
        real = self._math("SUBTRACT", self._math("MULTIPLY", a[0], b[0]), self._math("MULTIPLY", a[1], b[1]))
        return real, self._math("MULTIPLY_ADD", a[0], b[1], self._math("MULTIPLY", a[1], b[0]))

    def _math(self, operation: str, *operands: Any) -> Any:
        node = self._new("ShaderNodeMath")
        node.operation = operation
        for operand, socket in zip(operands, node.inputs, strict=False):
            self._link(operand, socket)
        return node.outputs[0]

    def _vector(self, operation: str, *operands: Any, scale: Any = None) -> Any:
        node = self._new("ShaderNodeVectorMath")
        node.operation = operation
        for operand, socket in zip(operands, node.inputs, strict=False):
            self._link(operand, socket)
        if scale is not None:
            self._link(scale, node.inputs["Scale"])
        return node.outputs["Value" if operation == "DOT_PRODUCT" else "Vector"]

    def _channels(self, colour: Any) -> list[Any]:
        node = self._new("ShaderNodeSeparateColor")
        self._link(colour, node.inputs["Color"])
        return list(node.outputs)

    def _link(self, operand: Any, socket: Any) -> None:
        if isinstance(operand, bpy.types.NodeSocket):
            self._group.links.new(operand, socket)
        else:
            socket.default_value = operand

    def _new(self, kind: str) -> Any:
        node = self._group.nodes.new(kind)
        node.location = (180.0 * (self._count % 12), -200.0 * (self._count // 12))
        self._count += 1
        return node
