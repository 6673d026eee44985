"""One channel of an image that is there, whose other channels stay.

It goes into the image's file, or into the packed one, as the numbers that they are and at the file's depth. Blender's
pixels would not do: floats it holds decoded and multiplied by alpha, and neither packing nor saving brings back what
was there. Of formats that we do not write the pixels take it, where these are bytes, which are as in the file.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np

from ...core.base.arrays import Floats
from ...core.base.errors import InputError
from ...core.finish.image_file import SUFFIXES, check_channel, dithered, write_channel
from ..colour_space import Decoding, decoding_of, name_of_space, usual_spaces
from ..materials.image_pixels import KINDS
from ..read.world_nodes import file_of, unreadable
from ..typed import library_of, pixels_in, space_of

_SUFFIX_BY_START = {b"\x89PNG": ".png", b"v/1\x01": ".exr", b"II*\0": ".tif", b"MM\0*": ".tif"}
_UNSAVED = "it has changes that are not saved; save it first (Image > Save)"


def check_image_channel(image: bpy.types.Image, channel: str, size: tuple[int, int]) -> None:
    """Refuse, before a bake, an image that `store_channel` could not fill after it. channel: one of RGBA. size: width
    and height of the bake. Raises InputError."""
    if (library := library_of(image)) is not None:
        raise InputError(f"{image.name}: it is linked from {library.filepath}; make it local first")
    if image.source in KINDS:
        raise InputError(f"{image.name}: it is {KINDS[image.source]}; choose a single image")
    if image.source == "FILE" and image.packed_file is None:
        file_of(image)
    if _suffix(image) in SUFFIXES:
        if image.is_dirty and not _packs_whole(image):
            raise InputError(f"{image.name}: {_UNSAVED}")
        with _file_in(image) as path:
            check_channel(path, channel, size)
    elif image.is_float and image.source != "GENERATED":
        raise InputError(
            f"{image.name}: its format does not keep channels as they are; save it as PNG, TIFF or OpenEXR"
        )
    else:
        _check_pixels(image, channel, size)


def store_channel(image: bpy.types.Image, channel: str, values: Floats, *, dither: bool) -> None:
    """Put (h, w) values into a channel. A file is written, what is packed or only in Blender is packed; of another
    format the pixels are left to be saved. Values in alpha are no opacity, so that the image becomes Channel Packed.
    dither: of 8 bits. Raises InputError, the image as it was."""
    check_image_channel(image, channel, (values.shape[1], values.shape[0]))
    dither = dither and not image.is_float
    if image.source == "GENERATED":
        pixels_in(image)[0] = pixels_in(image)[0]  # of one that nobody has touched Blender packs nothing
        image.pack()
    elif image.is_dirty and _packs_whole(image):
        image.pack()
    if _suffix(image) in SUFFIXES:
        with _file_in(image) as path:
            write_channel(path, values, channel, dither=dither)
        image.buffers_free()  # and are read anew
        image.update_tag()
    else:
        _put_pixels(image, channel, values, dither)
    if image.packed_file is not None:
        image.use_fake_user = True  # so that the .blend file keeps it, though nothing may use it yet
    if channel == "A":
        image.alpha_mode = "CHANNEL_PACKED"


def lines_on_channel(image: bpy.types.Image, channel: str) -> list[str]:
    """What an artist should know of who reads a channel. Alpha is never taken for a colour."""
    if channel == "A" or decoding_of(image) == Decoding.NONE:
        return []
    space, data = name_of_space(image) or "unknown", usual_spaces()[1]
    return [
        f"{image.name}: its color space is {space}, so that materials read its {channel} as a color, not as the map; "
        f"set it to {data}, unless other channels are colors"
    ]


def _packs_whole(image: bpy.types.Image) -> bool:
    """Whether packing what is painted keeps it: bytes and data, but no floats that are colours, whose space Blender
    forgets."""
    return image.packed_file is not None and (not image.is_float or space_of(image).is_data)


def _suffix(image: bpy.types.Image) -> str:
    """Of its file; of a packed one by what it holds, for Blender packs floats as EXR, whatever they were."""
    if image.packed_file is not None:
        return _SUFFIX_BY_START.get(bytes(image.packed_file.data[:4]), "")
    return Path(image.filepath).suffix.lower() if image.source == "FILE" else ""


@contextmanager
def _file_in(image: bpy.types.Image) -> Iterator[Path]:
    """An image's file; of a packed one a file for the time, which is packed where it was changed."""
    if image.packed_file is None:
        yield file_of(image)
        return
    with tempfile.TemporaryDirectory(prefix="occlusion-bake-") as folder:
        path, data = Path(folder, f"image{_suffix(image)}"), bytes(image.packed_file.data)
        path.write_bytes(data)
        try:
            yield path
        except InputError as error:
            raise InputError(str(error).replace(str(path), image.name)) from error
        if (changed := path.read_bytes()) != data:
            image.pack(data=changed, data_len=len(changed))


def _check_pixels(image: bpy.types.Image, channel: str, size: tuple[int, int]) -> None:
    if 0 in image.size:
        raise unreadable(image)
    if tuple(image.size) != size:
        raise InputError(
            f"{image.name}: it is {image.size[0]}x{image.size[1]} and the bake {size[0]}x{size[1]}; set the size to "
            "that of the image"
        )
    if channel == "A" and image.depth != (128 if image.is_float else 32):
        raise InputError(f"{image.name}: it has no alpha; choose another channel")


def _put_pixels(image: bpy.types.Image, channel: str, values: Floats, dither: bool) -> None:
    pixels = np.empty((*values.shape, 4), dtype=np.float32)
    pixels_in(image).foreach_get(pixels.reshape(-1))
    values = np.clip(values, 0.0, 1.0)[::-1]
    if dither:
        values = dithered(values * np.float32(255.0), 255) / np.float32(255.0)
    pixels[..., "RGBA".index(channel)] = values
    pixels_in(image).foreach_set(pixels.reshape(-1))
    image.update()
    if image.packed_file is not None:
        image.pack()
