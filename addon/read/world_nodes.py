"""The nodes of a World: which images it needs, and how surfaces see it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import bpy

from ...core.base.errors import InputError
from ..materials.node_links import nodes_of
from ..typed import Node, Socket, Tree

# What Light Path tells of a ray that left a surface once, by a diffuse bounce, and met nothing.
_DIFFUSE_RAY = {"Is Diffuse Ray": 1.0, "Is Reflection Ray": 1.0, "Ray Depth": 1.0, "Diffuse Depth": 1.0}


def has_nodes(world: bpy.types.World) -> bool:
    """Whether nodes make the World; else it is of one colour."""
    return nodes_of(world) is not None


def file_of(image: bpy.types.Image) -> Path:
    """Where an image's file is. Raises InputError where it is missing."""
    path = Path(bpy.path.abspath(image.filepath, library=image.library))
    if not path.is_file():
        raise InputError(
            f"{image.name}: its file {path} is missing; find it by File > External Data, or choose another image"
        )
    return path


def check_images(world: bpy.types.World) -> None:
    """Raises InputError for an image that the World needs and that Cycles would show pink."""
    if not has_nodes(world):
        return
    for node in _used(world.node_tree):
        if node.type not in ("TEX_ENVIRONMENT", "TEX_IMAGE"):
            continue
        if node.image is None:
            raise InputError(f"{world.name}: its {node.bl_label} node {node.name} has no image; open one")
        if node.image.source == "FILE":
            if node.image.packed_file is None:
                file_of(node.image)
            if tuple(node.image.size) == (0, 0):
                raise unreadable(node.image)


def unreadable(image: bpy.types.Image) -> InputError:
    """What is said of an image that is there and broken."""
    return InputError(f"{image.name}: cannot be read as an image; save it anew, or choose another")


def _used(tree: Tree) -> Iterator[Node]:
    """The nodes that lead to the output, those in groups among them."""
    output = tree.get_output_node("CYCLES") if isinstance(tree, bpy.types.ShaderNodeTree) else None
    inside = [node for node in tree.nodes if node.type == "GROUP_OUTPUT" and node.is_active_output]
    waiting, seen = [output, *inside] if output else inside, set()
    while waiting:
        node = waiting.pop()
        if node.name in seen:
            continue
        seen.add(node.name)
        yield node
        if node.type == "GROUP" and node.node_tree is not None:
            yield from _used(node.node_tree)
        waiting += [link.from_node for socket in node.inputs for link in socket.links if not link.is_muted]


def show_to_surfaces(stack: ExitStack, world: bpy.types.World) -> None:
    """Make a World of ours look to every ray as it does to diffuse ones, without its volume, until the stack closes."""
    visibility: Any = world.cycles_visibility
    visibility.camera = visibility.diffuse
    if not has_nodes(world):
        return
    tree: Tree = world.node_tree
    for node in tree.nodes:
        if node.type == "OUTPUT_WORLD":
            for link in node.inputs["Volume"].links:
                tree.links.remove(link)
    _answer_as_diffuse(stack, tree)


def _answer_as_diffuse(stack: ExitStack, tree: Tree) -> None:
    """Put plain values in the place of what Light Path nodes tell, in copies of groups too."""
    for node in list(tree.nodes):
        if node.type == "LIGHT_PATH":
            for output in node.outputs:
                _put_value(tree, output, _DIFFUSE_RAY.get(output.name, 0.0))
        elif node.type == "GROUP" and _tells_rays_apart(node.node_tree):
            node.node_tree = node.node_tree.copy()
            stack.callback(bpy.data.node_groups.remove, node.node_tree)
            _answer_as_diffuse(stack, node.node_tree)


def _put_value(tree: Tree, output: Socket, value: float) -> None:
    targets = [link.to_socket for link in output.links if not link.is_muted]
    if targets:
        plain = tree.nodes.new("ShaderNodeValue").outputs[0]
        plain.default_value = value
        for target in targets:
            tree.links.new(plain, target)


def _tells_rays_apart(tree: Tree) -> bool:
    return tree is not None and any(
        node.type == "LIGHT_PATH" or (node.type == "GROUP" and _tells_rays_apart(node.node_tree)) for node in tree.nodes
    )
