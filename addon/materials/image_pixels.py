"""Images' pixels as Cycles looks them up in a material, each read once."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np

from ...core.base.arrays import Floats
from ..colour_space import Decoding, decoding_of, name_of_space, srgb_decoded, usual_spaces
from ..typed import pixels_in, space_of, uid_of

KINDS = {"TILED": "UDIM tiles", "SEQUENCE": "an image sequence", "MOVIE": "a movie", "VIEWER": "a render"}


class Unreadable(Exception):
    """Something of a material that is not read.

    what: what reaches the socket that is read, or, with `whole`, the cause in words that fit after the material's name.
    cure: what the artist can do; None: whatever helps with most of what reaches that socket.
    """

    def __init__(self, what: str, cure: str | None = None, *, whole: bool = False) -> None:
        super().__init__(what)
        self.what, self.cure, self.whole = what, cure, whole

    def in_words(self, socket: str) -> str:
        """The cause, where the socket is called so; it fits after the material's name."""
        return self.what if self.whole else f"what reaches its {socket} is {self.what}, which is not read"


class ImagePixels:
    """What image nodes read, kept for the next material that uses the same image."""

    def __init__(self) -> None:
        self._kept: dict[tuple[int, str], Floats] = {}

    def alpha(self, image: bpy.types.Image) -> Floats:
        """(h, w) float32, row 0 at the top: what comes out of the socket Alpha. Raises Unread."""
        return self._once(image, "alpha", _alpha)

    def colour(self, image: bpy.types.Image) -> Floats:
        """(h, w, 3) float32, row 0 at the top: the colours as they are interpolated, `is_encoded` ones not yet decoded
        and `is_associated` ones multiplied by their alpha. Raises Unread."""
        return self._once(image, "colour", _colour)

    def _once(self, image: bpy.types.Image, kind: str, read: Callable[[bpy.types.Image], Floats]) -> Floats:
        key = (uid_of(image), kind)
        if key not in self._kept:
            self._kept[key] = read(image)
        return self._kept[key]


def is_associated(image: bpy.types.Image) -> bool:
    """Whether Cycles holds an image's colours multiplied by its alpha, to divide them where the alpha is used, too."""
    return image.alpha_mode in ("STRAIGHT", "PREMUL") and not space_of(image).is_data


def is_encoded(image: bpy.types.Image) -> bool:
    """Whether an image's colours are sRGB bytes, which Cycles interpolates as they are and decodes then."""
    return not image.is_float and decoding_of(image) == Decoding.SRGB


def _alpha(image: bpy.types.Image) -> Floats:
    _check_single(image)
    if image.alpha_mode == "NONE":
        return np.ones((1, 1), dtype=np.float32)
    pixels = _pixels(image)
    if pixels.shape[2] != 4:
        return np.ones((1, 1), dtype=np.float32)
    return _sound(pixels[..., 3])


def _colour(image: bpy.types.Image) -> Floats:
    """As Blender 5.2's Cycles. Earlier ones multiply premultiplied ones, and not those of floats."""
    pixels = _pixels(image)
    colour = _sound(pixels[..., :3] if pixels.shape[2] > 2 else np.repeat(pixels[..., :1], 3, axis=2))
    is_bytes = not image.is_float
    if is_bytes and decoding_of(image) == Decoding.OTHER:
        colour, is_bytes = _decoded(image, colour), False
    if image.alpha_mode != "STRAIGHT" or not is_associated(image) or pixels.shape[2] != 4:
        return colour
    colour *= _sound(pixels[..., 3:])
    if is_bytes:  # again, rounded down
        colour = np.floor(colour * np.float32(255.0) + np.float32(1e-3)) / np.float32(255.0)
    return colour


def _decoded(image: bpy.types.Image, colour: Floats) -> Floats:
    """Bytes of a space that Cycles does not know for sRGB, which it decodes before it interpolates them. Of greys the
    curve alone matters, not the primaries. Raises Unread."""
    decoding = decoding_of(image, grey=True) if (colour == colour[..., :1]).all() else Decoding.OTHER
    if decoding == Decoding.OTHER:
        space = name_of_space(image)
        others = [each for each in usual_spaces() if each != space]
        raise Unreadable(
            f"the colour of {image.name} in {space or 'an unknown space'}",
            f"set the image's colour space to {' or '.join(others)}",
        )
    return srgb_decoded(colour) if decoding == Decoding.SRGB else colour


def _sound(values: Any) -> Floats:
    """A contiguous copy with zeros for what is no number, as Cycles has it."""
    return np.nan_to_num(np.array(values, dtype=np.float32, order="C"), copy=False, nan=0.0, posinf=0.0, neginf=0.0)


def _check_single(image: bpy.types.Image) -> None:
    """Raises Unread for what is no single picture, or cannot be loaded."""
    if image.source in KINDS:
        raise Unreadable(f"{image.name}, {KINDS[image.source]}", "use a single image")
    if 0 in image.size:
        raise Unreadable(f"its image {image.name} cannot be loaded", "find the file (File > External Data)", whole=True)


def _pixels(image: bpy.types.Image) -> Floats:
    """(h, w, channels) float32, row 0 at the top. Raises Unread."""
    _check_single(image)
    width, height = image.size
    pixels = np.empty((height, width, image.channels), dtype=np.float32)
    pixels_in(image).foreach_get(pixels.reshape(-1))
    return pixels[::-1]
