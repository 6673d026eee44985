"""Where an occluder's material lets light through: leaves on cards, fences, nets.

A material cuts a surface by a texture of its opacity, laid over the triangles by UVs, or by one value. A ray that hits
a triangle is let on with what is left: 1 - opacity, layer after layer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..base.arrays import Flags, Floats, Ints, Longs
from ..base.errors import InputError
from ..base.vectors import weighted
from .image_texture import ImageTexture, Wrap, sampled

OPAQUE = -1  # in the place of a texture's number


@dataclass(frozen=True, eq=False)
class Alpha(ImageTexture):
    """A texture of opacity, (h, w) values from 0, clear, to 1, opaque.

    Raises InputError for values that are no picture or not from 0 to 1.
    """

    def __post_init__(self) -> None:
        if self.values.ndim != 2 or self.values.size == 0:
            raise InputError(f"opacity: values of shape {self.values.shape} are no picture; give (h, w)")
        if not (self.values.min() >= 0.0 and self.values.max() <= 1.0):  # a NaN is neither
            raise InputError("opacity: values are not from 0 to 1; give 0 for clear and 1 for opaque")

    @cached_property
    def opaque(self) -> bool:
        """Whether it lets light through nowhere."""
        return self.wrap != Wrap.CLIP and bool((self.values >= 1.0).all())

    @cached_property
    def holes(self) -> Ints:
        """(h' + 1, w' + 1) int32: how many texels that are not opaque lie below and left of each corner between texels.

        Rows go up, as v does. The texture is one that repeats or, with CLIP and EXTEND, is never left: mirrored ones
        are doubled, and clipped ones have a clear edge one texel wide.
        """
        open_texels = self.values[::-1] < 1.0
        if self.wrap == Wrap.MIRROR:
            open_texels = np.pad(open_texels, [(0, size) for size in open_texels.shape], mode="symmetric")
        elif self.wrap == Wrap.CLIP:
            open_texels = np.pad(open_texels, 1, constant_values=True)
        sums = np.zeros((open_texels.shape[0] + 1, open_texels.shape[1] + 1), dtype=np.int32)
        sums[1:, 1:] = open_texels
        np.cumsum(sums, axis=0, out=sums)
        return np.cumsum(sums, axis=1, out=sums)


@dataclass(frozen=True, eq=False)
class Cutout:
    """What cuts the triangles of one mesh.

    alpha: (T,) int32, which of `alphas` covers each triangle, OPAQUE for none. uv: (T, 3, 2) float32 per corner, v up;
    those of the opaque ones mean nothing. Raises InputError for arrays that do not fit one another.
    """

    alphas: Sequence[Alpha]
    alpha: Ints
    uv: Floats

    def __post_init__(self) -> None:
        if self.alpha.ndim != 1 or self.uv.shape != (len(self.alpha), 3, 2):
            raise InputError(
                f"cutout: UVs of shape {self.uv.shape} do not fit {len(self.alpha)} triangles; give (T, 3, 2)"
            )
        if len(self.alpha) and not OPAQUE <= self.alpha.min() <= self.alpha.max() < len(self.alphas):
            raise InputError(f"cutout: a triangle names an alpha that does not exist; there are {len(self.alphas)}")


def opacity(cutout: Cutout, triangle: Ints, weights: Floats) -> Floats:
    """(N,) float32: the opacity at points of triangles, the kernel's reference.

    triangle: (N,) int32. weights: (N, 3), of each triangle's corners. A triangle whose UVs are not finite is opaque.
    """
    result = np.ones(len(triangle), dtype=np.float32)
    which = np.where(_finite(cutout)[triangle], cutout.alpha[triangle], OPAQUE)
    for number, alpha in enumerate(cutout.alphas):
        here = which == number
        corners = cutout.uv[triangle[here]].astype(np.float64)
        result[here] = sampled(alpha, weighted(weights[here].astype(np.float64), corners))
    return result


def simplified(cutout: Cutout) -> Cutout | None:
    """The same with every triangle marked opaque that lets light through nowhere, and without textures that then cover
    none. None where all triangles are opaque."""
    alpha = np.where(_finite(cutout), cutout.alpha, np.int32(OPAQUE))
    for number, texture in enumerate(cutout.alphas):
        here = np.flatnonzero(alpha == number)
        alpha[here[_opaque_under(texture, cutout.uv[here])]] = OPAQUE
    used = np.unique(alpha[alpha != OPAQUE])
    if len(used) == 0:
        return None
    numbers = np.full(len(cutout.alphas) + 1, OPAQUE, dtype=np.int32)  # the last: OPAQUE itself, which is -1
    numbers[used] = np.arange(len(used), dtype=np.int32)
    return replace(cutout, alphas=[cutout.alphas[i] for i in used], alpha=numbers[alpha])


def _finite(cutout: Cutout) -> Flags:
    """(T,) bool."""
    finite: Flags = np.isfinite(cutout.uv).all(axis=(1, 2))
    return finite


def _opaque_under(alpha: Alpha, uv: Floats) -> Flags:
    """(N,) bool: triangles with (N, 3, 2) UVs under whose box in the texture all texels are opaque.

    The number of texels that are not comes from four corners of `holes`, a summed-area table (Crow, Summed-area tables
    for texture mapping, 1984).
    """
    if alpha.opaque or not len(uv) or not (alpha.values >= 1.0).any():
        return np.full(len(uv), alpha.opaque)
    low, high = _boxes(alpha, uv)
    count = np.zeros(len(uv), dtype=np.int64)
    for right in (False, True):
        for top in (False, True):
            x, y = (high if right else low)[:, 0], (high if top else low)[:, 1]
            count += (1 if right == top else -1) * _below(alpha.holes, x, y)
    none: Flags = count == 0
    return none


def _boxes(alpha: Alpha, uv: Floats) -> tuple[Longs, Longs]:
    """Each triangle's box in whole texels of `holes`: (N, 2) from and (N, 2) up to, exclusive.

    A texel wider on all sides than rays can reach, since they find their places in float32.
    """
    size = np.array(alpha.values.shape[::-1], dtype=np.float64)
    margin = 1.5 if alpha.linear else 1.0
    place = uv.astype(np.float64) * size
    low, high = np.floor(place.min(axis=1) - margin), np.floor(place.max(axis=1) + margin) + 1.0
    if alpha.wrap == Wrap.CLIP:
        low, high, size = low + 1.0, high + 1.0, size + 2.0  # for the clear edge
    if alpha.wrap in (Wrap.CLIP, Wrap.EXTEND):
        low = np.clip(low, 0.0, size - 1.0)
        return low.astype(np.int64), np.clip(high, low + 1.0, size).astype(np.int64)
    period = size * 2.0 if alpha.wrap == Wrap.MIRROR else size
    span = np.minimum(high - low, period)
    low = np.mod(low, period)
    return low.astype(np.int64), (low + span).astype(np.int64)


def _below(holes: Ints, x: Longs, y: Longs) -> Longs:
    """(N,) int64: the holes between 0 and (x, y) of a texture that repeats."""
    height, width = holes.shape[0] - 1, holes.shape[1] - 1
    (across, x), (up, y) = np.divmod(x, width), np.divmod(y, height)
    whole = across * up * np.int64(holes[-1, -1])
    count: Longs = whole + across * holes[y, -1] + up * holes[-1, x] + holes[y, x]
    return count
