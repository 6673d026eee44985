"""A material's nodes, and what feeds a socket of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import bpy

from ..typed import Tree
from .image_pixels import Unreadable

Path = tuple[Any, ...]  # the group nodes that lead to a node, outermost first


@dataclass(frozen=True)
class SocketSource:
    """What feeds an input: an output of a node, or without a node the value of the socket `home`."""

    home: Any
    node: Any
    output: Any
    path: Path


def nodes_of(block: bpy.types.Material | bpy.types.World) -> Tree | None:
    """What makes a material or a World; None where it has no nodes, which from 5.0 on always count."""
    return block.node_tree if bpy.app.version >= (5, 0) or block.use_nodes else None


def socket_source(socket: Any, path: Path) -> SocketSource:
    """Follow an input's link through reroutes, muted nodes and the walls of groups."""
    home = socket
    while True:
        link = next((each for each in socket.links if each.is_valid and not each.is_muted), None)
        if link is None:
            return SocketSource(home, None, None, path)
        node, output = link.from_node, link.from_socket
        if node.mute or node.type == "REROUTE":
            socket = _through(node, output)
            if socket is None:
                return SocketSource(home, None, None, path)
        elif node.type == "GROUP" and node.node_tree is not None:
            path = (*path, node)
            home = socket = _same(_group_output(node), output)
        elif node.type == "GROUP_INPUT":
            home = socket = _same(path[-1].inputs, output)
            path = path[:-1]
        else:
            return SocketSource(home, node, output, path)


def sources_behind(socket: Any) -> Iterator[SocketSource]:
    """The outputs of nodes that feed an input of a material's own tree, the nearest first, and all that feed those."""
    waiting, seen = [socket_source(socket, ())], set()
    while waiting:
        source = waiting.pop(0)
        key = () if source.node is None else (source.output.as_pointer(), *(each.as_pointer() for each in source.path))
        if not key or key in seen:
            continue
        seen.add(key)
        yield source
        waiting += [socket_source(each, source.path) for each in source.node.inputs]


def _through(node: Any, output: Any) -> Any:
    """The input that a muted node or a reroute hands on, None where there is none."""
    if node.type == "REROUTE":
        return node.inputs[0]
    return next((link.from_socket for link in node.internal_links if link.to_socket == output), None)


def _group_output(group: Any) -> Any:
    nodes = [node for node in group.node_tree.nodes if node.type == "GROUP_OUTPUT"]
    active = next((node for node in nodes if node.is_active_output), None)
    if active is None:
        raise unread(group)
    return active.inputs


def _same(sockets: Sequence[Any], socket: Any) -> Any:
    """The socket on the other side of a group's wall."""
    return next(each for each in sockets if each.identifier == socket.identifier)


def unread(node: Any, what: str = "") -> Unreadable:
    return Unreadable(what or f"a node {node.bl_label}")
