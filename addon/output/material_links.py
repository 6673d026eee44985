"""Baked images in an object's materials, on request, and out of them again.

For a preview AO multiplies the base colour and RO the specular level of the Principled BSDF; for glTF, AO goes to the
exporter's occlusion slot. What was linked there before goes through our nodes, and is linked as it was once they go.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any

import bpy

from ...core.base.errors import InputError
from ...core.maps.occlusion import ambient_among, reflection_among
from ..materials.node_links import nodes_of
from ..typed import Node, Tree, library_of, mesh_of
from .own_materials import give_back, materials_or_new, own_nodes, remove_made, shows_maps
from .ownership import MARK
from .ro_nodes import CODES, NORMAL, add_rebuild, set_rebuild

_LABEL = "Occlusion Bake"
_AO, _RO = "ao", "ro"  # what nodes of ours are for, as they are marked
_FOR = f"{MARK} for"  # on a node: which shader it is for
_GLTF_GROUP, _GLTF_SOCKET = "glTF Material Output", "Occlusion"  # as Blender's exporter looks for them
_SPECULAR = "Specular IOR Level"
_SHARE = "RO over Horizon"


def link_images(
    obj: bpy.types.Object,
    images: Mapping[str, bpy.types.Image],
    uv: str | None,
    *,
    preview: bool = True,
    gltf: bool = False,
    channel: str = "",
    turned: bool = False,
    among: Collection[bpy.types.Object] = (),
) -> list[str]:
    """Put baked images into each of the object's materials; again only exchanges the images. What other objects use,
    too, is copied first (own_materials.py).

    images: by map; of several RO maps the first, and before these a directional code of degree 3, which is right in
    every view. uv: the UV map that they were baked onto, None for the active one. channel: of RGBA, the one that holds
    the map; empty where the image is grey. turned: they were baked about the normals that the materials shade with, not
    about the mesh's. among: objects that show the same images by the same UV map. An object without materials gets one.
    Returns a line for each that cannot show the maps.
    """
    maps = _Maps(obj, images, uv, channel, turned)
    preview, gltf = preview and maps.any, gltf and maps.ao is not None
    if not (preview or gltf):
        return []
    try:
        materials = materials_or_new(obj)
    except InputError as refusal:
        return [str(refusal)]
    lines = []
    for material in materials:
        if preview and not _can_show(material):
            lines.append(
                f"{obj.name}: no Principled BSDF leads to the output of its material {material.name}, outside of "
                "groups, so that it does not show the maps; use one, or multiply the images into its colors"
            )
        if gltf or (preview and _can_show(material)):
            _link(own_nodes(obj, material, among), maps, preview=preview, gltf=gltf)
    return lines


class _Maps:
    """What an object shows. code: the images of a directional code; place: the UV map, whose tangents it takes."""

    def __init__(
        self, obj: bpy.types.Object, images: Mapping[str, bpy.types.Image], uv: str | None, channel: str, turned: bool
    ) -> None:
        self.ao, self.ro = (
            images[name] if name else None for name in (ambient_among(images), reflection_among(images))
        )
        codes = [image for name in CODES if (image := images.get(name)) is not None]
        layers: Any = mesh_of(obj).uv_layers
        self.place = uv or (layers.active.name if layers else "")
        # Of files there is one for all of a code, which no node reads.
        self.code = codes if len(codes) == len(CODES) and self.place else []
        self.uv, self.channel, self.turned = uv, channel, turned

    @property
    def any(self) -> bool:
        """Whether there is anything that a material can show."""
        return self.ao is not None or self.ro is not None or bool(self.code)


def _link(tree: Tree, maps: _Maps, *, preview: bool, gltf: bool) -> None:
    surfaces = _surfaces(tree)
    beside = surfaces[0] if surfaces else None
    if maps.ao is not None:
        occlusion = _value(tree, _AO, maps.ao, maps.uv, beside, maps.channel)
        for surface in surfaces if preview else []:
            _multiply_colour(tree, surface, occlusion)
        if gltf:
            _fill_gltf(tree, occlusion)
    for surface in surfaces if preview else []:
        if maps.code:
            rebuilt = _rebuilt(tree, maps.code, maps.place, surface)
            _turn(tree, rebuilt, surface.inputs["Normal"] if maps.turned else None)
            _multiply_specular(tree, surface, rebuilt.outputs[_SHARE])
        elif maps.ro is not None:
            _multiply_specular(tree, surface, _value(tree, _RO, maps.ro, maps.uv, beside, maps.channel))


def unlink_images(obj: bpy.types.Object) -> bool:
    """Take everything of ours out of the object's materials. Returns whether there was anything."""
    found = has_linked_images(obj)
    give_back(obj)
    for tree in _hooked(obj):
        ours = [node for node in tree.nodes if MARK in node]
        for node in ours:
            if node[MARK].endswith("multiply"):
                _restore(tree, node)
        for node in ours:
            tree.nodes.remove(node)
    remove_made(obj)
    group: Any = bpy.data.node_groups.get(_GLTF_GROUP)
    if group is not None and MARK in group and not group.users:
        bpy.data.node_groups.remove(group)
    return found


