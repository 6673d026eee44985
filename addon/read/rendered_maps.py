"""Which UV maps meshes have as they render, after modifiers, and which modifier is to blame where one is not there."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any, TypeVar

import bpy

from ...core.base.errors import InputError
from ...core.base.triangles import uv_area_of
from ...core.scene.checks import no_faces
from ..materials.mesh_layers import values_of
from ..typed import found_in, mesh_of, view_layer_in
from .blender_state import temporary_attributes
from .block_ref import BlockRef
from .depsgraph import evaluated
from .mesh_arrays import active_map, corners_of

# Modifiers that bring no UV maps for the whole mesh, and keep those that are there. Meshes with others have to be
# evaluated to be looked at, which takes as long as for reading the scene.
_KEEPING = {
    *("ARRAY", "BEVEL", "BOOLEAN", "DECIMATE", "EDGE_SPLIT", "MASK", "MIRROR", "MULTIRES", "SOLIDIFY", "SUBSURF"),
    *("TRIANGULATE", "WELD", "ARMATURE", "CAST", "CURVE", "DISPLACE", "HOOK", "LAPLACIANDEFORM", "LATTICE"),
    *("MESH_DEFORM", "SHRINKWRAP", "SIMPLE_DEFORM", "SMOOTH", "CORRECTIVE_SMOOTH", "LAPLACIANSMOOTH"),
    *("SURFACE_DEFORM", "WARP", "WAVE", "NORMAL_EDIT", "WEIGHTED_NORMAL", "UV_PROJECT", "UV_WARP"),
    *("VERTEX_WEIGHT_EDIT", "VERTEX_WEIGHT_MIX", "VERTEX_WEIGHT_PROXIMITY"),
    *("CLOTH", "COLLISION", "PARTICLE_SYSTEM", "SOFT_BODY", "SURFACE"),
}

_FIRST = 1024  # triangles

Objects = Mapping[BlockRef, bpy.types.Object]

_Answer = TypeVar("_Answer")


@dataclass(frozen=True)
class RenderedMaps:
    """has_faces: whether there is anything to bake. names: of the UV maps in which a face has an area. active: which is
    baked onto where none is asked for, None where none can be."""

    has_faces: bool
    names: tuple[str, ...]
    active: str | None


def rendered_maps(context: bpy.types.Context, objects: Objects) -> dict[BlockRef, RenderedMaps]:
    """Of mesh objects."""
    remade = {ref: obj for ref, obj in objects.items() if remakes_mesh(obj)}
    as_made = {ref: _maps_of(mesh_of(obj)) for ref, obj in objects.items() if ref not in remade}
    return as_made | as_rendered(context, remade, _maps_of)


def remakes_mesh(obj: bpy.types.Object) -> bool:
    """Whether an object's modifiers may drop UV maps, or bring some."""
    return any(modifier.type not in _KEEPING for modifier in rendering_modifiers(obj))


def rendering_modifiers(obj: bpy.types.Object) -> list[bpy.types.Modifier]:
    """An object's modifiers that count in a render, in their order."""
    return [modifier for modifier in obj.modifiers if modifier.show_render]


def as_rendered(
    context: bpy.types.Context, objects: Objects, ask: Callable[[bpy.types.Mesh], _Answer]
) -> dict[BlockRef, _Answer]:
    """What a question is answered of the meshes of objects as they render; the scene is evaluated once."""
    answers: dict[BlockRef, _Answer] = {}

    def visit(depsgraph: bpy.types.Depsgraph) -> None:
        for ref, obj in objects.items():
            answers[ref] = ask(mesh_of(obj.evaluated_get(depsgraph)))

    if objects:
        evaluated(context, view_layer_in(context), visit)
    return answers


def to_blame(
    context: bpy.types.Context, objects: Objects, wrong: Callable[[bpy.types.Mesh], bool]
) -> dict[BlockRef, bpy.types.Modifier]:
    """Of objects whose meshes are wrong as they render: the first modifier after which they are.

    The scene is evaluated as often as the longest stack has modifiers, less the last one; objects without any are left
    out.
    """
    stacks = {ref: stack for ref, obj in objects.items() if (stack := rendering_modifiers(obj))}
    blamed = {ref: stack[-1] for ref, stack in stacks.items()}
    for count in range(1, max(map(len, stacks.values()), default=0)):
        stacks = {ref: stack for ref, stack in stacks.items() if len(stack) > count}
        with ExitStack() as until_then:
            for modifier in (modifier for stack in stacks.values() for modifier in stack[count:]):
                temporary_attributes(until_then, modifier, show_render=False)
            answers = as_rendered(context, {ref: objects[ref] for ref in stacks}, wrong)
        found = [ref for ref, is_wrong in answers.items() if is_wrong]
        blamed |= {ref: stacks.pop(ref)[count - 1] for ref in found}
    return blamed


def refused_without_faces(context: bpy.types.Context, objects: Objects) -> dict[BlockRef, InputError]:
    """What to say of objects that have no faces as they render."""
    emptied = {ref: obj for ref, obj in objects.items() if has_faces(mesh_of(obj))}
    refused = {ref: no_faces(ref.label) for ref in objects}
    for ref, modifier in to_blame(context, emptied, lambda mesh: not has_faces(mesh)).items():
        cure = "end its nodes with Realize Instances if they make some, or " if modifier.type == "NODES" else ""
        refused[ref] = InputError(
            f"{ref.label}: its modifier {modifier.name} leaves it no faces to bake; {cure}switch it off for renders"
        )
    return refused


def has_faces(mesh: bpy.types.Mesh) -> bool:
    return len(mesh.polygons) > 0


def lays_out(mesh: bpy.types.Mesh, name: str) -> bool:
    """Whether a mesh has the UV map, and some face an area in it."""
    layer: Any = found_in(mesh.uv_layers, name)
    if layer is None:
        return False
    uv, corners = values_of(layer.uv, "vector", len(mesh.loops), 2), corners_of(mesh)
    parts = corners[:_FIRST], corners[_FIRST:]  # of nearly all maps the first tell
    return any(bool((abs(uv_area_of(uv[part].astype("f8"))) > 0.0).any()) for part in parts)


def _maps_of(mesh: bpy.types.Mesh) -> RenderedMaps:
    names = tuple(layer.name for layer in mesh.uv_layers if lays_out(mesh, layer.name))
    active = active_map(mesh)
    return RenderedMaps(has_faces(mesh), names, active.name if active and active.name in names else None)
