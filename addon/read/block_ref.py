"""Which object or image: within a session by its session_uid, whatever it is renamed to; in files by name and library.

Names alone do not tell: what is linked from a library may be called as something of the file's own is, and what is
called so today may be another thing tomorrow.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar
from uuid import uuid4

import bpy

from ...core.base.errors import InputError
from ...core.finish.report import Json
from ...core.scene.ground_plane import NAME as GROUND
from ..typed import library_of

_SESSION = uuid4().hex  # whose session_uids ours are: those of another say nothing

_Entry = tuple[int, str, str]  # an object: its session_uid, 0 where that is not known; its name and library
_Block = TypeVar("_Block", bound=bpy.types.ID)


@dataclass(frozen=True)
class BlockRef:
    """uid: its session_uid; 0 where there is none of that name. label: what lines and files call it."""

    uid: int
    label: str


def refs_of(objects: Iterable[bpy.types.Object]) -> list[BlockRef]:
    """In their order."""
    labels = labels_of(bpy.data.objects)
    return [BlockRef(obj.session_uid, labels[obj.session_uid]) for obj in objects]


def mesh_labels() -> list[str]:
    """Of all meshes of the file."""
    return [ref.label for ref in refs_of(obj for obj in bpy.data.objects if obj.type == "MESH")]


def find(blocks: Iterable[_Block], ref: BlockRef) -> _Block | None:
    """The one that is meant, None where it is not among these, or no more."""
    return next((block for block in blocks if block.session_uid == ref.uid), None)


def by_ref(blocks: Iterable[_Block], refs: Iterable[BlockRef]) -> dict[BlockRef, _Block | None]:
    """`find` of many."""
    there = {block.session_uid: block for block in blocks}
    return {ref: there.get(ref.uid) for ref in refs}


def labels_of(every: Iterable[bpy.types.ID], known: Iterable[BlockRef] = ()) -> dict[int, str]:
    """By session_uid, what all objects, or all collections, of the file are called, no two the same, nor as the ground:
    their names; where one is linked and another has its name, with its library, as in Blender's lists. known: those
    that keep the label that they have."""
    blocks = sorted(every, key=lambda block: library_of(block) is not None)  # the file's own first
    called = Counter(block.name for block in blocks)
    labels = {ref.uid: ref.label for ref in known}
    taken = {GROUND, *labels.values()}
    for block in blocks:
        if block.session_uid not in labels:
            alone = library_of(block) is None or called[block.name] == 1
            labels[block.session_uid] = label = _free(block.name if alone else block.name_full, taken)
            taken.add(label)
    return labels


def _free(label: str, taken: set[str]) -> str:
    """The label, with a number where it is taken: what is called "A [b.blend]" need not be linked."""
    number, free = 1, label
    while free in taken:
        number += 1
        free = f"{label} ({number})"
    return free


def refs_of_words(
    every: Iterable[bpy.types.ID], words: Sequence[str], among: Iterable[bpy.types.ID] = ()
) -> list[BlockRef]:
    """What the command means by these names: the file's own first; what is linked by its label, or its name where no
    other has that. among: which of all go first. Raises InputError for a name of several; one that none has gives a
    reference to nothing."""
    labels = labels_of(every)
    near, all_of_them = (_by_name(blocks, labels) for blocks in (among, every))
    return [_one_of(word, near.get(word) or all_of_them.get(word, [])) for word in words]


def _by_name(blocks: Iterable[bpy.types.ID], labels: Mapping[int, str]) -> dict[str, list[BlockRef]]:
    """By all that each may be called."""
    found: dict[str, list[BlockRef]] = {}
    for block in blocks:
        ref = BlockRef(block.session_uid, labels[block.session_uid])
        for name in {ref.label, block.name, block.name_full}:
            found.setdefault(name, []).append(ref)
    return found


def _one_of(word: str, refs: Sequence[BlockRef]) -> BlockRef:
    exact = [ref for ref in refs if ref.label == word] or refs
    if len(exact) > 1:
        raise InputError(f"{word}: {len(exact)} have this name; give {' or '.join(ref.label for ref in exact)}")
    return exact[0] if exact else BlockRef(0, word)


def stored(uids: Iterable[int]) -> Json:
    """Objects as they are kept in files; less those that are no more."""
    objects = {obj.session_uid: obj for obj in bpy.data.objects}
    return {"session": _SESSION, "objects": [_entry(objects[uid]) for uid in uids if uid in objects]}


def restored(kept: Json) -> list[BlockRef]:
    """The objects that were `stored`. Those that are no more are references to nothing. Raises KeyError, TypeError,
    ValueError for what was not stored so."""
    labels = labels_of(bpy.data.objects)
    now = Renewal().of(kept)["objects"]
    return [BlockRef(uid, labels[uid]) if uid in labels else BlockRef(0, name) for uid, name, _ in now]


class Renewal:
    """Brings what is `stored` up to what the file holds now."""

    def __init__(self) -> None:
        self._by_uid = {obj.session_uid: obj for obj in bpy.data.objects}
        self._by_place = {(obj.name, _library(obj)): obj for obj in bpy.data.objects}

    def of(self, kept: Json) -> Json:
        """The same objects, as they are called now: by their session_uid where that is still known, else, after the
        file was loaded or something took the place of what was removed, by name and library. Others keep their names.
        Raises KeyError, TypeError, ValueError."""
        same = kept["session"] == _SESSION
        return {
            "session": _SESSION,
            "objects": [self._entry(uid if same else 0, name, library) for uid, name, library in kept["objects"]],
        }

    def _entry(self, uid: int, name: str, library: str) -> _Entry:
        obj = self._by_uid.get(uid) or self._by_place.get((name, library))
        return (uid, name, library) if obj is None else _entry(obj)


def _entry(obj: bpy.types.Object) -> _Entry:
    return obj.session_uid, obj.name, _library(obj)


def _library(obj: bpy.types.Object) -> str:
    """What the file calls the library that an object is linked from, wherever that lies; empty for none."""
    library = library_of(obj)
    return library.name if library is not None else ""
