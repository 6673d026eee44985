"""Where baked maps go: images in the file, files by a template, or one channel of an image that is there."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import count, product
from pathlib import Path
from string import Formatter

import bpy

from ...core.base.errors import InputError
from ...core.finish.file_names import FileNames, clean_name
from ...core.finish.image_file import check_format, suffix
from ...core.finish.map_files import check_file, files_of, tile_suffix, whole_path, write_map
from ...core.options import table
from ...core.options.values import told_by_images
from ...core.settings import Settings, check_files
from ..read.block_ref import BlockRef, find, mesh_labels
from .blender_images import TileFiles, store, store_file
from .image_channel import check_image_channel, lines_on_channel, store_channel
from .ownership import Owner
from .result import Result
from .ro_nodes import CODE

PACKED, SAVED, COLOURS, CHANNEL = (each.upper() for each in (table.PACKED, table.SAVED, table.COLOURS, table.CHANNEL))
_TILE = re.compile("[._]?<UDIM>")  # as Blender writes it: the number is put before the ending in any case
_FOLDER = re.compile(r"(^|/)\s*\.{0,2}\s*$|^~[^/]*$")


@dataclass(frozen=True)
class Destination:
    """kind: PACKED, SAVED, CHANNEL, or COLOURS, which are no images (color_attributes.py). path, format, depth: of
    files. image, channel: an image, and which of RGBA. dither: of integers."""

    kind: str = PACKED
    path: str = ""
    format: str = "png"
    depth: int = 16
    dither: bool = True
    image: BlockRef | None = None
    channel: str = "R"

    @property
    def dithers(self) -> bool:
        """Whether files are: those of 8 bits alone need it."""
        return self.dither and self.depth == 8

    def check(self, objects: Sequence[str], settings: Settings) -> None:
        """Refuse, before a bake, what could not be delivered after it. Raises InputError."""
        if self.kind == COLOURS and not settings.are_grey:
            raise InputError("Color Attribute: it takes AO and RO alone; switch the other maps off, or bake images")
        if self.kind == SAVED:
            check_format(self.format, self.depth)
            check_files(settings.maps, self.format, self.depth)
            self._check_paths(objects, settings)
        if self.kind == CHANNEL:
            self._check_channel(objects, settings)

    def deliver(
        self, result: Result, settings: Settings, tiles: TileFiles, *, shown: bool = False
    ) -> dict[str, bpy.types.Image]:
        """Put every map where it goes; returns the images by map, of a UDIM layout with its last tile. tiles: keeps
        what is packed until then. shown: in materials, whose nodes cannot read a code's files, so that the one that
        they are made for is packed, too. Raises InputError, what was there untouched."""
        baked = result.baked
        if self.kind == CHANNEL:
            assert self.image is not None  # it has been checked
            image = find(bpy.data.images, self.image)
            if image is None:
                raise InputError(f"{self.image.label}: the image was removed during the bake; choose another")
            for each in baked.maps.values():
                store_channel(image, self.channel, each.values, dither=self.dither)
            baked.warnings += lines_on_channel(image, self.channel)
            return dict.fromkeys(baked.maps, image)
        if self.kind == SAVED:
            images = self._save(result, settings)
            return images | (_stored(result, settings, tiles, [CODE]) if shown and CODE in baked.maps else {})
        return _stored(result, settings, tiles, baked.maps)

    def _save(self, result: Result, settings: Settings) -> dict[str, bpy.types.Image]:
        baked, images = result.baked, {}
        owner = Owner.of(result)
        for name in baked.maps:
            path = self._free_file(owner, result, name, settings)
            path.parent.mkdir(parents=True, exist_ok=True)
            # Of several files of a code the first stands for all.
            first, *_ = write_map(path, baked, name, told_by_images(settings), depth=self.depth, dither=self.dithers)
            if result.is_last:
                images[name] = store_file(owner, name, first, baked.tile)
        return images

    def _free_file(self, owner: Owner, result: Result, name: str, settings: Settings) -> Path:
        """The file for a map, with a number where that is the texture of another object, which was called so before."""
        baked, others = result.baked, None
        wanted = path = self.file(result.name, name, settings, baked.tile)
        for number in count(2):
            shown, *_ = files_of(path, baked.maps[name].kind, baked.tile, self.depth)
            if not shown.exists():
                break
            others = {self._names.same(str(file)) for file in owner.files_of_others()} if others is None else others
            if self._names.same(str(shown)) not in others:
                break
            end = f"{tile_suffix(baked.tile)}{wanted.suffix}"
            path = wanted.with_name(f"{wanted.name.removesuffix(end)}_{number}{end}")
        if path != wanted:
            baked.warnings.append(
                f"{result.name}: its {name} is {path.name}; {wanted.name} is another object's texture"
            )
        return path

    def file(self, owner: str, name: str, settings: Settings, tile: int | None = None) -> Path:
        """The file of an object's map, or of a tile of it. Raises InputError for a template that cannot be filled."""
        scene_file, ending = bpy.data.filepath, suffix(self.format)
        template = self.path[: -len(ending)] if self.path.lower().endswith(ending) else self.path
        template = _TILE.sub("", template).replace("\\", "/")  # which Blender, too, takes for the same
        if not template.strip():
            raise InputError("Path: it is empty; give one, as //textures/{object}_{map}")
        if _FOLDER.search(template):
            raise InputError(f"Path {self.path}: it is a folder; end it in a file's name, as {{object}}_{{map}}")
        known: dict[str, str | int] = {
            "object": self._names.of(owner),
            "map": name,
            "width": settings.image.width,
            "height": settings.image.height,
            "file": clean_name(Path(scene_file).stem) if scene_file else "untitled",
        }
        try:
            text = _filled(template, known)
        except (KeyError, ValueError):
            words = ", ".join(f"{{{word}}}" for word in known)
            raise InputError(f"Path {self.path}: only {words} can stand in it") from None
        path = self._placed(text)
        return path.with_name(f"{path.name}{tile_suffix(tile)}{ending}")

    @cached_property
    def _names(self) -> FileNames:
        """As the objects were called when they were asked for first: some may be renamed during the bake."""
        folder = next(place for place in self._placed(self.path).parents if "{" not in str(place))
        return FileNames(folder, mesh_labels())

    def _placed(self, text: str) -> Path:
        """The whole path; what is relative lies below the .blend file's folder, for Blender's own may be any. An object
        whose name begins with ~ is no one's home."""
        if not self.path.startswith(("~", "//")) and not Path(text).is_absolute():
            if not bpy.data.filepath:
                raise InputError(
                    f"Path {self.path}: it begins in the folder of the .blend file, which is not saved; save that or "
                    "give a full path"
                )
            text = f"//{text}"
        if self.path.startswith("//"):
            text = f"//{text.lstrip('/')}"  # one more would be the root's
        if sys.platform == "win32" and self.path.startswith("\\\\"):
            text = text.replace("/", "\\")  # a network's share
        return whole_path(text, bpy.data.filepath)

    def _check_paths(self, objects: Sequence[str], settings: Settings) -> None:
        taken: dict[str, str] = {}
        for owner, name in product(objects, [each.name for each in settings.maps]):
            path = self.file(owner, name, settings)
            same = self._names.same(str(path))
            if same in taken:
                raise InputError(
                    f"Path {self.path}: {taken[same]} and {owner} {name} would be one file; put {{object}} "
                    "and {map} into it"
                )
            taken[same] = f"{owner} {name}"
            check_file(path)

    def _check_channel(self, objects: Sequence[str], settings: Settings) -> None:
        image = find(bpy.data.images, self.image) if self.image is not None else None
        if image is None:
            raise InputError("Image: none is chosen to bake into; choose one")
        if len(objects) > 1 or not settings.is_one_grey:
            raise InputError(f"{image.name}: its channel takes one grey map of one object; choose one of each")
        check_image_channel(image, self.channel, settings.image.size)


def _filled(template: str, words: Mapping[str, str | int]) -> str:
    """A template with what its words in braces stand for. Raises KeyError and ValueError for anything else in braces,
    as the indices, attributes and forms that str.format would follow."""
    parts = []
    for text, word, form, conversion in Formatter().parse(template):
        if form or conversion:
            raise ValueError
        parts += [text, "" if word is None else str(words[word])]
    return "".join(parts)


def _stored(result: Result, settings: Settings, tiles: TileFiles, names: Iterable[str]) -> dict[str, bpy.types.Image]:
    """These maps of an object as packed images; of a UDIM layout none before the last tile."""
    part = replace(result.baked, maps={name: result.baked.maps[name] for name in names})
    if part.tile is None:
        return store(Owner.of(result), part)
    if result.is_first:
        tiles.begin()
    tiles.add(part, settings)
    return tiles.stored(Owner.of(result)) if result.is_last else {}
