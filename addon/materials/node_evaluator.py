"""What numbers and colours of a material's nodes carry over a surface, as Cycles evaluates them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from mathutils import Euler, Matrix

from ...core.base.arrays import Floats
from ...core.scene.image_texture import Wrap
from ..colour_space import srgb_decoded
from ..typed import uid_of
from .image_pixels import ImagePixels, Unreadable, is_associated, is_encoded
from .node_links import Path, SocketSource, socket_source, unread
from .texel_values import Lookup, TexelValues, bent, clipped, constant, divided, even, grey, mapped, mix

_IDENTITY = Matrix.Identity(4)


class NodeEvaluator:
    """Evaluates the sockets of one material. No image is read that does not reach them."""

    def __init__(self, pixels: ImagePixels) -> None:
        self._pixels = pixels

    def number(self, socket: Any, path: Path) -> TexelValues:
        """The values of what feeds a socket, colours as their luminance. Raises Unread."""
        return grey(self._value(socket, path))

    def colour(self, socket: Any, path: Path) -> TexelValues:
        """The values of what feeds a socket, with three channels. Raises Unread."""
        texels = self._value(socket, path)
        if texels.values.ndim == 3:
            return texels
        return replace(texels, values=np.repeat(texels.values[..., np.newaxis], 3, axis=2))

    def _value(self, socket: Any, path: Path) -> TexelValues:
        source = socket_source(socket, path)
        if source.node is None:
            return constant(source.home.default_value)
        handler = _EVALUATORS.get(source.node.type)
        if handler is None:
            raise unread(source.node)
        return handler(self, source)

    def given(self, source: SocketSource) -> TexelValues:
        """A Value or RGB node."""
        return constant(source.output.default_value)

    def light_path(self, source: SocketSource) -> TexelValues:
        """What asks for opacity is a shadow ray, measured, and no other."""
        if not source.output.name.startswith("Is "):
            raise unread(source.node, f"{source.output.name} of a node Light Path")
        return constant(float(source.output.name == "Is Shadow Ray"))

    def texture(self, source: SocketSource) -> TexelValues:
        """An Image Texture's colour or alpha."""
        node = source.node
        if node.image is None:
            raise Unreadable("its Image Texture has no image", "choose one", whole=True)
        uv, matrix = self._layout(node.inputs["Vector"], source.path)
        _check_projection(node)
        lookup = Lookup(
            uid_of(node.image),
            node.interpolation != "Closest",  # Cubic and Smart are a blur of about a texel more
            Wrap[node.extension],
            uv,
            tuple((row[0], row[1], row[3]) for row in matrix[:2]),
        )
        if source.output.name == "Alpha":
            return even(TexelValues(self._pixels.alpha(node.image), lookup))
        texels = even(TexelValues(self._pixels.colour(node.image), lookup))
        if is_associated(node.image) and node.outputs["Alpha"].is_linked:
            texels = bent(divided, texels, even(TexelValues(self._pixels.alpha(node.image), lookup)))
        return bent(srgb_decoded, texels) if is_encoded(node.image) else texels

    def _layout(self, socket: Any, path: Path) -> tuple[str, Matrix]:
        """The UV map that feeds a texture, and what happens to it on the way. Raises Unread."""
        source = socket_source(socket, path)
        node = source.node
        if node is None and source.home == socket:
            return "", _IDENTITY
        if node is not None and node.type == "MAPPING":
            uv, before = self._layout(node.inputs["Vector"], source.path)
            return uv, _mapping(node, source.path) @ before
        kind = "" if node is None else node.type
        if kind == "UVMAP" and not node.from_instancer:
            return node.uv_map, _IDENTITY
        if kind == "TEX_COORD" and source.output.name == "UV" and not node.from_instancer:
            return "", _IDENTITY
        name = "a constant" if node is None else f"{source.output.name} of a node {node.bl_label}"
        raise unread(node, f"an image laid out by {name}")

    def math(self, source: SocketSource) -> TexelValues:
        """A Math node."""
        node = source.node
        function = _MATH.get(node.operation)
        if function is None:
            raise unread(node, f"a node Math set to {node.operation.replace('_', ' ').title()}")
        count = function.__code__.co_argcount
        texels = bent(function, *(self.number(socket, source.path) for socket in node.inputs[:count]))
        return replace(texels, values=clipped(texels.values)) if node.use_clamp else texels

    def mix(self, source: SocketSource) -> TexelValues:
        """A Mix node of numbers or colours, or its forerunner for colours alone."""
        node, numbers = source.node, source.node.type == "MIX" and source.node.data_type == "FLOAT"
        blend = "MIX" if numbers else node.blend_type
        if (node.type == "MIX" and node.data_type not in ("FLOAT", "RGBA")) or blend not in ("MIX", "MULTIPLY"):
            raise unread(node, f"a node Mix set to {blend.replace('_', ' ').title()}")
        read = self.number if numbers else self.colour
        kind = "Float" if numbers else "Color"
        names = ("Factor_Float", f"A_{kind}", f"B_{kind}") if node.type == "MIX" else ("Fac", "Color1", "Color2")
        sockets = {socket.identifier: socket for socket in node.inputs}
        factor = self.number(sockets[names[0]], source.path)
        if node.type == "MIX_RGB" or node.clamp_factor:
            factor = replace(factor, values=clipped(factor.values))
        first, second = (read(sockets[name], source.path) for name in names[1:])
        if blend == "MULTIPLY":
            second = bent(lambda a, b: a * b, first, second)
        texels = mix(factor, first, second)
        clamped = node.use_clamp if node.type == "MIX_RGB" else node.clamp_result and not numbers
        return replace(texels, values=clipped(texels.values)) if clamped else texels

    def invert(self, source: SocketSource) -> TexelValues:
        """An Invert Color node."""
        factor, colour = source.node.inputs
        own = self.colour(colour, source.path)
        return mix(self.number(factor, source.path), own, mapped(lambda c: 1.0 - c, own))

    def ramp(self, source: SocketSource) -> TexelValues:
        """A Color Ramp node, as Cycles' table of 256."""
        ramp = source.node.color_ramp
        table = np.array([ramp.evaluate(i / 255.0)[:] for i in range(256)], dtype=np.float32)
        if source.output.name == "Alpha":
            table = table[:, 3:]
        steady = ramp.interpolation == "CONSTANT"

        def looked_up(values: Floats) -> Any:
            place = 255.0 * np.clip(values, 0.0, 1.0)
            place = np.floor(place) if steady else place
            return np.stack([np.interp(place, np.arange(256, dtype=np.int64), column) for column in table.T], axis=-1)

        texels = bent(looked_up, self.number(source.node.inputs[0], source.path))
        return replace(texels, values=texels.values[..., 0 if source.output.name == "Alpha" else slice(3)])

    def separate(self, source: SocketSource) -> TexelValues:
        """One channel of a colour."""
        if getattr(source.node, "mode", "RGB") != "RGB":
            raise unread(source.node, f"a node {source.node.bl_label} set to {source.node.mode}")
        colour = self.colour(source.node.inputs[0], source.path)
        channel = [socket.identifier for socket in source.node.outputs].index(source.output.identifier)
        return replace(colour, values=np.ascontiguousarray(colour.values[..., channel]))

    def to_grey(self, source: SocketSource) -> TexelValues:
        """An RGB to BW node."""
        return self.number(source.node.inputs[0], source.path)

    def clamp(self, source: SocketSource) -> TexelValues:
        """A Clamp node."""
        value, low, high = (self.number(socket, source.path) for socket in source.node.inputs)
        if source.node.clamp_type == "RANGE":
            low, high = mapped(np.minimum, low, high), mapped(np.maximum, low, high)
        return bent(lambda x, a, b: np.minimum(np.maximum(x, a), b), value, low, high)


