"""What a reading of a scene finds of its materials: each is followed once, however many objects have it."""

from __future__ import annotations

from typing import Generic, TypeVar

import bpy

from ..typed import uid_of
from .image_pixels import ImagePixels

Found = TypeVar("Found")


class MaterialCache(Generic[Found]):
    """override: a material that stands for all, as a view layer can have. pictures: where images are kept that others
    read, too."""

    def __init__(self, override: bpy.types.Material | None = None, pixels: ImagePixels | None = None) -> None:
        self._override, self._pixels = override, pixels or ImagePixels()
        self._found: dict[int, Found] = {}

    def of(self, material: bpy.types.Material | None, lines: list[str]) -> Found:
        """What is found of a material. What there is to say of it is added to `lines` the first time."""
        material = self._override or material
        if material is None:
            return self._nothing()
        uid = uid_of(material)
        if uid not in self._found:
            self._found[uid] = self._read(material, lines)
        return self._found[uid]

    def _nothing(self) -> Found:
        """Of no material."""
        raise NotImplementedError

    def _read(self, material: bpy.types.Material, lines: list[str]) -> Found:
        raise NotImplementedError
