"""Baked maps as Blender images, and on request in the object's materials."""

from __future__ import annotations

import bpy
import numpy as np

from ..core.bake import Baked, BakedMap
from ..core.scene import Floats

MARK = "occlusion_bake"  # on an image of ours: "object/map"


def store(baked: Baked) -> dict[str, bpy.types.Image]:
    """Put every map into an image named after the object, the one of an earlier bake where there is one.

    Float, Non-Color, packed into the file so that it is saved with it. Returns the images by map.
    """
    return {name: _store(baked.name, name, each) for name, each in baked.maps.items()}


def _store(owner: str, name: str, baked: BakedMap) -> bpy.types.Image:
    height, width = baked.values.shape
    image = _image(owner, name, width, height)
    image.pixels.foreach_set(_rgba(baked.values).ravel())
    image.update()
    image.pack()
    return image


def _image(owner: str, name: str, width: int, height: int) -> bpy.types.Image:
    mark = f"{owner}/{name}"
    image = next((each for each in bpy.data.images if each.get(MARK) == mark and each.library is None), None)
    if image is None:
        image = bpy.data.images.new(
            f"{owner} {_title(name)}", width, height, alpha=False, float_buffer=True, is_data=True
        )
        image[MARK] = mark
    elif tuple(image.size) != (width, height):
        image.scale(width, height)
    if image.colorspace_settings.name != "Non-Color":  # setting it makes Blender read the packed file again
        image.colorspace_settings.name = "Non-Color"
    return image


def _title(name: str) -> str:
    """ "ao" → "AO", "ro_10" → "RO 10"."""
    kind, _, exponent = name.partition("_")
    return f"{kind.upper()} {exponent}".strip()


def _rgba(values: Floats) -> Floats:
    """Grey, opaque, bottom row first, as Blender keeps pixels."""
    pixels = np.ones((*values.shape, 4), dtype=np.float32)
    pixels[..., :3] = values[::-1, :, None]
    return pixels


def show_picture(name: str, path: str) -> bpy.types.Image:
    """Load a picture under this name, in the place of an earlier one, and pack it: its file may go."""
    image = bpy.data.images.load(path)
    image[MARK] = "picture"
    image.pack()
    image.filepath_raw = ""
    old = bpy.data.images.get(name)
    if old is not None and old.get(MARK) == "picture":
        old.user_remap(image)  # open editors show the new one
        bpy.data.images.remove(old)
    image.name = name
    return image