def _check_projection(node: Any) -> None:
    """Raises Unread for an image that is not laid out flat by its coordinates as they come."""
    if node.projection != "FLAT":
        raise unread(node, f"an image with the projection {node.projection.title()}")
    own = node.texture_mapping
    plain = (own.vector_type, own.mapping_x, own.mapping_y, own.mapping_z) == ("POINT", "X", "Y", "Z")
    moved = (*own.translation, *own.rotation, *(scale - 1.0 for scale in own.scale))
    if not plain or own.use_min or own.use_max or any(moved):
        raise unread(node, "an image with a texture mapping of its own")


def _mapping(node: Any, path: Path) -> Matrix:
    """A Mapping node's map. Raises Unread where it is linked, or not affine."""
    if node.vector_type == "NORMAL":
        raise unread(node, "an image laid out by a node Mapping set to Normal")
    rotation, scale = (_vector(node, name, path) for name in ("Rotation", "Scale"))
    turned = Euler(rotation, "XYZ").to_matrix().to_4x4()
    if node.vector_type == "VECTOR":
        return turned @ Matrix.Diagonal([*scale, 1.0])
    location = _vector(node, "Location", path)
    if node.vector_type == "TEXTURE":
        shrunk = Matrix.Diagonal([*(1.0 / s if s else 0.0 for s in scale), 1.0])
        return shrunk @ turned.transposed() @ Matrix.Translation([-x for x in location])
    return Matrix.Translation(location) @ turned @ Matrix.Diagonal([*scale, 1.0])


def _vector(node: Any, name: str, path: Path) -> tuple[float, ...]:
    source = socket_source(node.inputs[name], path)
    value = None if source.node is not None else source.home.default_value
    if value is None:
        raise unread(node, "an image laid out by a node Mapping with links")
    return (value,) * 3 if isinstance(value, float) else tuple(value)[:3]


_EVALUATORS: dict[str, Callable[[NodeEvaluator, SocketSource], TexelValues]] = {
    "VALUE": NodeEvaluator.given,
    "RGB": NodeEvaluator.given,
    "LIGHT_PATH": NodeEvaluator.light_path,
    "TEX_IMAGE": NodeEvaluator.texture,
    "MATH": NodeEvaluator.math,
    "MIX": NodeEvaluator.mix,
    "MIX_RGB": NodeEvaluator.mix,
    "INVERT": NodeEvaluator.invert,
    "VALTORGB": NodeEvaluator.ramp,
    "SEPARATE_COLOR": NodeEvaluator.separate,
    "SEPRGB": NodeEvaluator.separate,
    "RGBTOBW": NodeEvaluator.to_grey,
    "CLAMP": NodeEvaluator.clamp,
}

_MATH: dict[str, Callable[..., Any]] = {
    "ADD": lambda a, b: a + b,
    "SUBTRACT": lambda a, b: a - b,
    "MULTIPLY": lambda a, b: a * b,
    "MULTIPLY_ADD": lambda a, b, c: a * b + c,
    "DIVIDE": lambda a, b: a / b,  # by 0: 0, as all that is no number
    "POWER": lambda a, b: a**b,
    "ABSOLUTE": lambda a: np.abs(a),
    "MINIMUM": lambda a, b: np.minimum(a, b),
    "MAXIMUM": lambda a, b: np.maximum(a, b),
    "LESS_THAN": lambda a, b: a < b,
    "GREATER_THAN": lambda a, b: a > b,
    "ROUND": lambda a: np.floor(a + 0.5),
}
