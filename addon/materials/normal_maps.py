"""Normal maps that reach the normals of targets' materials, as Cycles' AO bake follows them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from ...core.scene.image_texture import Picture
from ...core.scene.scene import Floats, Ints
from ...core.texels.shading_normals import PLAIN, NormalMap, Relief
from .image_pixels import Pictures, Unread
from .material_cache import PerMaterial
from .mesh_layers import materials_of, places_of, slots_of, tangents_of, uv_map
from .node_evaluator import Values
from .node_links import Feed, Path, feeding, unread
from .opacity import nodes_of
from .texel_values import Lookup

WHAT = "normal maps"
_CURE = "link an Image Texture to a Normal Map node, and that to the shaders"
_FLAT = np.float32((0.5, 0.5, 1.0))  # the colour that turns nothing


@dataclass(frozen=True, eq=False)
class Imprint:
    """A material's normal map before it lies on a mesh. lookup: None where it is the same all over. uv: the UV map that
    it is made for, "" the one for renders."""

    picture: Picture
    lookup: Lookup | None
    uv: str
    strength: float


class Imprints(PerMaterial[Imprint | None]):
    """The materials' normal maps, None of those that have none."""

    def __init__(self, override: bpy.types.Material | None = None, pictures: Pictures | None = None) -> None:
        super().__init__(override, pictures)
        self._tangents: dict[tuple[int, str], Floats] = {}  # by the mesh's address and the UV map

    def _nothing(self) -> None:
        return None

    def tangents(self, obj: bpy.types.Object, mesh: bpy.types.Mesh, layer: str, corners: Ints) -> Floats:
        """`tangents_of` an evaluated object's mesh, which others may share."""
        key = (mesh.as_pointer(), layer)
        if key not in self._tangents:
            self._tangents[key] = tangents_of(mesh, obj.name, layer, corners, WHAT)
        return self._tangents[key]

    def _read(self, material: bpy.types.Material, lines: list[str]) -> Imprint | None:
        try:
            return imprint_of(material, self._pictures)
        except Unread as unread:
            what, cure = unread.in_words("normal"), unread.cure or _CURE
            lines.append(f"{material.name}: {what}; it is baked with the mesh's own normals; {cure}")
            return None


def imprint_of(material: bpy.types.Material, pictures: Pictures) -> Imprint | None:
    """The normal map of a material; None where its normals are the mesh's. Raises Unread."""
    tree = nodes_of(material)
    output = None if tree is None else tree.get_output_node("CYCLES")
    feeds = {} if output is None else {_key(feed): feed for feed in _normals(output.inputs["Surface"], ())}
    if len(feeds) > 1:
        raise Unread("not the same in all of its shaders")
    feed = next(iter(feeds.values()), None)
    if feed is None or feed.node is None:
        return None
    node = feed.node
    if node.type != "NORMAL_MAP":
        raise unread(node)
    if node.space != "TANGENT":
        raise unread(node, f"a node Normal Map of {node.space.replace('_', ' ').title()}")
    strength = feeding(node.inputs["Strength"], feed.path)
    if strength.node is not None:
        raise unread(node, "a node Normal Map whose strength is linked")
    field = Values(pictures).colour(node.inputs["Color"], feed.path)
    if field.lookup is None and np.array_equal(field.values[0, 0], _FLAT):
        return None
    colours = field.values
    if getattr(node, "convention", "OPENGL") == "DIRECTX":
        colours = np.stack([colours[..., 0], 1.0 - colours[..., 1], colours[..., 2]], axis=-1)
    picture = Picture(np.ascontiguousarray(colours, dtype=np.float32), *field.sampling)
    return Imprint(picture, field.lookup, node.uv_map, max(float(strength.home.default_value), 0.0))


def normal_map_of(
    obj: bpy.types.Object, mesh: bpy.types.Mesh, corners: Ints, polygons: Ints, imprints: Imprints, lines: list[str]
) -> NormalMap | None:
    """What turns the normals of an evaluated object's mesh, None where nothing does; lines on materials that are met
    first here and not read as they are.

    corners: (T, 3) int32 corners of the mesh, polygons: (T,) int32, as of its loop triangles. Raises InputError for
    faces that have no tangents.
    """
    materials = materials_of(obj)
    slots = slots_of(mesh, polygons, len(materials)) if len(corners) else np.zeros(0, dtype=np.int32)
    relief = np.full(len(corners), PLAIN, dtype=np.int32)
    uv = np.zeros((*corners.shape, 2), dtype=np.float32)
    reliefs: list[Relief] = []
    for slot in np.unique(slots):
        imprint = imprints.of(materials[slot], lines)
        if imprint is None:
            continue
        layer = uv_map(mesh, imprint.uv)
        if layer is None:
            lines.append(_without_map(obj, imprint.uv))
            continue
        here = slots == slot
        relief[here] = len(reliefs)
        reliefs.append(Relief(imprint.picture, imprints.tangents(obj, mesh, layer.name, corners), imprint.strength))
        if imprint.lookup is not None:
            uv[here] = places_of(mesh, imprint.lookup, corners[here])
    return NormalMap(reliefs, relief, uv) if reliefs else None


def _without_map(obj: bpy.types.Object, name: str) -> str:
    """The line on a mesh that lacks the UV map whose tangents tell how a normal map lies."""
    lacks = f"UV map {name}" if name else "UV map"
    return f"{obj.name}: it has no {lacks}, which its normal map is made for; it is baked with its own normals"


def _normals(socket: Any, path: Path) -> Iterator[Feed]:
    """What feeds the normals of the shaders that feed a socket; of those that have one."""
    feed = feeding(socket, path)
    if feed.node is None:
        return
    if feed.node.type in ("MIX_SHADER", "ADD_SHADER"):
        for each in feed.node.inputs[-2:]:
            yield from _normals(each, feed.path)
    elif "Normal" in feed.node.inputs:
        yield feeding(feed.node.inputs["Normal"], feed.path)


def _key(feed: Feed) -> tuple[Any, ...]:
    """Equal where the same feeds; all that is not linked is the mesh's own."""
    node = None if feed.node is None else feed.node.as_pointer()
    return (node, *(each.as_pointer() for each in feed.path)) if node else ()
