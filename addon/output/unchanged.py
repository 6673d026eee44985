"""Whether what objects have is what a bake would give them: images keep the hash of what they were baked from."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import bpy

from ...core.base.digest import digest
from ...core.base.errors import InputError
from ...core.finish.image_file import read_metadata
from ...core.finish.map_images import picture_names
from ...core.settings import Settings
from ..read.block_ref import BlockRef, by_ref
from .destination import PACKED, SAVED, Destination
from .ownership import Owner, files_of

_INPUTS = "occlusion_bake_inputs"  # on an image of ours


def store_inputs(destination: Destination, inputs: str, images: Iterable[bpy.types.Image]) -> None:
    """Let images tell of what they were baked."""
    for image in images:
        image[_INPUTS] = _told(destination, inputs)


def have(destination: Destination, settings: Settings, inputs: str, refs: Sequence[BlockRef], atlas: str = "") -> bool:
    """Whether objects have all images that a bake of these inputs would give them, as it left them. atlas: the name of
    the one image of all."""
    if destination.kind not in (PACKED, SAVED):
        return False  # what is written into is not ours alone
    objects = [obj for obj in by_ref(bpy.data.objects, refs).values() if obj is not None]
    owner, told = Owner(atlas or refs[0].label, tuple(objects), atlas), _told(destination, inputs)
    # Of several files of a code the first stands for all.
    saved = destination.kind == SAVED
    names = [name for each in settings.maps for name in ([each.name] if saved else picture_names(each))]
    images = [owner.earlier(name) for name in names]
    return all(image is not None and image.get(_INPUTS) == told and _is_whole(image) for image in images)


def _told(destination: Destination, inputs: str) -> str:
    saved = (destination.path, destination.format, destination.depth, destination.dither)
    return digest(inputs, destination.kind, saved if destination.kind == SAVED else None).hex()


def _is_whole(image: bpy.types.Image) -> bool:
    """Whether it was not painted on, and its files are there."""
    if image.is_dirty:
        return False
    if image.packed_file is not None or len(image.packed_files):
        return True
    try:
        for file in files_of(image):
            read_metadata(file)
    except InputError:
        return False
    return True
