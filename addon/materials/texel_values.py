"""Numbers and colours over a surface, as texture nodes give them and others change them: a texture and its layout.

A function works on the texels of one texture. Two textures that are laid out differently cannot be combined, and are
not read.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.base.arrays import Floats
from ...core.scene.image_texture import ImageTexture, Wrap, sampled
from .image_pixels import Unreadable

# What is not a straight line of the values looked up, as a threshold, comes after interpolation in Cycles. Small
# textures are made finer before, by an odd number so that every old texel's middle stays one, up to this many texels.
_FINE, _FINEST = 1536, 9
_GREY = np.array((0.2126729, 0.7151522, 0.0721750), dtype=np.float32)  # luminance of linear Rec. 709


@dataclass(frozen=True)
class Lookup:
    """How a texture lies on a surface. image: its session_uid. uv: the UV map, "" the one for renders. matrix: (2, 3),
    from (u, v, 1) to the texture's own."""

    image: int
    linear: bool
    wrap: Wrap
    uv: str
    matrix: tuple[tuple[float, ...], ...]


@dataclass(frozen=True, eq=False)
class TexelValues:
    """What a socket carries over a surface. values: (h, w) float32, or (h, w, 3) for colours, row 0 at the top; of size
    (1, 1) without a lookup. fine: it was made finer than its texture."""

    values: Floats
    lookup: Lookup | None = None
    fine: bool = False

    @property
    def sampling(self) -> tuple[bool, Wrap]:
        """Whether it is interpolated, and what lies beyond its edges."""
        return (False, Wrap.EXTEND) if self.lookup is None else (self.lookup.linear, self.lookup.wrap)

    def is_all(self, value: float) -> bool:
        """Whether it is this constant."""
        return self.lookup is None and bool((self.values == value).all())


def clipped(values: Floats) -> Floats:
    """From 0 to 1; the same array where it is so already, for others to share."""
    inside = values.min() >= 0.0 and values.max() <= 1.0
    return values if inside else np.clip(values, np.float32(0.0), np.float32(1.0))


def constant(value: Any) -> TexelValues:
    """A number, or the first three of a colour or a vector."""
    numbers = np.asarray(value, dtype=np.float32).reshape(1, 1, -1)
    return TexelValues(numbers[..., 0] if numbers.size == 1 else numbers[..., :3])


def mapped(function: Callable[..., Any], *arguments: TexelValues) -> TexelValues:
    """A function of each texel. Raises Unread where they are not those of one texture."""
    arguments = tuple(_unclipped(texels) for texels in arguments)
    lookups = {texels.lookup for texels in arguments if texels.lookup is not None}
    if len(lookups) > 1:
        raise Unreadable("more than one image")
    fine = any(texels.fine for texels in arguments)
    arrays = [(_finer(texels) if fine else texels).values for texels in arguments]
    if any(array.ndim == 3 for array in arrays):
        arrays = [array[..., np.newaxis] if array.ndim == 2 else array for array in arrays]
    with np.errstate(all="ignore"):
        values = np.nan_to_num(np.asarray(function(*arrays), dtype=np.float32), nan=0.0, posinf=0.0, neginf=0.0)
    return TexelValues(values, next(iter(lookups), None), fine)


def bent(function: Callable[..., Any], *arguments: TexelValues) -> TexelValues:
    """`mapped` for a function that does not go through interpolation unchanged."""
    return mapped(function, *(_finer(_unclipped(texels)) for texels in arguments))


def _finer(texels: TexelValues) -> TexelValues:
    times = min(_FINE // max(texels.values.shape[:2]), _FINEST) - 1 | 1
    if texels.fine or texels.lookup is None or not texels.lookup.linear or times < 2:
        return texels
    height, width = (times * n for n in texels.values.shape[:2])
    v, u = np.meshgrid(
        1.0 - (np.arange(height, dtype=np.int64) + 0.5) / height,
        (np.arange(width, dtype=np.int64) + 0.5) / width,
        indexing="ij",
    )
    places = np.stack([u, v], axis=-1).reshape(-1, 2)
    finer = sampled(ImageTexture(texels.values, True, texels.lookup.wrap), places)
    return replace(texels, values=finer.reshape(height, width, *texels.values.shape[2:]), fine=True)


def _unclipped(texels: TexelValues) -> TexelValues:
    """The same with an edge of clear texels that is extended: what a function makes of them then counts beyond it."""
    lookup = texels.lookup
    if lookup is None or lookup.wrap != Wrap.CLIP:
        return texels
    height, width = texels.values.shape[:2]
    shrunk = tuple(
        (a * n / (n + 2), b * n / (n + 2), (c * n + 1) / (n + 2))
        for (a, b, c), n in zip(lookup.matrix, (width, height), strict=True)
    )
    values = np.pad(texels.values, ((1, 1), (1, 1), (0, 0))[: texels.values.ndim])
    return TexelValues(values, replace(lookup, wrap=Wrap.EXTEND, matrix=shrunk))


def grey(texels: TexelValues) -> TexelValues:
    """A colour as a number."""
    return texels if texels.values.ndim == 2 else replace(texels, values=texels.values @ _GREY)


def mix(factor: TexelValues, first: TexelValues, second: TexelValues) -> TexelValues:
    """From the first to the second, as the factor goes from 0 to 1."""
    if first.is_all(0.0) and second.is_all(1.0):
        return factor
    varying = sum(texels.lookup is not None for texels in (factor, first, second))
    apply = mapped if varying == 1 else bent
    return apply(lambda f, a, b: a * (np.float32(1.0) - f) + b * f, factor, first, second)


def divided(colours: NDArray[Any], alpha: NDArray[Any]) -> NDArray[Any]:
    """Colours without the alpha that they were multiplied by; those of no alpha stay."""
    return np.where(alpha > 0.0, np.minimum(colours / alpha, 1.0), colours)


def even(texels: TexelValues) -> TexelValues:
    """A texture that is one value as that value."""
    first = texels.values[:1, :1]
    clear_beyond = texels.lookup is not None and texels.lookup.wrap == Wrap.CLIP
    return texels if clear_beyond or (texels.values != first).any() else TexelValues(first.copy())
