"""Baked maps as Blender images, and on request in the object's materials."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from ..core.bake import Baked, BakedMap
from ..core.scene import Floats

_MARK = "occlusion_bake"  # on an image of ours: "object/map"; on nodes: what they are for
_NODE = "Occlusion Bake"


def store(baked: Baked) -> dict[str, bpy.types.Image]:
    """Put every map into an image named after the object, the one of an earlier bake where there is one.

    Float, Non-Color, packed into the file so that it is saved with it. Returns the images by map.
    """
    return {name: _store(baked.name, name, each) for name, each in baked.maps.items()}


def _store(owner: str, name: str, baked: BakedMap) -> bpy.types.Image:
    height, width = baked.values.shape
    image = _image(owner, name, width, height)
    image.pixels.foreach_set(_rgba(baked.values).ravel())
    image.update()
    image.pack()
    return image


def _image(owner: str, name: str, width: int, height: int) -> bpy.types.Image:
    mark = f"{owner}/{name}"
    image = next((each for each in bpy.data.images if each.get(_MARK) == mark and each.library is None), None)
    if image is None:
        image = bpy.data.images.new(
            f"{owner} {_title(name)}", width, height, alpha=False, float_buffer=True, is_data=True
        )
        image[_MARK] = mark
    elif tuple(image.size) != (width, height):
        image.scale(width, height)
    if image.colorspace_settings.name != "Non-Color":  # setting it makes Blender read the packed file again
        image.colorspace_settings.name = "Non-Color"
    return image


def _title(name: str) -> str:
    """ "ao" → "AO", "ro_10" → "RO 10"."""
    kind, _, exponent = name.partition("_")
    return f"{kind.upper()} {exponent}".strip()


def _rgba(values: Floats) -> Floats:
    """Grey, opaque, bottom row first, as Blender keeps pixels."""
    pixels = np.ones((*values.shape, 4), dtype=np.float32)
    pixels[..., :3] = values[::-1, :, None]
    return pixels


def show_picture(name: str, path: str) -> bpy.types.Image:
    """Load a picture under this name, in the place of an earlier one, and pack it: its file may go."""
    image = bpy.data.images.load(path)
    image[_MARK] = "picture"
    image.pack()
    image.filepath_raw = ""
    old = bpy.data.images.get(name)
    if old is not None and old.get(_MARK) == "picture":
        old.user_remap(image)  # open editors show the new one
        bpy.data.images.remove(old)
    image.name = name
    return image


def hook_up(obj: bpy.types.Object, image: bpy.types.Image, uv: str | None) -> None:
    """Multiply the image into the base colour of each of the object's materials; again only exchanges the image.

    uv: the UV map that it was baked onto, None for the active one. An object without materials gets one.
    """
    if not any(slot.material for slot in obj.material_slots):
        material = bpy.data.materials.new(obj.name)
        if not material.node_tree:
            material.use_nodes = True
        if obj.material_slots:
            obj.material_slots[0].material = material
        else:
            obj.data.materials.append(material)
    for slot in obj.material_slots:
        if slot.material is not None and slot.material.library is None and slot.material.node_tree:
            _multiply(slot.material.node_tree, image, uv)


def _multiply(tree: Any, image: bpy.types.Image, uv: str | None) -> None:
    ours = [node for node in tree.nodes if node.get(_MARK) == "image"]
    for node in ours:
        node.image = image
    surface = next((node for node in tree.nodes if node.type == "BSDF_PRINCIPLED"), None)
    if ours or surface is None:
        return
    base = surface.inputs["Base Color"]
    texture = _node(tree, "ShaderNodeTexImage", surface, -700, "image")
    texture.image = image
    mix = _node(tree, "ShaderNodeMix", surface, -300, "multiply")
    mix.data_type, mix.blend_type = "RGBA", "MULTIPLY"
    mix.inputs["Factor"].default_value = 1.0
    first, second = (socket for socket in mix.inputs if socket.type == "RGBA")
    first.default_value = base.default_value
    if base.is_linked:
        tree.links.new(base.links[0].from_socket, first)
    tree.links.new(texture.outputs["Color"], second)
    tree.links.new(next(socket for socket in mix.outputs if socket.type == "RGBA"), base)
    if uv is not None:
        place = _node(tree, "ShaderNodeUVMap", surface, -950, "uv")
        place.uv_map = uv
        tree.links.new(place.outputs["UV"], texture.inputs["Vector"])


def _node(tree: Any, kind: str, beside: Any, shift: float, purpose: str) -> Any:
    node = tree.nodes.new(kind)
    node.label = _NODE
    node[_MARK] = purpose
    node.location = (beside.location.x + shift, beside.location.y)
    return node
