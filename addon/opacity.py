"""What a material lets through, read from its nodes as Cycles evaluates them for a shadow ray.

Only what reaches the opacity is followed. It is held as a field: values, and how a surface looks them up. Nodes work on
the texels of one picture; two pictures that are laid out differently cannot be combined, and are not read.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np
from mathutils import Euler, Matrix
from numpy.typing import NDArray

from ..core.cutout import Alpha, Wrap, sampled
from ..core.scene import Floats
from .pictures import Pictures, Unread, is_encoded

# What is not a straight line of the values looked up, as a threshold, comes after interpolation in Cycles. Small
# pictures are made finer before, by an odd number so that every old texel's middle stays one, up to this many texels.
_FINE, _FINEST = 1536, 9
_GREY = np.array((0.2126729, 0.7151522, 0.0721750), dtype=np.float32)  # luminance of linear Rec. 709
_CURE = "bake its opacity into an image, and use that"
_IDENTITY = Matrix.Identity(4)

_Path = tuple[Any, ...]  # the group nodes that lead to a node, outermost first


@dataclass(frozen=True)
class Lookup:
    """How a picture lies on a surface. uv: the UV map, "" the one for renders. matrix: (2, 3), from (u, v, 1) to the
    picture's own."""

    image: str
    linear: bool
    wrap: Wrap
    uv: str
    matrix: tuple[tuple[float, ...], ...]


@dataclass(frozen=True, eq=False)
class Field:
    """What a socket carries over a surface. values: (h, w) float32, or (h, w, 3) for colours, row 0 at the top; of size
    (1, 1) without a lookup."""

    values: Floats
    lookup: Lookup | None = None

    def is_all(self, value: float) -> bool:
        """Whether it is this constant."""
        return self.lookup is None and bool((self.values == value).all())


@dataclass(frozen=True)
class Opacity:
    """What a material lets through. note: what of it is taken for something else, in words that fit after its name."""

    field: Field
    note: str = ""


def opacity_of(material: bpy.types.Material | None, pictures: Pictures) -> Opacity:
    """A material's opacity to shadow rays: a field of values from 0 to 1. Raises Unread."""
    tree = None if material is None or not material.use_transparent_shadow else _tree(material)
    output = None if tree is None else tree.get_output_node("CYCLES")
    if output is None:
        return Opacity(_constant(1.0))
    surface, volume = (_feed(output.inputs[name], ()) for name in ("Surface", "Volume"))
    if surface.node is None and volume.node is not None:
        return Opacity(_constant(0.0), "it is a volume alone; light passes through it as if it were clear")
    reader = _Reader(pictures)
    field = reader.shader(output.inputs["Surface"], ())
    return Opacity(replace(field, values=_clipped(field.values)), reader.note)


def _tree(material: bpy.types.Material) -> Any:
    """Its nodes, None where it has none; from 5.0 on they always count."""
    return material.node_tree if bpy.app.version >= (5, 0) or material.use_nodes else None


def _clipped(values: Floats) -> Floats:
    """From 0 to 1; the same array where it is so already, for others to share."""
    inside = values.min() >= 0.0 and values.max() <= 1.0
    return values if inside else np.clip(values, np.float32(0.0), np.float32(1.0))


# Links


@dataclass(frozen=True)
class _Feed:
    """What feeds an input: an output of a node, or without a node the value of the socket `home`."""

    home: Any
    node: Any
    output: Any
    path: _Path


def _feed(socket: Any, path: _Path) -> _Feed:
    """Follow an input's link through reroutes, muted nodes and the walls of groups."""
    home = socket
    while True:
        link = next((each for each in socket.links if each.is_valid and not each.is_muted), None)
        if link is None:
            return _Feed(home, None, None, path)
        node, output = link.from_node, link.from_socket
        if node.mute or node.type == "REROUTE":
            socket = _through(node, output)
            if socket is None:
                return _Feed(home, None, None, path)
        elif node.type == "GROUP" and node.node_tree is not None:
            path = (*path, node)
            home = socket = _same(_group_output(node), output)
        elif node.type == "GROUP_INPUT":
            home = socket = _same(path[-1].inputs, output)
            path = path[:-1]
        else:
            return _Feed(home, node, output, path)