def has_linked_images(obj: bpy.types.Object) -> bool:
    """Whether any of the object's materials holds nodes of ours."""
    return any(True for _ in _hooked(obj))


def _hooked(obj: bpy.types.Object) -> Iterator[Tree]:
    """The nodes of the object's materials that hold nodes of ours."""
    for material in {slot.material for slot in obj.material_slots if slot.material is not None}:
        if library_of(material) is None and shows_maps(material):
            yield material.node_tree


def _can_show(material: bpy.types.Material) -> bool:
    """Whether there is a shader to multiply maps into; where there are no nodes there will be one."""
    tree = nodes_of(material)
    return tree is None or bool(_surfaces(tree))


def _surfaces(tree: Tree) -> list[Node]:
    """The shaders that lead to an output, but for those in groups, which other materials may use, too."""
    waiting, seen = [node for node in tree.nodes if node.type == "OUTPUT_MATERIAL"], set()
    while waiting:
        node = waiting.pop()
        if node not in seen:
            seen.add(node)
            waiting += [link.from_node for socket in node.inputs for link in socket.links]
    return [node for node in tree.nodes if node in seen and node.type == "BSDF_PRINCIPLED"]


def _value(tree: Any, kind: str, image: bpy.types.Image, uv: str | None, beside: Any, channel: str) -> Any:
    """The socket that gives a map: the image's colour, or one of its channels."""
    texture, parts = _texture(tree, kind, image, uv, beside), _ours(tree, f"{kind} channel")
    if channel in ("", "A"):
        if parts is not None:
            tree.nodes.remove(parts)
        return texture.outputs["Alpha" if channel else "Color"]
    if parts is None:
        place = (-500.0, 0.0 if kind == _AO else -300.0)
        parts = _node(tree, "ShaderNodeSeparateColor", beside, place, f"{kind} channel")
    tree.links.new(texture.outputs["Color"], parts.inputs["Color"])
    return parts.outputs["RGB".index(channel)]


def _texture(tree: Any, kind: str, image: bpy.types.Image, uv: str | None, beside: Any) -> Any:
    """Our texture node of a kind, with this image and UV map; new where there is none."""
    place = (-700.0, 0.0 if kind == _AO else -300.0)
    texture = _ours(tree, f"{kind} image") or _node(tree, "ShaderNodeTexImage", beside, place, f"{kind} image")
    texture.image = image
    if uv is None:
        return texture
    node = _ours(tree, f"{kind} uv") or _node(
        tree, "ShaderNodeUVMap", beside, (place[0] - 250.0, place[1]), f"{kind} uv"
    )
    node.uv_map = uv
    tree.links.new(node.outputs["UV"], texture.inputs["Vector"])
    return texture


def _multiply_colour(tree: Any, surface: Any, occlusion: Any) -> None:
    """occlusion: the socket that gives it."""
    mix = _ours(tree, f"{_AO} multiply", surface)
    if mix is None:
        mix = _node(tree, "ShaderNodeMix", surface, (-300.0, 0.0), f"{_AO} multiply")
        mix[_FOR] = surface.name
        mix.data_type, mix.blend_type = "RGBA", "MULTIPLY"
        mix.inputs["Factor"].default_value = 1.0
        out = next(socket for socket in mix.outputs if socket.type == "RGBA")
        _pass_through(tree, surface.inputs["Base Color"], _colours(mix)[0], out)
    tree.links.new(occlusion, _colours(mix)[1])


