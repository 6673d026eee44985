"""Normal maps that reach the normals of targets' materials, as Cycles' AO bake follows them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from ...core.base.arrays import Floats, Ints
from ...core.scene.image_texture import ImageTexture
from ...core.scene.normal_map import PLAIN, NormalMap, NormalMapLayer
from .displacement import displacement_of
from .image_pixels import ImagePixels, Unreadable
from .material_cache import MaterialCache
from .mesh_layers import materials_of, places_of, slots_of, tangents_of, uv_map
from .node_evaluator import NodeEvaluator
from .node_links import Path, SocketSource, nodes_of, socket_source, unread
from .texel_values import Lookup

WHAT = "normal maps"
_CURE = "link an Image Texture to a Normal Map node, and that to the shaders"
_BUMP_CURE = "set its Settings > Surface > Displacement to Displacement Only, or bake the bump into a normal map"
_FLAT = np.array((0.5, 0.5, 1.0), dtype=np.float32)  # the colour that turns nothing


@dataclass(frozen=True, eq=False)
class MaterialNormalMap:
    """A material's normal map before it lies on a mesh. lookup: None where it is the same all over. uv: the UV map that
    it is made for, "" the one for renders."""

    texture: ImageTexture
    lookup: Lookup | None
    uv: str
    strength: float


class MaterialNormalMaps(MaterialCache[MaterialNormalMap | None]):
    """The materials' normal maps, None of those that have none."""

    def __init__(self, override: bpy.types.Material | None = None, pixels: ImagePixels | None = None) -> None:
        super().__init__(override, pixels)
        self._tangents: dict[tuple[int, str], Floats] = {}  # by the mesh's address and the UV map

    def _nothing(self) -> None:
        return None

    def tangents(self, obj: bpy.types.Object, mesh: bpy.types.Mesh, uv_layer: str, corners: Ints) -> Floats:
        """`tangents_of` an evaluated object's mesh, which others may share."""
        key = (mesh.as_pointer(), uv_layer)
        if key not in self._tangents:
            self._tangents[key] = tangents_of(mesh, obj.name, uv_layer, corners, WHAT)
        return self._tangents[key]

    def _read(self, material: bpy.types.Material, lines: list[str]) -> MaterialNormalMap | None:
        try:
            return material_normal_map(material, self._pixels)
        except Unreadable as unread:
            what, cure = unread.in_words("normal"), unread.cure or _CURE
            lines.append(f"{material.name}: {what}; it is baked with the mesh's own normals; {cure}")
            return None


def material_normal_map(material: bpy.types.Material, pixels: ImagePixels) -> MaterialNormalMap | None:
    """The normal map of a material; None where its normals are the mesh's. Raises Unread."""
    tree = nodes_of(material)
    output = None if tree is None else tree.get_output_node("CYCLES")
    sources = {} if output is None else {_key(source): source for source in _normals(output.inputs["Surface"], ())}
    if len(sources) > 1:
        raise Unreadable("not the same in all of its shaders")
    source = next(iter(sources.values()), None)
    if source is None or source.node is None:
        _check_bump(material)
        return None
    node = source.node
    if node.type != "NORMAL_MAP":
        raise unread(node)
    if node.space != "TANGENT":
        raise unread(node, f"a node Normal Map of {node.space.replace('_', ' ').title()}")
    strength = socket_source(node.inputs["Strength"], source.path)
    if strength.node is not None:
        raise unread(node, "a node Normal Map whose strength is linked")
    texels = NodeEvaluator(pixels).colour(node.inputs["Color"], source.path)
    if texels.lookup is None and np.array_equal(texels.values[0, 0], _FLAT):
        return None
    colours = texels.values
    if getattr(node, "convention", "OPENGL") == "DIRECTX":
        colours = np.stack([colours[..., 0], 1.0 - colours[..., 1], colours[..., 2]], axis=-1)
    texture = ImageTexture(np.ascontiguousarray(colours, dtype=np.float32), *texels.sampling)
    return MaterialNormalMap(texture, texels.lookup, node.uv_map, max(float(strength.home.default_value), 0.0))


def _check_bump(material: bpy.types.Material) -> None:
    """Raises Unread for a displacement that turns the normals of shaders that have no others."""
    displacement = displacement_of(material)
    if displacement is not None and displacement.bumps:
        which = "a part of its displacement" if displacement.moves else "its displacement"
        raise Unreadable(f"{which} is bump, which is not read", _BUMP_CURE, whole=True)


def normal_map_of(
    obj: bpy.types.Object,
    mesh: bpy.types.Mesh,
    corners: Ints,
    polygons: Ints,
    found_maps: MaterialNormalMaps,
    lines: list[str],
) -> NormalMap | None:
    """What turns the normals of an evaluated object's mesh, None where nothing does; lines on materials that are met
    first here and not read as they are.

    corners: (T, 3) int32 corners of the mesh, polygons: (T,) int32, as of its loop triangles. Raises InputError for
    faces that have no tangents.
    """
    materials = materials_of(obj)
    slots = slots_of(mesh, polygons, len(materials)) if len(corners) else np.zeros(0, dtype=np.int32)
    layer = np.full(len(corners), PLAIN, dtype=np.int32)
    uv = np.zeros((*corners.shape, 2), dtype=np.float32)
    layers: list[NormalMapLayer] = []
    for slot in np.unique(slots):
        found = found_maps.of(materials[slot], lines)
        if found is None:
            continue
        uv_layer = uv_map(mesh, found.uv)
        if uv_layer is None:
            lines.append(_without_map(obj, found.uv))
            continue
        here = slots == slot
        layer[here] = len(layers)
        layers.append(
            NormalMapLayer(found.texture, found_maps.tangents(obj, mesh, uv_layer.name, corners), found.strength)
        )
        if found.lookup is not None:
            uv[here] = places_of(mesh, found.lookup, corners[here])
    return NormalMap(layers, layer, uv) if layers else None


def _without_map(obj: bpy.types.Object, name: str) -> str:
    """The line on a mesh that lacks the UV map whose tangents tell how a normal map lies."""
    lacks = f"UV map {name}" if name else "UV map"
    return f"{obj.name}: it has no {lacks}, which its normal map is made for; it is baked with its own normals"


def _normals(socket: Any, path: Path) -> Iterator[SocketSource]:
    """What feeds the normals of the shaders that feed a socket; of those that have one."""
    source = socket_source(socket, path)
    if source.node is None:
        return
    if source.node.type in ("MIX_SHADER", "ADD_SHADER"):
        for each in source.node.inputs[-2:]:
            yield from _normals(each, source.path)
    elif "Normal" in source.node.inputs:
        yield socket_source(source.node.inputs["Normal"], source.path)


def _key(source: SocketSource) -> tuple[Any, ...]:
    """Equal where the same feeds; all that is not linked is the mesh's own."""
    node = None if source.node is None else source.node.as_pointer()
    return (node, *(each.as_pointer() for each in source.path)) if node else ()
