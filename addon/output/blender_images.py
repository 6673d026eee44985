"""Baked maps as Blender images."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal

import bpy
import numpy as np

from ...core.base.arrays import Floats
from ...core.finish.baked import Baked
from ...core.finish.file_names import clean_name
from ...core.finish.image_file import write_image
from ...core.finish.map_images import pictures
from ...core.finish.report import image_metadata
from ...core.options.values import told_by_images
from ...core.settings import Settings
from ..colour_space import make_data
from ..typed import found_in, pixels_in
from .ownership import MARK, Owner

_DEPTHS_WITH_ALPHA = (32, 128)  # bits a pixel, of bytes and floats


def store(owner: Owner, baked: Baked) -> dict[str, bpy.types.Image]:
    """Put every map into an image named after its owner, the one of an earlier bake where there is one.

    Float, Non-Color, packed into the file so that it is saved with it. Returns the images by map.
    """
    return {name: _store(owner, name, values) for each in baked.maps.values() for name, values in pictures(each)}


def _store(owner: Owner, name: str, values: Floats) -> bpy.types.Image:
    height, width = values.shape[:2]
    image = _image(owner, name, width, height, alpha=values.shape[2:] == (4,))
    pixels_in(image).foreach_set(_rgba(values).ravel())
    image.update()
    image.pack()
    return image


@contextmanager
def tile_files() -> Iterator[TileFiles]:
    """A place for them, which is gone afterwards."""
    with tempfile.TemporaryDirectory(prefix="occlusion-bake-") as folder:
        yield TileFiles(Path(folder))


class TileFiles:
    """The tiles of a UDIM layout on their way into packed images, one layout after the other. Blender writes the pixels
    of the first tile alone, so all go through files; no more than one tile is in memory, and images change when all are
    there."""

    def __init__(self, folder: Path) -> None:
        """folder: empty, for this alone."""
        self._folder = folder
        self._last: dict[str, tuple[Path, int]] = {}  # by picture: its newest file, and the tile

    def begin(self) -> None:
        """A new layout: of one that was not brought to an end nothing may stay, for Blender takes what it finds."""
        for file in self._folder.iterdir():
            file.unlink()
        self._last.clear()

    def add(self, baked: Baked, settings: Settings) -> None:
        """The next tile."""
        assert baked.tile is not None
        for name, each in baked.maps.items():
            told = image_metadata(baked, name, told_by_images(settings))
            for part, values in pictures(each):
                path = self._folder / f"{part}.{baked.tile}.exr"
                write_image(path, values, depth=32, coverage=each.coverage, metadata=told)
                self._last[part] = path, baked.tile

    def stored(self, owner: Owner) -> dict[str, bpy.types.Image]:
        """Every map as a tiled image, as `store` does."""
        images = {part: _loaded(owner, part, path, tile) for part, (path, tile) in self._last.items()}
        for part, image in images.items():
            _pack(image, f"{clean_name(owner.title(part))}.<UDIM>.exr")
        return images


def store_file(owner: Owner, name: str, path: Path, tile: int | None = None) -> bpy.types.Image:
    """The image of a file that was written, in the place of that of an earlier bake of the same map. tile: the file is
    that of one of a UDIM layout, and the others lie beside it."""
    old = owner.earlier(name)
    if tile is None and old is not None and old.source == "FILE" and old.packed_file is None:
        old.filepath = str(path)
        old.reload()
        make_data(old)
        owner.hold(old, name)
        return old
    return _loaded(owner, name, path, tile)


def _loaded(owner: Owner, name: str, path: Path, tile: int | None) -> bpy.types.Image:
    """A new image of a file, or of tiles' files, in the place of an earlier bake's."""
    image = bpy.data.images.load(str(path))
    _take_place(image, owner.earlier(name), owner.title(name))
    owner.hold(image, name)
    if tile is not None:
        image.source = "TILED"  # Blender looks for the other tiles' files
    make_data(image)
    return image


def _pack(image: bpy.types.Image, name: str) -> None:
    """Pack an image whose files will go. name: what they are called from now on, and where they are unpacked; <UDIM> in
    it stands for the number of a tile."""
    image.pack()
    image.filepath_raw = f"//{name}"
    packed: Any
    for packed in image.packed_files:
        packed.filepath = f"//{name.replace('<UDIM>', str(packed.tile_number))}"


def _take_place(image: bpy.types.Image, old: bpy.types.Image | None, name: str) -> None:
    """Let all that uses an old image use another."""
    if old is not None:
        name = old.name  # the artist may have given it another
        old.user_remap(image)
        bpy.data.images.remove(old)
    image.name = name


def _image(owner: Owner, name: str, width: int, height: int, *, alpha: bool) -> bpy.types.Image:
    old = image = owner.earlier(name)
    # Never write into a file's image, nor into tiles, of which Blender writes the first alone. One made without alpha
    # holds one until it is saved, and loses it then.
    file = image is not None and image.packed_file is None and image.source == "FILE"
    if image is None or file or image.source == "TILED" or (alpha and image.depth not in _DEPTHS_WITH_ALPHA):
        image = bpy.data.images.new(owner.title(name), width, height, alpha=alpha, float_buffer=True, is_data=True)
        _take_place(image, old, image.name)
    elif tuple(image.size) != (width, height):
        image.scale(width, height)
    owner.hold(image, name)
    mode: Literal["CHANNEL_PACKED", "NONE"] = "CHANNEL_PACKED" if alpha else "NONE"
    if image.alpha_mode != mode:
        image.alpha_mode = mode
    make_data(image)
    return image


def _rgba(values: Floats) -> Floats:
    """(H, W), (H, W, 3) or (H, W, 4) as Blender keeps pixels: four channels, the bottom row first."""
    pixels = np.ones((*values.shape[:2], 4), dtype=np.float32)
    channels = values[..., np.newaxis] if values.ndim == 2 else values
    pixels[..., : max(channels.shape[2], 3)] = channels[::-1]
    return pixels


def show_picture(name: str, path: str) -> bpy.types.Image:
    """Load a picture under this name, in the place of an earlier one, and pack it: its file may go."""
    image = bpy.data.images.load(path)
    image[MARK] = "picture"
    _pack(image, f"{clean_name(name)}.png")
    old = found_in(bpy.data.images, name)
    _take_place(image, old if old is not None and old.get(MARK) == "picture" else None, name)
    return image
