"""Whether what is written into a mesh would last."""

from __future__ import annotations

from typing import Any

import bpy

from ...core.base.errors import InputError
from ..typed import library_of, mesh_of


def check_local(obj: bpy.types.Object, label: str) -> None:
    """Raises InputError where the mesh is linked from a library."""
    if (library := library_of(mesh_of(obj))) is not None:
        raise InputError(f"{label}: its mesh is linked from {library.filepath}; make it local first")


def check_reachable(obj: bpy.types.Object, label: str) -> None:
    """Within `object_mode`. Raises InputError where the mesh is in Edit Mode all the same: it hides its UVs then."""
    if mesh_of(obj).is_editmode:
        raise InputError(f"{label}: it is in Edit Mode in another scene; leave that, and start again")


def check_writable(obj: bpy.types.Object, label: str) -> None:
    """Within `object_mode`. Raises InputError where what is written into the mesh would be lost, or cannot be."""
    check_local(obj, label)
    check_reachable(obj, label)
    sculpted: Any = obj
    if sculpted.use_dynamic_topology_sculpting:
        raise InputError(f"{label}: it is sculpted with Dyntopo; leave that, and start again")