def _through(node: Any, output: Any) -> Any:
    """The input that a muted node or a reroute hands on, None where there is none."""
    if node.type == "REROUTE":
        return node.inputs[0]
    return next((link.from_socket for link in node.internal_links if link.to_socket == output), None)


def _group_output(group: Any) -> Any:
    nodes = [node for node in group.node_tree.nodes if node.type == "GROUP_OUTPUT"]
    active = next((node for node in nodes if node.is_active_output), None)
    if active is None:
        raise _unread(group)
    return active.inputs


def _same(sockets: Sequence[Any], socket: Any) -> Any:
    """The socket on the other side of a group's wall."""
    return next(each for each in sockets if each.identifier == socket.identifier)


def _unread(node: Any, what: str = "") -> Unread:
    kind = what or f"a node {node.bl_label}"
    return Unread(f"what reaches its alpha is {kind}, which is not read", _CURE)


# Fields


def _constant(value: Any) -> Field:
    """A number, or the first three of a colour or a vector."""
    numbers = np.asarray(value, dtype=np.float32).reshape(1, 1, -1)
    return Field(numbers[..., 0] if numbers.size == 1 else numbers[..., :3])


def _mapped(function: Callable[..., Any], *fields: Field) -> Field:
    """A function of each texel. Raises Unread where they are not those of one picture."""
    fields = tuple(_unclipped(field) for field in fields)
    lookups = {field.lookup for field in fields if field.lookup is not None}
    if len(lookups) > 1:
        raise Unread("what reaches its alpha is more than one image, which is not read", _CURE)
    most = max(len(field.values) for field in fields)
    arrays = [_repeated(field, most).values for field in fields]
    if any(array.ndim == 3 for array in arrays):
        arrays = [array[..., np.newaxis] if array.ndim == 2 else array for array in arrays]
    with np.errstate(all="ignore"):
        values = np.nan_to_num(np.asarray(function(*arrays), dtype=np.float32), nan=0.0, posinf=0.0, neginf=0.0)
    return Field(values, next(iter(lookups), None))


def _bent(function: Callable[..., Any], *fields: Field) -> Field:
    """`_mapped` for a function that does not go through interpolation unchanged."""
    return _mapped(function, *(_finer(_unclipped(field)) for field in fields))


def _repeated(field: Field, height: int) -> Field:
    """As fine as the other field of the same picture."""
    return field if field.lookup is None or len(field.values) == height else _finer(field)


