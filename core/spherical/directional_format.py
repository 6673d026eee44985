"""What a bake keeps of a texel so that its reflection occlusion is known for any view: kinds, channels and images.

Every kind is a row of numbers a texel, made of the mean visibilities of the kernel's cells: coefficients of spherical
harmonics, the bytes of a mask, or the means themselves. As images they are a multi-channel EXR, or a set of RGBA images
of integers, four channels each, from stated ranges.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal, cast, get_args

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Bytes, Floats, Reals
from ..base.errors import InputError
from . import spherical_harmonics, visibility_mask
from .hemisphere_cells import check_cells, check_side, coarser

Kind = Literal["sh", "mask", "cells"]
_FOUR = 4  # channels of an image
_ENCODINGS: dict[int, type[np.unsignedinteger[Any]]] = {8: np.uint8, 16: np.uint16}


@dataclass(frozen=True)
class DirectionalFormat:
    """A kind of code. size: the degree of "sh", 1 to 6; the cells along a side of "mask" and "cells", 8 or 16.

    Raises InputError for a kind, degree or side that there is not.
    """

    kind: Kind
    size: int

    def __post_init__(self) -> None:
        if self.kind not in get_args(Kind):
            raise InputError(f"code {self.kind!r}: no such kind; choose one of {', '.join(get_args(Kind))}")
        if self.kind == "sh":
            spherical_harmonics.check_degree(self.size)
        else:
            check_side(self.size)

    @property
    def name(self) -> str:
        """What files and reports call it: sh_3, mask_8, cells_16."""
        return f"{self.kind}_{self.size}"

    @property
    def count(self) -> int:
        """Numbers a texel: coefficients, bytes or cells."""
        if self.kind == "sh":
            return spherical_harmonics.count_of(self.size)
        return self.size**2 // 8 if self.kind == "mask" else self.size**2


def named_format(name: str) -> DirectionalFormat:
    """The format of a name, as sh_3. Raises InputError."""
    kind, _, size = name.partition("_")
    if kind not in get_args(Kind) or not size.isdigit():
        raise InputError(f"--code {name}: no such code; give one as sh_3 or mask_16")
    return DirectionalFormat(cast(Kind, kind), int(size))


def channel_names(code: DirectionalFormat) -> list[str]:
    """The channels of a multi-channel EXR, in order: sh.00, sh.01, …; so the layer is the kind."""
    digits = len(str(code.count - 1))
    return [f"{code.kind}.{place:0{max(digits, 2)}d}" for place in range(code.count)]


def ranges(code: DirectionalFormat) -> tuple[Floats, Floats]:
    """The least and the greatest value of each number, (count,) float32 each: no bake gives any beyond."""
    if code.kind == "sh":
        return spherical_harmonics.bounds(code.size)
    return np.zeros(code.count, np.float32), np.full(code.count, 255.0 if code.kind == "mask" else 1.0, np.float32)


def encode(cells: Floats, code: DirectionalFormat) -> Floats:
    """The code of (N, side, side) mean visibilities, side 8 or 16 and no fewer than the code's: (N, count) float32.

    Bytes of a mask are 0 to 255. Raises InputError where there are too few cells.
    """
    check_cells(cells)
    if code.kind == "sh":
        return spherical_harmonics.fit(cells, code.size)
    if cells.shape[1] < code.size:
        raise InputError(f"{code.name}: the bake has {cells.shape[1]} x {cells.shape[1]} cells; bake it with more")
    fitting = cells if cells.shape[1] == code.size else coarser(cells)
    if code.kind == "mask":
        return visibility_mask.pack(fitting).astype(np.float32)
    return fitting.reshape(len(cells), -1)


def rebuild(values: Floats, code: DirectionalFormat, reflected: Reals, exponent: float) -> Floats:
    """RO from codes (N, count) and unit R in the texels' frames, (N, 3): (N,) float32. See `harmonics` and `masks`.

    Raises InputError for another number of values than the code's, or an exponent below 0.
    """
    if values.shape[1] != code.count:
        raise InputError(f"{code.name}: {values.shape[1]} values a texel; give {code.count}")
    if code.kind == "sh":
        return spherical_harmonics.rebuild(values, reflected, exponent)
    if code.kind == "mask":
        return visibility_mask.rebuild(visibility_mask.unpack(_bytes(values)), reflected, exponent)
    return visibility_mask.rebuild(values.reshape(-1, code.size, code.size), reflected, exponent)


def to_images(values: Floats, code: DirectionalFormat, depth: int) -> list[NDArray[Any]]:
    """(h, w, count) float32 → RGBA images, (h, w, 4) uint8 or uint16: channel c of the code is channel c mod 4 of image
    c div 4.

    An integer q of 0 to Q = 2^depth − 1 stands for low + q / Q · (high − low) of `ranges`, to nearest; what lies beyond
    is clipped. Of a mask the bytes stay what they are, at 16 bits two a channel, the first the lower. Channels that are
    left over are Q: an alpha of 0 would make some programs drop the colours. Raises InputError for another depth or
    number of values.
    """
    encoding = _encoding(code, depth)
    if values.shape[2] != code.count:
        raise InputError(f"{code.name}: {values.shape[2]} values a texel; give {code.count}")
    most = np.iinfo(encoding).max
    if code.kind == "mask":
        whole = np.ascontiguousarray(_bytes(values)).view(np.dtype(encoding).newbyteorder("<")).astype(encoding)
    else:
        low, high = ranges(code)
        whole = np.rint(np.clip((values - low) / (high - low), 0.0, 1.0) * np.float32(most)).astype(encoding)
    return list(in_fours(whole, most))


def image_count(code: DirectionalFormat, depth: int) -> int:
    """How many `to_images` makes. Raises InputError for another depth."""
    return -(-_stored_channels(code, depth) // _FOUR)


def _stored_channels(code: DirectionalFormat, depth: int) -> int:
    """Of all images of a code together."""
    return code.count // np.dtype(_encoding(code, depth)).itemsize if code.kind == "mask" else code.count


def in_fours(channels: NDArray[Any], left_over: float) -> Iterator[NDArray[Any]]:
    """(h, w, c) → pictures of four channels each, (h, w, 4); channels that are left over hold that value."""
    for place in range(0, channels.shape[2], _FOUR):
        four = channels[..., place : place + _FOUR]
        yield np.pad(four, ((0, 0), (0, 0), (0, _FOUR - four.shape[2])), constant_values=left_over)


def from_images(images: Sequence[NDArray[Any]], code: DirectionalFormat) -> Floats:
    """What `to_images` made, (h, w, 4) uint8 or uint16 each, back to (h, w, count) float32.

    Raises InputError for another number of images or type of array.
    """
    depth = 8 * images[0].itemsize if images else 0
    encoding = _encoding(code, depth)
    if len(images) != image_count(code, depth) or any(each.dtype != encoding for each in images):
        raise InputError(f"{code.name}: {len(images)} images; give {image_count(code, depth)} of {depth} bits")
    whole = np.concatenate(images, axis=2)[..., : _stored_channels(code, depth)]
    if code.kind == "mask":
        stored = np.ascontiguousarray(whole, dtype=np.dtype(encoding).newbyteorder("<"))
        return stored.view(np.uint8).astype(np.float32)
    low, high = ranges(code)
    values: Floats = low + whole.astype(np.float32) / np.float32(np.iinfo(encoding).max) * (high - low)
    return values


def _encoding(code: DirectionalFormat, depth: int) -> type[np.unsignedinteger[Any]]:
    if depth not in _ENCODINGS:
        raise InputError(f"{code.name}: RGBA images cannot hold {depth} bits a channel; choose 8 or 16")
    return _ENCODINGS[depth]


def _bytes(values: Floats) -> Bytes:
    """Bytes that were kept as numbers, or that went through a file."""
    return np.rint(np.clip(values, 0.0, 255.0)).astype(np.uint8)
