"""What numbers and colours of a material's nodes carry over a surface, as Cycles evaluates them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from mathutils import Euler, Matrix

from ...core.scene.image_texture import Wrap
from ...core.scene.scene import Floats
from .image_pixels import Pictures, Unread, is_associated, is_encoded
from .node_links import Feed, Path, feeding, unread
from .texel_values import Field, Lookup, bent, clipped, constant, decoded, divided, even, grey, mapped, mix

_IDENTITY = Matrix.Identity(4)


class Values:
    """Evaluates the sockets of one material. No image is read that does not reach them."""

    def __init__(self, pictures: Pictures) -> None:
        self._pictures = pictures

    def number(self, socket: Any, path: Path) -> Field:
        """The field of what feeds a socket, colours as their luminance. Raises Unread."""
        return grey(self._value(socket, path))

    def colour(self, socket: Any, path: Path) -> Field:
        """The field of what feeds a socket, with three channels. Raises Unread."""
        field = self._value(socket, path)
        if field.values.ndim == 3:
            return field
        return replace(field, values=np.repeat(field.values[..., np.newaxis], 3, axis=2))

    def _value(self, socket: Any, path: Path) -> Field:
        feed = feeding(socket, path)
        if feed.node is None:
            return constant(feed.home.default_value)
        handler = _VALUES.get(feed.node.type)
        if handler is None:
            raise unread(feed.node)
        return handler(self, feed)

    def given(self, feed: Feed) -> Field:
        """A Value or RGB node."""
        return constant(feed.output.default_value)

    def light_path(self, feed: Feed) -> Field:
        """What asks for opacity is a shadow ray, measured, and no other."""
        if not feed.output.name.startswith("Is "):
            raise unread(feed.node, f"{feed.output.name} of a node Light Path")
        return constant(float(feed.output.name == "Is Shadow Ray"))

    def texture(self, feed: Feed) -> Field:
        """An Image Texture's colour or alpha."""
        node = feed.node
        if node.image is None:
            raise Unread("its Image Texture has no image", "choose one", whole=True)
        uv, matrix = self._layout(node.inputs["Vector"], feed.path)
        _check_projection(node)
        lookup = Lookup(
            node.image.name_full,
            node.interpolation != "Closest",  # Cubic and Smart are a blur of about a texel more
            Wrap[node.extension],
            uv,
            tuple((row[0], row[1], row[3]) for row in matrix[:2]),
        )
        if feed.output.name == "Alpha":
            return even(Field(self._pictures.alpha(node.image), lookup))
        field = even(Field(self._pictures.colour(node.image), lookup))
        if is_associated(node.image) and node.outputs["Alpha"].is_linked:
            field = bent(divided, field, even(Field(self._pictures.alpha(node.image), lookup)))
        return bent(decoded, field) if is_encoded(node.image) else field

    def _layout(self, socket: Any, path: Path) -> tuple[str, Matrix]:
        """The UV map that feeds a texture, and what happens to it on the way. Raises Unread."""
        feed = feeding(socket, path)
        node = feed.node
        if node is None and feed.home == socket:
            return "", _IDENTITY
        if node is not None and node.type == "MAPPING":
            uv, before = self._layout(node.inputs["Vector"], feed.path)
            return uv, _mapping(node, feed.path) @ before
        kind = "" if node is None else node.type
        if kind == "UVMAP" and not node.from_instancer:
            return node.uv_map, _IDENTITY
        if kind == "TEX_COORD" and feed.output.name == "UV" and not node.from_instancer:
            return "", _IDENTITY
        name = "a constant" if node is None else f"{feed.output.name} of a node {node.bl_label}"
        raise unread(node, f"an image laid out by {name}")

    def math(self, feed: Feed) -> Field:
        """A Math node."""
        node = feed.node
        function = _MATH.get(node.operation)
        if function is None:
            raise unread(node, f"a node Math set to {node.operation.replace('_', ' ').title()}")
        count = function.__code__.co_argcount
        field = bent(function, *(self.number(socket, feed.path) for socket in node.inputs[:count]))
        return replace(field, values=clipped(field.values)) if node.use_clamp else field

    def mix(self, feed: Feed) -> Field:
        """A Mix node of numbers or colours, or its forerunner for colours alone."""
        node, numbers = feed.node, feed.node.type == "MIX" and feed.node.data_type == "FLOAT"
        blend = "MIX" if numbers else node.blend_type
        if (node.type == "MIX" and node.data_type not in ("FLOAT", "RGBA")) or blend not in ("MIX", "MULTIPLY"):
            raise unread(node, f"a node Mix set to {blend.replace('_', ' ').title()}")
        read = self.number if numbers else self.colour
        kind = "Float" if numbers else "Color"
        names = ("Factor_Float", f"A_{kind}", f"B_{kind}") if node.type == "MIX" else ("Fac", "Color1", "Color2")
        sockets = {socket.identifier: socket for socket in node.inputs}
        factor = self.number(sockets[names[0]], feed.path)
        if node.type == "MIX_RGB" or node.clamp_factor:
            factor = replace(factor, values=clipped(factor.values))
        first, second = (read(sockets[name], feed.path) for name in names[1:])
        if blend == "MULTIPLY":
            second = bent(lambda a, b: a * b, first, second)
        field = mix(factor, first, second)
        clamped = node.use_clamp if node.type == "MIX_RGB" else node.clamp_result and not numbers
        return replace(field, values=clipped(field.values)) if clamped else field

    def invert(self, feed: Feed) -> Field:
        """An Invert Color node."""
        factor, colour = feed.node.inputs
        own = self.colour(colour, feed.path)
        return mix(self.number(factor, feed.path), own, mapped(lambda c: 1.0 - c, own))

    def ramp(self, feed: Feed) -> Field:
        """A Color Ramp node, as Cycles' table of 256."""
        ramp = feed.node.color_ramp
        table = np.array([ramp.evaluate(i / 255.0)[:] for i in range(256)], dtype=np.float32)
        if feed.output.name == "Alpha":
            table = table[:, 3:]
        steady = ramp.interpolation == "CONSTANT"

        def looked_up(values: Floats) -> Any:
            place = 255.0 * np.clip(values, 0.0, 1.0)
            place = np.floor(place) if steady else place
            return np.stack([np.interp(place, np.arange(256), column) for column in table.T], axis=-1)

        field = bent(looked_up, self.number(feed.node.inputs[0], feed.path))
        return replace(field, values=field.values[..., 0 if feed.output.name == "Alpha" else slice(3)])

    def separate(self, feed: Feed) -> Field:
        """One channel of a colour."""
        if getattr(feed.node, "mode", "RGB") != "RGB":
            raise unread(feed.node, f"a node {feed.node.bl_label} set to {feed.node.mode}")
        colour = self.colour(feed.node.inputs[0], feed.path)
        channel = [socket.identifier for socket in feed.node.outputs].index(feed.output.identifier)
        return replace(colour, values=np.ascontiguousarray(colour.values[..., channel]))

    def to_grey(self, feed: Feed) -> Field:
        """An RGB to BW node."""
        return self.number(feed.node.inputs[0], feed.path)

    def clamp(self, feed: Feed) -> Field:
        """A Clamp node."""
        value, low, high = (self.number(socket, feed.path) for socket in feed.node.inputs)
        if feed.node.clamp_type == "RANGE":
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
    feed = feeding(node.inputs[name], path)
    value = None if feed.node is not None else feed.home.default_value
    if value is None:
        raise unread(node, "an image laid out by a node Mapping with links")
    return (value,) * 3 if isinstance(value, float) else tuple(value)[:3]


_VALUES: dict[str, Callable[[Values, Feed], Field]] = {
    "VALUE": Values.given,
    "RGB": Values.given,
    "LIGHT_PATH": Values.light_path,
    "TEX_IMAGE": Values.texture,
    "MATH": Values.math,
    "MIX": Values.mix,
    "MIX_RGB": Values.mix,
    "INVERT": Values.invert,
    "VALTORGB": Values.ramp,
    "SEPARATE_COLOR": Values.separate,
    "SEPRGB": Values.separate,
    "RGBTOBW": Values.to_grey,
    "CLAMP": Values.clamp,
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
