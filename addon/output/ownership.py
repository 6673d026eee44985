"""Whose an image of ours is, whatever either is called.

An object holds pointers to its images: Blender keeps these right through renames, saving and appending, and nobody
holds a copy of an image. A copy of an object holds what that holds, and tells which object was given it. What is
linked, or overrides that, loses its pointers when the file is loaded again: an image that nobody holds is taken by what
it says of itself.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import bpy

from ...core.base.atomic_file import leads_to
from ...core.finish.map_images import title
from ...core.finish.report import Json, first_of
from ..read.block_ref import Renewal, find, stored
from ..typed import library_of
from .result import Result

MARK = "occlusion_bake"  # on an image of ours: "object/map"; of an atlas its name in the object's place
_ATLAS = "occlusion_bake_shared"  # and that it is one
_HELD = "occlusion_bake_images"  # on an object: what it holds


@dataclass(frozen=True)
class _Held:
    """An image that an object holds: of which map, of which atlas, or empty. given: the object that got it, as
    `stored`; its copies hold it, too."""

    image: bpy.types.Image | None
    map: str
    atlas: str
    given: str


@dataclass(frozen=True, eq=False)
class Owner:
    """Who has images: an object, or several an atlas. name: what new images are called after. atlas: its name, or
    empty."""

    name: str
    objects: tuple[bpy.types.Object, ...]
    atlas: str = ""

    @classmethod
    def of(cls, result: Result) -> Owner:
        """The objects of a result, less those that are no more."""
        there = (find(bpy.data.objects, ref) for ref in result.objects)
        return cls(result.name, tuple(obj for obj in there if obj is not None), result.atlas)

    def title(self, name: str) -> str:
        """What a new image of a map is called."""
        return f"{self.name} {title(name)}"

    def earlier(self, name: str) -> bpy.types.Image | None:
        """The image of an earlier bake of this map; none that others have, too."""
        owners, ours = _owners(), set(self.objects)
        for held in (held for obj in self.objects for held in _held_by(obj)):
            image = held.image if self._is_for(held, name) else None
            if image is not None and library_of(image) is None and ours.issuperset(owners[image]):
                return image
        return next((image for image in bpy.data.images if image not in owners and self._made(image, name)), None)

    def kept(self, name: str, renewal: Renewal) -> bpy.types.Image | None:
        """The image that all these objects were given for a map; None where one was given none, or another. Copies of
        objects were given nothing."""
        images = {self._given_to(obj, name, renewal) for obj in self.objects}
        return images.pop() if len(images) == 1 else None

    def _given_to(self, obj: bpy.types.Object, name: str, renewal: Renewal) -> bpy.types.Image | None:
        given = (held for held in _held_by(obj) if self._is_for(held, name) and _is_given(obj, held, renewal))
        return next((held.image for held in given), None)

    def _is_for(self, held: _Held, name: str) -> bool:
        return (held.map, held.atlas) == (name, self.atlas)

    def _made(self, image: bpy.types.Image, name: str) -> bool:
        """Whether an image that nobody holds is as it was made: of an object that was removed, or could not keep it."""
        same = image.get(MARK) == self._mark(name) and bool(image.get(_ATLAS)) == bool(self.atlas)
        return same and image.name == self.title(name) and library_of(image) is None

    def files_of_others(self) -> set[Path]:
        """Image files that others have for their textures; of a UDIM layout all that are there."""
        theirs = [image for image, owners in _owners().items() if not set(owners).issubset(self.objects)]
        return {file for image in theirs if image.packed_file is None and image.filepath for file in files_of(image)}

    def hold(self, image: bpy.types.Image, name: str) -> None:
        """Have an image for a map from now on. The file keeps it, though nothing uses it yet."""
        image[MARK], image[_ATLAS] = self._mark(name), bool(self.atlas)
        image.use_fake_user = True
        for obj in self.objects:
            others = [held for held in _held_by(obj) if not self._is_for(held, name)]
            _hold(obj, [*others, _Held(image, name, self.atlas, json.dumps(stored([obj.session_uid])))])

    def _mark(self, name: str) -> str:
        return f"{self.atlas or self.objects[0].name_full}/{name}"


def owners_of(image: bpy.types.Image) -> list[bpy.types.Object]:
    """The objects that hold an image; copies of them do not count."""
    return _owners().get(image, [])


def renew_holders() -> None:
    """Bring up to date which object was given what: when a file is saved or loaded, for ids are those of a session."""
    renewal = Renewal()
    for obj in bpy.data.objects:
        if library_of(obj) is None and (held := list(_held_by(obj))):
            given = [_given(each, renewal) for each in held]
            _hold(
                obj,
                [replace(each, given=json.dumps(now)) if now else each for each, now in zip(held, given, strict=True)],
            )


def _owners() -> dict[bpy.types.Image, list[bpy.types.Object]]:
    found: dict[bpy.types.Image, list[tuple[bpy.types.Object, _Held]]] = {}
    for obj in bpy.data.objects:
        for held in _held_by(obj):
            if held.image is not None:
                found.setdefault(held.image, []).append((obj, held))
    shared = any(len(holders) > 1 for holders in found.values())
    renewal = Renewal() if shared else None  # which looks at all objects
    return {image: _less_copies(holders, renewal) for image, holders in found.items()}


def _less_copies(holders: list[tuple[bpy.types.Object, _Held]], renewal: Renewal | None) -> list[bpy.types.Object]:
    """Copies own an image only where what they were made of holds it no more."""
    every = [obj for obj, _ in holders]
    if len(holders) == 1 or renewal is None:
        return every
    return [obj for obj, held in holders if _is_given(obj, held, renewal)] or every


def _is_given(obj: bpy.types.Object, held: _Held, renewal: Renewal) -> bool:
    given = _given(held, renewal)
    return given is not None and any(uid == obj.session_uid for uid, *_ in given["objects"])


def _given(held: _Held, renewal: Renewal) -> Json | None:
    """The object that was given it, as that is kept now; None where what is kept is not ours."""
    try:
        return renewal.of(json.loads(held.given))
    except (ValueError, KeyError, TypeError):
        return None


def files_of(image: bpy.types.Image) -> list[Path]:
    """An image's files; of a UDIM layout one for each tile."""
    path = leads_to(Path(bpy.path.abspath(image.filepath, library=image.library)))
    tiles = [tile.number for tile in image.tiles] if image.source == "TILED" else [0]
    return [path.with_name(path.name.replace("<UDIM>", str(number))) for number in tiles]


def told(image: bpy.types.Image) -> str:
    """Whose it is, and of which map, as panels have it."""
    owner, _, name = str(image.get(MARK, "")).rpartition("/")
    names = [] if image.get(_ATLAS) else [obj.name_full for obj in owners_of(image)]
    return f"{first_of(names, 1) or owner}, {name}"


def _held_by(obj: bpy.types.Object) -> Iterator[_Held]:
    groups: Any = obj.get(_HELD, ())
    return (_Held(**{field: group.get(field) for field in _Held.__annotations__}) for group in groups)


def _hold(obj: bpy.types.Object, held: list[_Held]) -> None:
    obj[_HELD] = [vars(each) for each in held if each.image is not None]