def _finer(field: Field) -> Field:
    size = max(field.values.shape[:2])
    times = min(_FINE // size, _FINEST) - 1 | 1
    if field.lookup is None or not field.lookup.linear or times < 2:
        return field
    height, width = (times * n for n in field.values.shape[:2])
    v, u = np.meshgrid(1.0 - (np.arange(height) + 0.5) / height, (np.arange(width) + 0.5) / width, indexing="ij")
    places = np.stack([u, v], axis=-1).reshape(-1, 2)
    layers = np.moveaxis(np.atleast_3d(field.values), 2, 0)
    finer = [sampled(Alpha(layer, True, field.lookup.wrap), places).reshape(height, width) for layer in layers]
    return replace(field, values=finer[0] if field.values.ndim == 2 else np.stack(finer, axis=-1))


def _unclipped(field: Field) -> Field:
    """The same with an edge of clear texels that is extended: what a function makes of them then counts beyond it."""
    lookup = field.lookup
    if lookup is None or lookup.wrap != Wrap.CLIP:
        return field
    height, width = field.values.shape[:2]
    shrunk = tuple(
        (a * n / (n + 2), b * n / (n + 2), (c * n + 1) / (n + 2))
        for (a, b, c), n in zip(lookup.matrix, (width, height), strict=True)
    )
    values = np.pad(field.values, ((1, 1), (1, 1), (0, 0))[: field.values.ndim])
    return Field(values, replace(lookup, wrap=Wrap.EXTEND, matrix=shrunk))


def _grey(field: Field) -> Field:
    """A colour as a number."""
    return field if field.values.ndim == 2 else replace(field, values=field.values @ _GREY)


def _mix(factor: Field, first: Field, second: Field) -> Field:
    """From the first to the second, as the factor goes from 0 to 1."""
    if first.is_all(0.0) and second.is_all(1.0):
        return factor
    varying = sum(field.lookup is not None for field in (factor, first, second))
    apply = _mapped if varying == 1 else _bent
    return apply(lambda f, a, b: a * (np.float32(1.0) - f) + b * f, factor, first, second)


def _decoded(values: NDArray[Any]) -> NDArray[Any]:
    """Linear values of sRGB's (IEC 61966-2-1)."""
    return np.where(values < 0.04045, values / 12.92, ((np.maximum(values, 0.0) + 0.055) / 1.055) ** 2.4)


# Nodes


class _Reader:
    """Evaluates the sockets of one material. note: as of `Opacity`."""

    def __init__(self, pictures: Pictures) -> None:
        self.note = ""
        self._pictures = pictures

    def shader(self, socket: Any, path: _Path) -> Field:
        """The opacity of what feeds a shader socket. Raises Unread."""
        feed = _feed(socket, path)
        if feed.node is None:
            return _constant(1.0)
        handler = _SHADERS.get(feed.node.type)
        if handler is not None:
            return handler(self, feed)
        if feed.node.type in _OPAQUE or feed.node.type.startswith("BSDF_"):
            return _constant(1.0)
        raise _unread(feed.node)

    def principled(self, feed: _Feed) -> Field:
        """Its alpha."""
        alpha = self.number(feed.node.inputs["Alpha"], feed.path)
        return replace(alpha, values=_clipped(alpha.values))

    def transparent(self, feed: _Feed) -> Field:
        """Clear where white. A colour would tint the light; here it is as dark as it looks."""
        colour = self.colour(feed.node.inputs["Color"], feed.path)
        if np.ptp(colour.values, axis=2).max() > 1e-3:
            self.note = "its transparency is coloured; light passes as if it were grey"
        return _mapped(lambda grey: 1.0 - np.clip(grey, 0.0, 1.0), _grey(colour))

    def mix_shader(self, feed: _Feed) -> Field:
        """Between its two shaders; one that does not count is not read."""
        factor, first, second = feed.node.inputs
        share = self.number(factor, feed.path)
        share = replace(share, values=_clipped(share.values))
        if share.is_all(0.0) or share.is_all(1.0):
            return self.shader(first if share.is_all(0.0) else second, feed.path)
        return _mix(share, self.shader(first, feed.path), self.shader(second, feed.path))

    def add_shader(self, feed: _Feed) -> Field:
        """What either lets through."""
        first, second = (self.shader(socket, feed.path) for socket in feed.node.inputs)
        if first.is_all(1.0) and second.is_all(1.0):
            return first
        return _bent(lambda a, b: np.maximum(a + b - 1.0, 0.0), first, second)

    def number(self, socket: Any, path: _Path) -> Field:
        """The field of what feeds a socket, colours as their luminance. Raises Unread."""
        return _grey(self._value(socket, path))

    def colour(self, socket: Any, path: _Path) -> Field:
        """The field of what feeds a socket, with three channels. Raises Unread."""
        field = self._value(socket, path)
        if field.values.ndim == 3:
            return field
        return replace(field, values=np.repeat(field.values[..., np.newaxis], 3, axis=2))

    def _value(self, socket: Any, path: _Path) -> Field:
        feed = _feed(socket, path)
        if feed.node is None:
            return _constant(feed.home.default_value)
        handler = _VALUES.get(feed.node.type)
        if handler is None:
            raise _unread(feed.node)
        return handler(self, feed)

    def given(self, feed: _Feed) -> Field:
        """A Value or RGB node."""
        return _constant(feed.output.default_value)

    def light_path(self, feed: _Feed) -> Field:
        """What asks for opacity is a shadow ray, measured, and no other."""
        if not feed.output.name.startswith("Is "):
            raise _unread(feed.node, f"{feed.output.name} of a node Light Path")
        return _constant(float(feed.output.name == "Is Shadow Ray"))

    def texture(self, feed: _Feed) -> Field:
        """An Image Texture's colour or alpha."""
        node = feed.node
        if node.image is None:
            raise Unread("its Image Texture has no image", "choose one")
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
            return _even(Field(self._pictures.alpha(node.image), lookup))
        field = _even(Field(self._pictures.colour(node.image, straight=node.outputs["Alpha"].is_linked), lookup))
        return _bent(_decoded, field) if is_encoded(node.image) else field

    def _layout(self, socket: Any, path: _Path) -> tuple[str, Matrix]:
        """The UV map that feeds a texture, and what happens to it on the way. Raises Unread."""
        feed = _feed(socket, path)
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
        raise _unread(node, f"an image laid out by {name}")

    def math(self, feed: _Feed) -> Field:
        """A Math node."""
        node = feed.node
        function = _MATH.get(node.operation)
        if function is None:
            raise _unread(node, f"a node Math set to {node.operation.replace('_', ' ').title()}")
        count = function.__code__.co_argcount
        field = _bent(function, *(self.number(socket, feed.path) for socket in node.inputs[:count]))
        return replace(field, values=_clipped(field.values)) if node.use_clamp else field

    def mix(self, feed: _Feed) -> Field:
        """A Mix node of numbers or colours, or its forerunner for colours alone."""
        node, numbers = feed.node, feed.node.type == "MIX" and feed.node.data_type == "FLOAT"
        blend = "MIX" if numbers else node.blend_type
        if (node.type == "MIX" and node.data_type not in ("FLOAT", "RGBA")) or blend not in ("MIX", "MULTIPLY"):
            raise _unread(node, f"a node Mix set to {blend.replace('_', ' ').title()}")
        read = self.number if numbers else self.colour
        kind = "Float" if numbers else "Color"
        names = ("Factor_Float", f"A_{kind}", f"B_{kind}") if node.type == "MIX" else ("Fac", "Color1", "Color2")
        sockets = {socket.identifier: socket for socket in node.inputs}
        factor = self.number(sockets[names[0]], feed.path)
        if node.type == "MIX_RGB" or node.clamp_factor:
            factor = replace(factor, values=_clipped(factor.values))
        first, second = (read(sockets[name], feed.path) for name in names[1:])
        if blend == "MULTIPLY":
            second = _bent(lambda a, b: a * b, first, second)
        field = _mix(factor, first, second)
        clamped = node.use_clamp if node.type == "MIX_RGB" else node.clamp_result and not numbers
        return replace(field, values=_clipped(field.values)) if clamped else field

    def invert(self, feed: _Feed) -> Field:
        """An Invert Color node."""
        factor, colour = feed.node.inputs
        own = self.colour(colour, feed.path)
        return _mix(self.number(factor, feed.path), own, _mapped(lambda c: 1.0 - c, own))

    def ramp(self, feed: _Feed) -> Field:
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

        field = _bent(looked_up, self.number(feed.node.inputs[0], feed.path))
        return replace(field, values=field.values[..., 0 if feed.output.name == "Alpha" else slice(3)])

    def separate(self, feed: _Feed) -> Field:
        """One channel of a colour."""
        if getattr(feed.node, "mode", "RGB") != "RGB":
            raise _unread(feed.node, f"a node {feed.node.bl_label} set to {feed.node.mode}")
        colour = self.colour(feed.node.inputs[0], feed.path)
        channel = [socket.identifier for socket in feed.node.outputs].index(feed.output.identifier)
        return replace(colour, values=np.ascontiguousarray(colour.values[..., channel]))

    def to_grey(self, feed: _Feed) -> Field:
        """An RGB to BW node."""
        return self.number(feed.node.inputs[0], feed.path)

    def clamp(self, feed: _Feed) -> Field:
        """A Clamp node."""
        value, low, high = (self.number(socket, feed.path) for socket in feed.node.inputs)
        if feed.node.clamp_type == "RANGE":
            low, high = _mapped(np.minimum, low, high), _mapped(np.maximum, low, high)
        return _bent(lambda x, a, b: np.minimum(np.maximum(x, a), b), value, low, high)


def _even(field: Field) -> Field:
    """A picture that is one value as that value."""
    first = field.values[:1, :1]
    clipped = field.lookup is not None and field.lookup.wrap == Wrap.CLIP
    return field if clipped or (field.values != first).any() else Field(first.copy())


def _check_projection(node: Any) -> None:
    """Raises Unread for an image that is not laid out flat by its coordinates as they come."""
    if node.projection != "FLAT":
        raise _unread(node, f"an image with the projection {node.projection.title()}")
    own = node.texture_mapping
    plain = (own.vector_type, own.mapping_x, own.mapping_y, own.mapping_z) == ("POINT", "X", "Y", "Z")
    moved = (*own.translation, *own.rotation, *(scale - 1.0 for scale in own.scale))
    if not plain or own.use_min or own.use_max or any(moved):
        raise _unread(node, "an image with a texture mapping of its own")


def _mapping(node: Any, path: _Path) -> Matrix:
    """A Mapping node's map. Raises Unread where it is linked, or not affine."""
    if node.vector_type == "NORMAL":
        raise _unread(node, "an image laid out by a node Mapping set to Normal")
    location, rotation, scale = (_vector(node, name, path) for name in ("Location", "Rotation", "Scale"))
    turned = Euler(rotation, "XYZ").to_matrix().to_4x4()
    if node.vector_type == "TEXTURE":
        shrunk = Matrix.Diagonal([*(1.0 / s if s else 0.0 for s in scale), 1.0])
        return shrunk @ turned.transposed() @ Matrix.Translation([-x for x in location])
    moved = Matrix.Translation(location) if node.vector_type == "POINT" else _IDENTITY
    return moved @ turned @ Matrix.Diagonal([*scale, 1.0])


def _vector(node: Any, name: str, path: _Path) -> tuple[float, ...]:
    feed = _feed(node.inputs[name], path)
    value = None if feed.node is not None else feed.home.default_value
    if value is None:
        raise _unread(node, "an image laid out by a node Mapping with links")
    return (value,) * 3 if isinstance(value, float) else tuple(value)[:3]


_SHADERS: dict[str, Callable[[_Reader, _Feed], Field]] = {
    "BSDF_PRINCIPLED": _Reader.principled,
    "BSDF_TRANSPARENT": _Reader.transparent,
    "MIX_SHADER": _Reader.mix_shader,
    "ADD_SHADER": _Reader.add_shader,
}

# To shadow rays, measured; with all others of the name BSDF.
_OPAQUE = {"EMISSION", "HOLDOUT", "SUBSURFACE_SCATTERING", "BACKGROUND", "EEVEE_SPECULAR"}

_VALUES: dict[str, Callable[[_Reader, _Feed], Field]] = {
    "VALUE": _Reader.given,
    "RGB": _Reader.given,
    "LIGHT_PATH": _Reader.light_path,
    "TEX_IMAGE": _Reader.texture,
    "MATH": _Reader.math,
    "MIX": _Reader.mix,
    "MIX_RGB": _Reader.mix,
    "INVERT": _Reader.invert,
    "VALTORGB": _Reader.ramp,
    "SEPARATE_COLOR": _Reader.separate,
    "SEPRGB": _Reader.separate,
    "RGBTOBW": _Reader.to_grey,
    "CLAMP": _Reader.clamp,
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
