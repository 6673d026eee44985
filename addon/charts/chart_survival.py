"""Which meshes cannot have charts: those whose modifiers make faces that no UV map of the mesh reaches."""

from __future__ import annotations

from collections.abc import Mapping

import bpy

from ...core.base.errors import InputError
from ..read.block_ref import BlockRef
from ..read.rendered_maps import Objects, RenderedMaps, as_rendered, has_faces, lays_out, remakes_mesh, to_blame
from ..typed import mesh_of
from .uv_maps import takes_map, tried_map


def refused_charts(
    context: bpy.types.Context, objects: Objects, layer: str, rendered: Mapping[BlockRef, RenderedMaps]
) -> dict[BlockRef, InputError]:
    """What to say of those whose charts, in a UV map of this name, would not be there in a render.

    It is tried. Meshes that cannot be given a UV map are for others to refuse.
    """
    remade = {ref: obj for ref, obj in objects.items() if remakes_mesh(obj) and takes_map(obj, layer)}
    with tried_map(map(mesh_of, remade.values()), layer):
        kept = as_rendered(context, remade, lambda mesh: lays_out(mesh, layer))
        lost = {ref: obj for ref, obj in remade.items() if not kept[ref] or not has_faces(mesh_of(obj))}
        blamed = to_blame(context, lost, lambda mesh: has_faces(mesh) and not lays_out(mesh, layer))
    return {
        ref: InputError(
            f"{ref.label}: its modifier {modifier.name} makes faces that charts of the mesh do not reach; "
            f"{_cure(modifier, lost[ref], rendered[ref])}"
        )
        for ref, modifier in blamed.items()
    }


def refused_map(
    context: bpy.types.Context, objects: Objects, layer: str, rendered: Mapping[BlockRef, RenderedMaps]
) -> dict[BlockRef, InputError]:
    """What to say of those that have a UV map of this name, and would not in a render."""
    lost = {
        ref: obj for ref, obj in objects.items() if layer not in rendered[ref].names and lays_out(mesh_of(obj), layer)
    }
    return {
        ref: InputError(
            f"{ref.label}: its modifier {modifier.name} drops the UV map {layer}; "
            f"{_cure(modifier, lost[ref], rendered[ref])}"
        )
        for ref, modifier in to_blame(context, lost, lambda mesh: not lays_out(mesh, layer)).items()
    }


def _cure(modifier: bpy.types.Modifier, obj: bpy.types.Object, rendered: RenderedMaps) -> str:
    if rendered.active is not None:
        return f"bake onto the UV map that it has then, {rendered.active}, or apply the modifier and unwrap the mesh"
    if modifier.type == "NODES":
        return (
            "store a UV map in its nodes (Store Named Attribute: 2D Vector, Face Corner), or apply it and unwrap the "
            "mesh"
        )
    without = ", or switch it off for renders" if has_faces(mesh_of(obj)) else ""
    return f"apply it and unwrap the mesh{without}"
