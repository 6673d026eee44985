"""Materials that may be changed for one object.

One that other objects use, too, that is linked from a library or has no nodes stays as it is: the object gets a copy.
It stands in a slot of the object, not of the mesh, whose slots stay, and knows the material whose place it takes.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import bpy

from ...core.base.errors import InputError
from ..materials.node_links import nodes_of
from ..typed import Tree, library_of, mesh_of
from .ownership import MARK

_OF = f"{MARK} of"  # on a copy: the material that it was made of
_MADE, _SLOT = "made", "slot"  # marks a material where there was none; a mesh whose one slot was made


def materials_or_new(obj: bpy.types.Object) -> list[bpy.types.Material]:
    """Those in the object's slots, each once; where there are none one is made. Raises InputError where the object
    takes none."""
    if (library := library_of(obj)) is not None:
        raise InputError(
            f"{obj.name}: it is linked from {library.filepath}, so that its materials cannot show the maps; make a "
            "library override of it, and bake again"
        )
    if not any(slot.material for slot in obj.material_slots):
        _make(obj)
    return list(dict.fromkeys(slot.material for slot in obj.material_slots if slot.material is not None))


def own_nodes(obj: bpy.types.Object, material: bpy.types.Material, among: Collection[bpy.types.Object]) -> Tree:
    """The nodes of a material of the object that may be changed: its own, or a copy's that takes its place. among:
    objects that show the same as it does; they share a material."""
    if not _is_own(obj, material, among):
        copy = _copy_among(obj, material, among) or _copied(obj, material)
        for slot in [slot for slot in obj.material_slots if slot.material == material]:
            slot.link = "OBJECT"
            slot.material = copy
        material = copy
    return nodes_of(material)


def give_back(obj: bpy.types.Object) -> None:
    """Put what was copied into the place of the copies."""
    for slot in obj.material_slots:
        copy: Any = slot.material
        material: Any = copy.get(_OF) if copy is not None else None
        if material is None:
            continue
        slot.material = material
        _back_to_mesh(obj, slot)
        if not copy.users:
            bpy.data.materials.remove(copy)


def remove_made(obj: bpy.types.Object) -> None:
    """Remove a material that was made, unless others use it by now, and a slot that was made."""
    for slot in obj.material_slots:
        made: Any = slot.material
        if made is not None and MARK in made and made.users == 1:
            slot.material = None
            _back_to_mesh(obj, slot)
            bpy.data.materials.remove(made)
    mesh: Any = mesh_of(obj)
    if MARK not in mesh:
        return
    users = [each for each in bpy.data.objects if each.data == mesh]
    if not any(slot.material for user in users for slot in user.material_slots):
        mesh.materials.clear()
        del mesh[MARK]


def shows_maps(material: bpy.types.Material) -> bool:
    """Whether there are nodes of ours in it."""
    tree: Any = material.node_tree
    return tree is not None and any(MARK in node for node in tree.nodes)


def _is_own(obj: bpy.types.Object, material: bpy.types.Material, among: Collection[bpy.types.Object]) -> bool:
    if library_of(material) is not None or material.override_library is not None or nodes_of(material) is None:
        return False
    if material.users == 1 and mesh_of(obj).users == 1:
        return True  # which spares a look at all objects
    if any(copy.users and copy.get(_OF) == material for copy in bpy.data.materials):
        return False  # it must come back to others as it is
    return {user for user in bpy.data.objects if _uses(user, material)} | _given_by_nodes(material) <= {obj, *among}


def _uses(obj: bpy.types.Object, material: bpy.types.Material) -> bool:
    return any(slot.material == material for slot in obj.material_slots)


def _given_by_nodes(material: bpy.types.Material) -> set[bpy.types.Object]:
    """Objects that show it by their modifiers' nodes, or inputs of these, whatever their slots hold."""
    found: set[Any] = set()
    waiting: list[Any] = [material]
    while waiting:
        block = waiting.pop()
        users: Any = bpy.data.user_map(subset={block}, value_types={"OBJECT", "NODETREE"})[block] - found
        found |= users
        waiting += [user for user in users if isinstance(user, bpy.types.NodeTree)]
    return {user for user in found if isinstance(user, bpy.types.Object)}


def _copy_among(
    obj: bpy.types.Object, material: bpy.types.Material, among: Collection[bpy.types.Object]
) -> bpy.types.Material | None:
    """One that was made for another of those that show the same, and is theirs alone."""
    theirs = [slot.material for other in among for slot in other.material_slots if slot.material is not None]
    copies = (copy for copy in theirs if copy.get(_OF) == _origin(material) and _is_own(obj, copy, among))
    return next(copies, None)


def _origin(material: Any) -> Any:
    """What a copy was made of; a material that is no copy itself."""
    return material.get(_OF) or material


def _copied(obj: bpy.types.Object, material: bpy.types.Material) -> bpy.types.Material:
    copy: Any = material.copy()
    copy.name = f"{_origin(material).name} {obj.name}"
    if MARK in copy:
        del copy[MARK]  # the artist gave what was made to this object
    if not shows_maps(material):  # as a copy does, whose copy has its mark
        copy[_OF] = material
    if nodes_of(copy) is None:
        _give_nodes(copy)
    made: bpy.types.Material = copy
    return made


def _give_nodes(material: bpy.types.Material) -> None:
    """Nodes of the values that the material shows without them."""
    material.use_nodes = True
    tree: Tree = material.node_tree
    tree.nodes.clear()
    output, surface = tree.nodes.new("ShaderNodeOutputMaterial"), tree.nodes.new("ShaderNodeBsdfPrincipled")
    surface.location = (-300.0, 0.0)
    tree.links.new(surface.outputs[0], output.inputs["Surface"])
    surface.inputs["Base Color"].default_value = material.diffuse_color
    surface.inputs["Metallic"].default_value = material.metallic
    surface.inputs["Roughness"].default_value = material.roughness
    surface.inputs["Specular IOR Level"].default_value = material.specular_intensity


def _make(obj: bpy.types.Object) -> None:
    """A material of its own for an object that shows none."""
    mesh: Any = mesh_of(obj)
    if not mesh.materials:
        if (library := library_of(mesh)) is not None:
            raise InputError(
                f"{obj.name}: its mesh is linked from {library.filepath} and has no slot for a material to show the "
                "maps by; add one there, or make it local"
            )
        mesh.materials.append(None)
        mesh[MARK] = _SLOT
    material: Any = bpy.data.materials.new(obj.name)
    if nodes_of(material) is None:
        material.use_nodes = True
    material[MARK] = _MADE
    obj.material_slots[0].link = "OBJECT"
    obj.material_slots[0].material = material


def _back_to_mesh(obj: bpy.types.Object, slot: Any) -> None:
    """Let a slot of the object be the mesh's where both show the same."""
    if mesh_of(obj).materials[slot.slot_index] == slot.material:
        slot.material = None
        slot.link = "DATA"
