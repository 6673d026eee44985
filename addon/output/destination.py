"""Where baked maps go: images in the file, files by a template, or one channel of an image that is there."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

import bpy

from ...core.base.errors import InputError
from ...core.finish.baked import Baked
from ...core.finish.image_file import check_format, suffix
from ...core.finish.map_files import check_file, clean_name, tile_suffix, whole_path, write_map
from ...core.options import table
from ...core.options.values import told_by_images
from ...core.settings import Settings, check_files
from ..read.block_ref import BlockRef, find
from ..typed import space_of
from .blender_images import store, store_channel, store_file, store_tiles
from .result import Result
from .ro_nodes import CODE

PACKED, SAVED, COLOURS, CHANNEL = (each.upper() for each in (table.PACKED, table.SAVED, table.COLOURS, table.CHANNEL))


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

    def deliver(self, result: Result, settings: Settings, *, shown: bool = False) -> dict[str, bpy.types.Image]:
        """Put every map where it goes; returns the images by map. shown: in materials, whose nodes cannot read a code's
        files, so that the one that they are made for is packed, too. Raises InputError, what was there untouched."""
        baked = result.baked
        if self.kind == CHANNEL:
            assert self.image is not None  # it has been checked
            image = find(bpy.data.images, self.image)
            if image is None:
                raise InputError(f"{self.image.label}: the image was removed during the bake; choose another")
            if not (space := space_of(image)).is_data:
                baked.warnings.append(
                    f"{image.name}: its color space is {space.name}, so that materials read the map too dark; set it "
                    "to Non-Color"
                )
            return {name: store_channel(image, self.channel, each, self.dither) for name, each in baked.maps.items()}
        if self.kind == SAVED:
            images = {name: self._save(result, name, settings) for name in baked.maps}
            return images | (_stored(result.bakes, settings, [CODE]) if shown and CODE in baked.maps else {})
        return _stored(result.bakes, settings, baked.maps)

    def _save(self, result: Result, name: str, settings: Settings) -> bpy.types.Image:
        first: list[Path] = []  # of several files of a code the first stands for all
        for baked in result.bakes:
            path = self.file(result.name, name, settings, baked.tile)
            path.parent.mkdir(parents=True, exist_ok=True)
            dither = self.dither and self.depth == 8
            first.append(write_map(path, baked, name, told_by_images(settings), depth=self.depth, dither=dither)[0])
        return store_file(result.name, name, first[0], result.baked.tile)

    def file(self, owner: str, name: str, settings: Settings, tile: int | None = None) -> Path:
        """The file of an object's map, or of a tile of it. Raises InputError for a template that cannot be filled."""
        scene_file = bpy.data.filepath
        known = {
            "object": clean_name(owner),
            "map": name,
            "width": settings.image.width,
            "height": settings.image.height,
            "file": clean_name(Path(scene_file).stem) if scene_file else "untitled",
        }
        try:
            text = self.path.format(**known)
        except (LookupError, ValueError, AttributeError):
            words = ", ".join(f"{{{word}}}" for word in known)
            raise InputError(f"Path {self.path}: only {words} can stand in it") from None
        if not text.strip():
            raise InputError("Path: it is empty; give one, as //textures/{object}_{map}")
        ending = suffix(self.format)
        path = whole_path(Path(text), scene_file)
        stem = path.with_suffix("") if path.suffix.lower() == ending else path
        return stem.with_name(f"{stem.name}{tile_suffix(tile)}{ending}")

    def _check_paths(self, objects: Sequence[str], settings: Settings) -> None:
        taken: dict[Path, str] = {}
        for owner, name in product(objects, [each.name for each in settings.maps]):
            path = self.file(owner, name, settings)
            if path in taken:
                raise InputError(
                    f"Path {self.path}: {taken[path]} and {owner} {name} would be one file; put {{object}} "
                    "and {map} into it"
                )
            taken[path] = f"{owner} {name}"
            check_file(path)

    def _check_channel(self, objects: Sequence[str], settings: Settings) -> None:
        image: Any = self.image and find(bpy.data.images, self.image)
        if image is None:
            raise InputError("Image: none is chosen to bake into; choose one")
        if image.library is not None:
            raise InputError(f"{image.name}: it is linked from {image.library.filepath}; make it local first")
        if len(objects) > 1 or not settings.is_one_grey:
            raise InputError(f"{image.name}: its channel takes one grey map of one object; choose one of each")
        size = tuple(image.size)
        if size != settings.image.size:
            raise InputError(
                f"{image.name}: it is {size[0]}x{size[1]} and the bake "
                f"{settings.image.width}x{settings.image.height}; set the size to that of the image"
            )
        # Of bytes the depth tells of an alpha; of floats Blender holds four channels, whatever the file has.
        alpha = image.channels == 4 and (image.is_float or image.depth == 32)
        if self.channel == "A" and not alpha:
            raise InputError(f"{image.name}: it has no alpha; choose another channel")


def _stored(bakes: Sequence[Baked], settings: Settings, names: Iterable[str]) -> dict[str, bpy.types.Image]:
    """These maps of an object, or of its tiles, as packed images."""
    parts = [replace(baked, maps={name: baked.maps[name] for name in names}) for baked in bakes]
    return store_tiles(parts, settings) if parts[0].tile is not None else store(parts[0])
