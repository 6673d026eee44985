"""What objects have of earlier bakes, where a bake would give them the same: images, as files, tell by a hash what they
were baked from."""

from __future__ import annotations

from collections.abc import Iterable

import bpy

from ...core.base.digest import digest
from ...core.base.errors import InputError
from ...core.finish.map_files import bear, inputs_told
from ...core.finish.map_files import files_of as map_files_of
from ...core.finish.map_images import picture_names
from ...core.maps.map import Map
from ...core.settings import Settings
from ..read.block_ref import Renewal
from .destination import PACKED, SAVED, Destination
from .ownership import Owner, files_of
from .result import Texture
from .ro_nodes import CODE

_INPUTS = "occlusion_bake_inputs"  # on an image of ours
Images = dict[str, bpy.types.Image]


def store_inputs(destination: Destination, inputs: Iterable[str], images: Iterable[bpy.types.Image]) -> None:
    """Let images tell of what they, by tiles, were baked."""
    told = _told(destination, inputs)
    for image in images:
        image[_INPUTS] = told


class KeptImages:
    """Those of this moment. shown: in materials, whose nodes read none of a code's files."""

    def __init__(self, destination: Destination, settings: Settings, *, shown: bool) -> None:
        self._destination, self._settings = destination, settings
        self._renewal, self._objects = Renewal(), {obj.session_uid: obj for obj in bpy.data.objects}
        # What is written into is not ours alone, and what is packed beside files is not looked after.
        kept = (PACKED,) if shown and any(each.name == CODE for each in settings.maps) else (PACKED, SAVED)
        self._may_be = destination.kind in kept

    def of(self, texture: Texture) -> Images | None:
        """All images of a texture, by map, as a bake would leave them; None where one is missing, of other inputs, or
        painted on and not saved since."""
        objects = self.objects_of(texture)
        if not self._may_be or len(objects) < len(texture.objects):
            return None
        owner = Owner(texture.name, tuple(objects), texture.atlas)
        told, images = _told(self._destination, texture.inputs), Images()
        for each in self._settings.maps:
            # Of several files of a code the first stands for all.
            for name in [each.name] if self._destination.kind == SAVED else picture_names(each):
                image = owner.kept(name, self._renewal)
                if image is None or image.get(_INPUTS) != told or image.is_dirty:
                    return None
                images[name] = image
            if self._destination.kind == SAVED and not self._has_files(texture, each, images[each.name]):
                return None
        return images

    def objects_of(self, texture: Texture) -> list[bpy.types.Object]:
        """Those that are there."""
        return [self._objects[ref.uid] for ref in texture.objects if ref.uid in self._objects]

    def _has_files(self, texture: Texture, kind: Map, image: bpy.types.Image) -> bool:
        """Whether a map's files are where they would be saved now, of these inputs, and what its image shows."""
        to = self._destination
        expected = []
        for tile, inputs in zip(texture.tiles or (None,), texture.inputs, strict=True):
            try:
                path = to.file(texture.name, kind.name, self._settings, tile)
            except InputError:
                return False
            files = map_files_of(path, kind, tile, to.depth)
            if not bear(files, inputs_told(inputs, to.depth, dither=to.dithers), thoroughly=False):
                return False
            expected.append(files[0])
        return image.packed_file is None and files_of(image) == expected


def _told(destination: Destination, inputs: Iterable[str]) -> str:
    return digest(list(inputs), destination.kind).hex()
