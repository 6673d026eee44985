"""A World that is an image laid around, and nothing else: its pixels, from its own file."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from mathutils import Euler

from ...core.base.arrays import Doubles, Floats
from ...core.base.errors import InputError
from ...core.finish.image_file import read_image
from ...core.spherical.environment import broken_pixels
from ..colour_space import Decoding, decoding_of, srgb_decoded
from ..typed import Node, Socket, Tree
from .world_nodes import file_of, has_nodes, unreadable


@dataclass(frozen=True, eq=False)
class PlainImage:
    """rotation: (3, 3) float64, from world directions to the image's. strength: what its pixels are multiplied by."""

    image: bpy.types.Image
    rotation: Doubles
    strength: float


def plain_image(world: bpy.types.World) -> PlainImage | None:
    """The image, where the World is an Environment Texture, turned by a Mapping or not, on a Background; else None."""
    tree: Tree = world.node_tree
    visibility = getattr(world, "cycles_visibility", None)  # None where Blender's Cycles is switched off
    if not has_nodes(world) or tree.animation_data or not (visibility is None or visibility.diffuse):
        return None
    output = tree.get_output_node("CYCLES")
    background = _source(output and output.inputs["Surface"], "BACKGROUND")
    texture = _source(background and background.inputs["Color"], "TEX_ENVIRONMENT")
    if texture is None or background.inputs["Strength"].is_linked or not _is_plain(texture):
        return None
    rotation, strength = _rotation(texture.inputs["Vector"]), background.inputs["Strength"].default_value
    return None if rotation is None or strength < 0.0 else PlainImage(texture.image, rotation, strength)


def pixels_of(plain: PlainImage) -> Floats | None:
    """(h, w, 3) float32 radiance, row 0 at the top; None where the file alone does not tell what Blender shows.

    Light below 0, which resampling leaves behind, is 0. Raises InputError for a file that is missing or broken, and
    for pixels that are not finite.
    """
    values = _stored(plain.image)
    if values.shape[2] == 1:
        values = np.repeat(values, 3, axis=2)
    if values.shape[2] not in (3, 4) or (values[..., 3:] != 1.0).any():
        return None
    values = values[..., :3]
    check_finite(plain.image.name, values)
    if decoding_of(plain.image) == Decoding.SRGB:
        if values.max() > 1.0:
            return None
        values = srgb_decoded(values)
    return np.maximum(values, 0.0).astype(np.float32) * np.float32(plain.strength)


def check_finite(name: str, values: Floats) -> None:
    """Raises InputError for light, (..., 3), that is no number or without an end: what it should be, nobody knows."""
    if broken := broken_pixels(values):
        raise InputError(f"{name}: {broken}; clamp the image in an editor, or choose another")


def _source(socket: Socket, kind: str) -> Node:
    """The node of that type that feeds a socket, None where none does."""
    if not socket or not socket.is_linked or socket.links[0].is_muted:
        return None
    node = socket.links[0].from_node
    return node if node.type == kind and not node.mute else None


def _is_plain(texture: Node) -> bool:
    image = texture.image
    if texture.projection != "EQUIRECTANGULAR" or image is None or image.is_dirty:
        return False
    return decoding_of(image) != Decoding.OTHER and image.source == "FILE" and image.type == "IMAGE"


def _rotation(vector: Socket) -> Doubles | None:
    """(3, 3), from world directions to what the socket gets; None where that is no rotation."""
    if not vector.is_linked or _is_direction(vector):
        return np.eye(3)
    mapping = _source(vector, "MAPPING")
    if mapping is None or not _is_direction(mapping.inputs["Vector"]):
        return None
    others = [(mapping.inputs.get("Location"), (0, 0, 0)), (mapping.inputs["Scale"], (1, 1, 1))]  # no vector is moved
    if any(socket and (socket.is_linked or tuple(socket.default_value) != idle) for socket, idle in others):
        return None
    if mapping.inputs["Rotation"].is_linked:
        return None
    matrix = np.array(Euler(mapping.inputs["Rotation"].default_value, "XYZ").to_matrix(), dtype=np.float64)
    return matrix.T if mapping.vector_type == "TEXTURE" else matrix


def _is_direction(vector: Socket) -> bool:
    """Whether a socket gets the direction of the ray, in world axes."""
    return _source(vector, "TEX_COORD") is not None and vector.links[0].from_socket.name == "Generated"


def _stored(image: bpy.types.Image) -> Floats:
    """Pixels as they stand in the file, packed or not."""
    if image.packed_file is None:
        return read_image(file_of(image))[0]
    with tempfile.TemporaryDirectory(prefix="occlusion-bake-") as folder:
        path = Path(folder, "image").with_suffix(Path(image.filepath).suffix)
        path.write_bytes(image.packed_file.data)
        try:
            return read_image(path)[0]
        except InputError as error:
            raise unreadable(image) from error
