"""Colour spaces, whose names a studio's OCIO configuration is free to choose: none is known by name here."""

from __future__ import annotations

from enum import Enum
from functools import cache
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..core.base.arrays import Floats
from .typed import pixels_in, space_of

# Greys, which tell curves apart, and colours, which tell primaries apart.
_GREYS = [(grey, grey, grey) for grey in (0.02, 0.1, 0.3, 0.5, 0.8, 1.0)]
_PROBE = np.array([*_GREYS, (0.6, 0.0, 0.0), (0.0, 0.6, 0.0), (0.0, 0.0, 0.6)])
_TOLERANCE = 1e-3  # Blender's own matrices and tables are off by up to 2e-4; Gamma 2.2 is 3e-3 from sRGB


class Decoding(Enum):
    """What becomes of an image's pixels on their way to the colours that the scene is rendered in."""

    NONE = "none"
    SRGB = "sRGB"
    OTHER = "other"


def make_data(image: bpy.types.Image) -> None:
    """Let an image's pixels be numbers, not colours. Pixels that were changed and neither saved nor packed are lost."""
    if not space_of(image).is_data:
        space_of(image).is_data = True
        image.buffers_free()  # Blender 4.5 would go on with pixels that were decoded


def decoding_of(image: bpy.types.Image, *, grey: bool = False) -> Decoding:
    """What Blender makes of an image's pixels, as they are in its file, by its colour space. grey: they are all grey,
    so that the primaries of the space do not matter."""
    if space_of(image).is_data:
        return Decoding.NONE
    working = bpy.data.colorspace.working_space if hasattr(bpy.data, "colorspace") else ""
    name = name_of_space(image)
    if not name:
        return Decoding.OTHER
    decoded = _decoded(name, working)[: len(_GREYS) if grey else None]
    for kind, right in ((Decoding.NONE, _PROBE), (Decoding.SRGB, srgb_decoded(_PROBE))):
        if np.abs(decoded - right[: len(decoded)]).max() < _TOLERANCE:
            return kind
    return Decoding.OTHER


def name_of_space(image: bpy.types.Image) -> str:
    """Of its pixels; empty where the configuration has none of the name that the file gives."""
    return str(space_of(image).name)


def usual_spaces() -> tuple[str, str]:
    """What the spaces of colours in 8 bits and of data are called."""
    colours, data = bpy.data.images.new("Colors", 1, 1), bpy.data.images.new("Data", 1, 1, is_data=True)
    names = str(space_of(colours).name), str(space_of(data).name)
    bpy.data.images.remove(colours)
    bpy.data.images.remove(data)
    return names


def srgb_decoded(values: NDArray[Any]) -> NDArray[Any]:
    """Linear values of sRGB's (IEC 61966-2-1), in the precision that they are given in."""
    return np.where(values <= 0.04045, values / 12.92, ((np.maximum(values, 0.0) + 0.055) / 1.055) ** 2.4)


@cache
def _decoded(space: str, working: str) -> Floats:
    """The probe's colours, (n, 3), as Blender decodes them, which is how Cycles tells spaces apart. working: the file's
    own linear space, which decides, too, where Blender lets it be chosen."""
    image = bpy.data.images.new("Probe", len(_PROBE), 1, float_buffer=True, is_data=True)
    pixels = np.ones((len(_PROBE), 4), dtype=np.float32)
    pixels[:, :3] = _PROBE
    pixels_in(image).foreach_set(pixels.reshape(-1))
    image.pack()
    space_of(image).name = space  # Blender reads the packed file again, in this space
    pixels_in(image).foreach_get(pixels.reshape(-1))
    bpy.data.images.remove(image)
    return pixels[:, :3]