def _colours(mix: Any) -> list[Any]:
    """The two inputs of a Mix node of colours."""
    return [socket for socket in mix.inputs if socket.type == "RGBA"]


def _rebuilt(tree: Any, images: Sequence[bpy.types.Image], uv: str, surface: Any) -> Any:
    """The node that rebuilds RO from a code for a shader, new where there is none."""
    there = _ours(tree, "code", surface)
    if there is not None:
        set_rebuild(there, images, uv)
        return there
    before = set(tree.nodes)
    node = add_rebuild(tree, images, uv)
    for each in set(tree.nodes) - before:
        each.label, each[MARK] = _LABEL, "code" if each == node else "code image"
    node[_FOR] = surface.name
    return node


def _turn(tree: Any, rebuilt: Any, normal: Any) -> None:
    """Let what feeds a shader's normal, if anything does, be what a code is read about; None: the mesh's own normals
    are."""
    for link in rebuilt.inputs[NORMAL].links:
        tree.links.remove(link)
    if normal is not None and normal.is_linked:
        tree.links.new(normal.links[0].from_socket, rebuilt.inputs[NORMAL])


def _multiply_specular(tree: Any, surface: Any, occlusion: Any) -> None:
    """occlusion: the socket that gives it."""
    product = _ours(tree, f"{_RO} multiply", surface)
    if product is None and _SPECULAR in surface.inputs:
        product = _node(tree, "ShaderNodeMath", surface, (-300.0, -300.0), f"{_RO} multiply")
        product[_FOR] = surface.name
        product.operation = "MULTIPLY"
        _pass_through(tree, surface.inputs[_SPECULAR], product.inputs[0], product.outputs[0])
    if product is not None:
        tree.links.new(occlusion, product.inputs[1])


def _pass_through(tree: Any, goal: Any, first: Any, out: Any) -> None:
    """Let what the goal has, a link or a value, go into `first`, and link `out` to the goal."""
    first.default_value = goal.default_value
    if goal.is_linked:
        tree.links.new(goal.links[0].from_socket, first)
    tree.links.new(out, goal)


def _restore(tree: Any, node: Any) -> None:
    """Link what goes through a multiplying node of ours to where it went before."""
    linked = [socket for socket in node.inputs if socket.is_linked and MARK not in socket.links[0].from_node]
    for link in [link for socket in node.outputs for link in socket.links]:
        if linked:
            tree.links.new(linked[0].links[0].from_socket, link.to_socket)


def _fill_gltf(tree: Any, occlusion: Any) -> None:
    """Link a socket to the exporter's occlusion slot, whose node is made where there is none."""
    node = next((node for node in tree.nodes if _is_gltf(node)), None)
    if node is None:
        node = _node(tree, "ShaderNodeGroup", None, (0.0, 250.0), "gltf")
        node.node_tree = _gltf_group()
    tree.links.new(occlusion, node.inputs[_GLTF_SOCKET])


def _is_gltf(node: Any) -> bool:
    group = node.node_tree if node.type == "GROUP" else None
    return group is not None and group.name.startswith(_GLTF_GROUP) and _GLTF_SOCKET in node.inputs


def _gltf_group() -> Any:
    group: Any = bpy.data.node_groups.get(_GLTF_GROUP)
    if group is None:
        group = bpy.data.node_groups.new(_GLTF_GROUP, "ShaderNodeTree")
        group[MARK] = "gltf"
        group.interface.new_socket(_GLTF_SOCKET, socket_type="NodeSocketFloat")
    return group


def _ours(tree: Any, purpose: str, surface: Any = None) -> Any:
    """The node for a purpose, and for a shader where each has its own; one of an earlier version is for the first."""
    ours = [node for node in tree.nodes if node.get(MARK) == purpose]
    if surface is not None:
        first = _surfaces(tree)[0].name
        ours = [node for node in ours if node.get(_FOR, first) == surface.name]
    return ours[0] if ours else None


def _node(tree: Any, kind: str, beside: Any, shift: tuple[float, float], purpose: str) -> Any:
    node = tree.nodes.new(kind)
    node.label = _LABEL
    node[MARK] = purpose
    x, y = beside.location if beside is not None else (0.0, 0.0)
    node.location = (x + shift[0], y + shift[1])
    return node
