"""Numbers and colours over a surface, as texture nodes give them and others change them: a picture and its layout.

A function works on the texels of one picture. Two pictures that are laid out differently cannot be combined, and are
not read.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.scene.image_texture import Picture, Wrap, sampled
from ...core.scene.scene import Floats
from .image_pixels import Unread

# What is not a straight line of the values looked up, as a threshold, comes after interpolation in Cycles. Small
# pictures are made finer before, by an odd number so that every old texel's middle stays one, up to this many texels.
_FINE, _FINEST = 1536, 9
_GREY = np.array((0.2126729, 0.7151522, 0.0721750), dtype=np.float32)  # luminance of linear Rec. 709


@dataclass(frozen=True)
class Lookup:
    """How a picture lies on a surface. uv: the UV map, "" the one for renders. matrix: (2, 3), from (u, v, 1) to the
    picture's own."""

    image: str
    linear: bool
    wrap: Wrap
    uv: str
    matrix: tuple[tuple[float, ...], ...]


@dataclass(frozen=True, eq=False)
class Field:
    """What a socket carries over a surface. values: (h, w) float32, or (h, w, 3) for colours, row 0 at the top; of size
    (1, 1) without a lookup. fine: it was made finer than its picture."""

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


def constant(value: Any) -> Field:
    """A number, or the first three of a colour or a vector."""
    numbers = np.asarray(value, dtype=np.float32).reshape(1, 1, -1)
    return Field(numbers[..., 0] if numbers.size == 1 else numbers[..., :3])


def mapped(function: Callable[..., Any], *fields: Field) -> Field:
    """A function of each texel. Raises Unread where they are not those of one picture."""
    fields = tuple(_unclipped(field) for field in fields)
    lookups = {field.lookup for field in fields if field.lookup is not None}
    if len(lookups) > 1:
        raise Unread("more than one image")
    fine = any(field.fine for field in fields)
    arrays = [(_finer(field) if fine else field).values for field in fields]
    if any(array.ndim == 3 for array in arrays):
        arrays = [array[..., np.newaxis] if array.ndim == 2 else array for array in arrays]
    with np.errstate(all="ignore"):
        values = np.nan_to_num(np.asarray(function(*arrays), dtype=np.float32), nan=0.0, posinf=0.0, neginf=0.0)
    return Field(values, next(iter(lookups), None), fine)


def bent(function: Callable[..., Any], *fields: Field) -> Field:
    """`mapped` for a function that does not go through interpolation unchanged."""
    return mapped(function, *(_finer(_unclipped(field)) for field in fields))


def _finer(field: Field) -> Field:
    times = min(_FINE // max(field.values.shape[:2]), _FINEST) - 1 | 1
    if field.fine or field.lookup is None or not field.lookup.linear or times < 2:
        return field
    height, width = (times * n for n in field.values.shape[:2])
    v, u = np.meshgrid(1.0 - (np.arange(height) + 0.5) / height, (np.arange(width) + 0.5) / width, indexing="ij")
    places = np.stack([u, v], axis=-1).reshape(-1, 2)
    finer = sampled(Picture(field.values, True, field.lookup.wrap), places)
    return replace(field, values=finer.reshape(height, width, *field.values.shape[2:]), fine=True)


def _unclipped(field: Field) -> Field:
    """The same with an edge of clear texels that is extended: what a function makes of them then counts beyond it."""
    lookup = field.lookup
    if lookup is None or lookup.wrap != Wrap.CLIP:
        return field
    height, width = field.values.shape[:2]
    shrunk = tuple(
        (a * n / (n + 2), b * n / (n + 2), (c * n + 1) / (n + 2))
        for (a, b, c), n in zip(lookup.matrix, (width, height), strict=True)
    )
    values = np.pad(field.values, ((1, 1), (1, 1), (0, 0))[: field.values.ndim])
    return Field(values, replace(lookup, wrap=Wrap.EXTEND, matrix=shrunk))


def grey(field: Field) -> Field:
    """A colour as a number."""
    return field if field.values.ndim == 2 else replace(field, values=field.values @ _GREY)


def mix(factor: Field, first: Field, second: Field) -> Field:
    """From the first to the second, as the factor goes from 0 to 1."""
    if first.is_all(0.0) and second.is_all(1.0):
        return factor
    varying = sum(field.lookup is not None for field in (factor, first, second))
    apply = mapped if varying == 1 else bent
    return apply(lambda f, a, b: a * (np.float32(1.0) - f) + b * f, factor, first, second)


def decoded(values: NDArray[Any]) -> NDArray[Any]:
    """Linear values of sRGB's (IEC 61966-2-1)."""
    return np.where(values < 0.04045, values / 12.92, ((np.maximum(values, 0.0) + 0.055) / 1.055) ** 2.4)


def divided(colours: NDArray[Any], alpha: NDArray[Any]) -> NDArray[Any]:
    """Colours without the alpha that they were multiplied by; those of no alpha stay."""
    return np.where(alpha > 0.0, np.minimum(colours / alpha, 1.0), colours)


def even(field: Field) -> Field:
    """A picture that is one value as that value."""
    first = field.values[:1, :1]
    clear_beyond = field.lookup is not None and field.lookup.wrap == Wrap.CLIP
    return field if clear_beyond or (field.values != first).any() else Field(first.copy())
