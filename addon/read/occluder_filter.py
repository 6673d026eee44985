"""Who occludes, of all that shows in a render."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy

from ...core.base.errors import InputError
from .block_ref import find, refs_of_words


@dataclass(frozen=True)
class OccluderFilter:
    """objects: session_uids of those that block light, None: all. alone: each target is blocked by itself alone.
    ground: a level plane below the targets blocks light, too. A target always blocks its own; excluded: session_uids
    of objects that never block any."""

    objects: frozenset[int] | None = None
    alone: bool = False
    ground: bool = False
    excluded: frozenset[int] = frozenset()

    def counts(self, uid: int, *, own: bool = False) -> bool:
        """Whether an object blocks light; own: one that is baked, or baked from."""
        if uid in self.excluded:
            return False
        return own or (not self.alone and (self.objects is None or uid in self.objects))


EVERYTHING = OccluderFilter()
_SURFACES = frozenset({"MESH", "CURVE", "SURFACE", "FONT", "META"})
SCENE, SELF = "scene", "self"  # words of the command
_OBJECT, _COLLECTION = "object:", "collection:"  # before a name, where the file has both


def named(words: Sequence[str], *, ground: bool = False) -> OccluderFilter:
    """The command's words: "scene", "self", or names of objects and collections, with all in them.

    Raises InputError for a name that the file has not, and for one that may mean more than one thing.
    """
    if word := next((word for word in (SCENE, SELF) if word in words), ""):
        if set(words) != {word}:
            raise InputError(f"{word}: it stands alone; an object of this name is {_OBJECT}{word}")
        return OccluderFilter(alone=word == SELF, ground=ground)
    return OccluderFilter(frozenset(uid for word in words for uid in _meant_by(word)), ground=ground)


def _meant_by(word: str) -> set[int]:
    """session_uids of an object, or of all in a collection."""
    if word.startswith(_OBJECT):
        objects, members = _object(word.removeprefix(_OBJECT)), None
    elif word.startswith(_COLLECTION):
        objects, members = None, _members(word.removeprefix(_COLLECTION))
    else:
        objects, members = _object(word), _members(word)
    if objects is not None and members is not None:
        raise InputError(
            f"{word}: an object and a collection have this name; give {_OBJECT}{word} or {_COLLECTION}{word}"
        )
    found = objects if members is None else members
    if found is None:
        raise InputError(f"{word}: no object or collection of this name can block light; name another")
    return found


def _object(name: str) -> set[int] | None:
    (ref,) = refs_of_words(bpy.data.objects, [name])
    return {ref.uid} if ref.uid else None


def _members(name: str) -> set[int] | None:
    (ref,) = refs_of_words(bpy.data.collections, [name])
    collection = find(bpy.data.collections, ref)
    return None if collection is None else {obj.session_uid for obj in collection.all_objects}


def may_occlude(obj: bpy.types.Object) -> bool:
    """Whether an object may block light, by its own settings: for lists, since a collection may hide it still."""
    shape = obj.type in _SURFACES or obj.is_instancer
    return bool(shape and not obj.hide_render and obj.visible_shadow)
