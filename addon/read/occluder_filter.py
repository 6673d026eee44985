"""Who occludes, of all that shows in a render."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy

from ...core.base.errors import InputError


@dataclass(frozen=True)
class OccluderFilter:
    """names: objects that block light, None: all. alone: each target is blocked by itself alone. ground: a level plane
    below the targets blocks light, too. A target always blocks its own; excluded: objects that never block any."""

    names: frozenset[str] | None = None
    alone: bool = False
    ground: bool = False
    excluded: frozenset[str] = frozenset()

    def counts(self, name: str, *, own: bool = False) -> bool:
        """Whether an object blocks light; own: one that is baked, or baked from."""
        if name in self.excluded:
            return False
        return own or (not self.alone and (self.names is None or name in self.names))


EVERYTHING = OccluderFilter()
_SURFACES = frozenset({"MESH", "CURVE", "SURFACE", "FONT", "META"})
SCENE, SELF = "scene", "self"  # words of the command


def named(words: Sequence[str], *, ground: bool = False) -> OccluderFilter:
    """The command's words: "scene", "self", or names of objects and collections, with all in them.

    Raises InputError for a name that the file has not.
    """
    if list(words) == [SCENE]:
        return OccluderFilter(ground=ground)
    if list(words) == [SELF]:
        return OccluderFilter(alone=True, ground=ground)
    names: set[str] = set()
    for word in words:
        if word not in bpy.data.objects and word not in bpy.data.collections:
            raise InputError(f"{word}: no object or collection of this name can block light; name another")
        if word in bpy.data.collections:
            names.update(obj.name for obj in bpy.data.collections[word].all_objects)
        if word in bpy.data.objects:
            names.add(word)
    return OccluderFilter(frozenset(names), ground=ground)


def arguments_of(occluding: OccluderFilter) -> list[str]:
    """As the command takes it: `named` of these gives the same."""
    if occluding.alone or occluding.names == frozenset():
        return [SELF]
    return [SCENE] if occluding.names is None else sorted(occluding.names)


def may_occlude(obj: bpy.types.Object) -> bool:
    """Whether an object may block light, by its own settings: for lists, since a collection may hide it still."""
    shape = obj.type in _SURFACES or obj.is_instancer
    return bool(shape and not obj.hide_render and obj.visible_shadow)
