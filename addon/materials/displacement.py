"""What materials do to the shape of a surface in Cycles, by the socket Displacement of their output."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, cast

import bpy

from .material_cache import MaterialCache
from .mesh_layers import materials_of
from .node_links import SocketSource, nodes_of, sources_behind

# What a node tells of the object among others: of a copy that stands alone it would tell something else.
_OF_THE_SCENE = {
    "OBJECT_INFO": ("Random",),
    "PARTICLE_INFO": None,  # all
    "CAMERA": None,
    "TEX_COORD": ("Camera", "Window", "Reflection"),
}
# Nodes that read, or give, something in world space; a node Texture Coordinate does in object space.
_OF_THE_WORLD = {
    "NEW_GEOMETRY",
    "OBJECT_INFO",
    "VECT_TRANSFORM",
    "TANGENT",
    "NORMAL_MAP",
    "BUMP",
    "FRESNEL",
    "LAYER_WEIGHT",
    "WIREFRAME",
    "TEX_ENVIRONMENT",
    "TEX_SKY",
    "SCRIPT",
}


@dataclass(frozen=True)
class MaterialDisplacement:
    """What is linked to a material's Displacement. moves: it moves vertices. bumps: it turns normals by what is finer
    than them, or alone. placed: it depends on where the object stands, how it is turned and scaled, or on the mesh's
    own coordinates. unknown: what of it cannot be told of the object alone, in words; else empty."""

    material: bpy.types.Material
    moves: bool
    bumps: bool
    placed: bool
    unknown: str = ""


Movers = tuple[MaterialDisplacement | None, ...]  # of an object's slots, None where nothing moves


class MaterialDisplacements(MaterialCache[MaterialDisplacement | None]):
    """The materials' displacements, None of those that have none."""

    def movers(self, obj: bpy.types.Object) -> Movers:
        """What moves an evaluated object's mesh; empty where nothing does."""
        found = [self.of(material, []) for material in materials_of(obj)]
        movers = tuple(each if each is not None and each.moves else None for each in found)
        return movers if any(movers) else ()

    def _nothing(self) -> None:
        return None

    def _read(self, material: bpy.types.Material, lines: list[str]) -> MaterialDisplacement | None:
        return displacement_of(material)


def lines_on_movers(moved: Iterable[tuple[str, Movers]]) -> list[str]:
    """On what of the materials is not read; each is told once, with the first object that it displaces."""
    first = {mover: label for label, movers in reversed([*moved]) for mover in movers if mover is not None}
    return [
        f"{label}: {mover.material.name} displaces it by {mover.unknown}, which is not read as it is in the scene; use "
        "an attribute or a UV map of the mesh in its place, or displace it by a modifier"
        for mover, label in first.items()
        if mover.unknown
    ]


def displacement_of(material: bpy.types.Material) -> MaterialDisplacement | None:
    """What a material's Displacement does; None where nothing reaches it."""
    tree = nodes_of(material)
    output = None if tree is None else tree.get_output_node("CYCLES")
    sources = [] if output is None else list(sources_behind(output.inputs["Displacement"]))
    if not sources:
        return None
    method = material.displacement_method
    unknown = next((_in_words(source) for source in sources if _is_of_the_scene(source)), "")
    placed = not _is_along_object(sources[0].node) or any(_is_of_the_world(source) for source in sources)
    original = cast("bpy.types.Material", material.original)
    return MaterialDisplacement(original, method != "BUMP", method != "DISPLACEMENT", placed, unknown)


def _is_along_object(node: Any) -> bool:
    """Whether what it gives is a vector in object space, whatever the object's matrix; others are taken for world
    space."""
    return node.type in ("DISPLACEMENT", "VECTOR_DISPLACEMENT") and node.space != "WORLD"


def _is_of_the_world(source: SocketSource) -> bool:
    node = source.node
    return node.type in _OF_THE_WORLD or (node.type == "TEX_COORD" and source.output.name == "Object")


def _is_of_the_scene(source: SocketSource) -> bool:
    node = source.node
    if node.type == "ATTRIBUTE":
        return bool(node.attribute_type != "GEOMETRY")
    names = _OF_THE_SCENE.get(node.type, ())
    return names is None or source.output.name in names


def _in_words(source: SocketSource) -> str:
    return f"{source.output.name} of a node {source.node.bl_label}"
