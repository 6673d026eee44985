"""The filter that knows the surface: texels near one another on it, and local regression over them.

Neighbours are found in space, so they reach across the seams of charts, and not round an edge, through a wall or onto
another sheet. What the filter does stands in kernel/src/surface_filter_code.h.
"""

from __future__ import annotations

import math
from ctypes import byref, c_void_p
from itertools import pairwise

import numpy as np

from ..base import kernel_api as api
from ..base.arrays import Floats, Longs
from ..base.elementary import power
from ..rays.texel_surface import TexelSurface
from ..spherical.lobe import open_horizon

# Weights fall as exp(-sharpness (1 - cos)) of the angle between normals, and values are likely to change by so much per
# unit of the normal. What a normal explains is fitted, so for AO weights need fall only where that ends: to a third at
# 24 degrees. A narrow lobe turns with the normal, and sees more change. Measured on meshes made by script (bodies,
# facets, rocks, bevels, cloth, tubes), at 4 to 256 rays and exponents 1, 10 and 100.
_SHARPNESS, _SLOPE = 12.0, 0.3  # of exponent 1
_SHARPNESS_POWER, _SLOPE_POWER = 0.7, 0.25  # of the exponent, how both grow with it
_SHARPEST = 1e6  # beyond it float32 no longer tells normals apart
_OPEN_SHARES = 1025  # in the table of what is open above a texel's own triangle: 5e-5 off at most at exponent 100

# Texels of one part: some 0.7 GB. A larger image is filtered slab by slab, each with what it looks at beyond.
MOST_TEXELS = 6 << 20
_SAMPLED = 16  # one row and column in so many tells where the texels lie


class SurfaceFilter:
    """The neighbours of the texels of one surface, which is kept. most: texels that are held at a time; of more the
    neighbours are found anew, in parts, at each use.

    Raises Cancelled, MemoryError.
    """

    def __init__(self, surface: TexelSurface, *, most: int = MOST_TEXELS, control: api.Control | None = None) -> None:
        self._surface = surface
        self._slabs = _slabs(surface, most)
        self._whole = _Part(surface, None, control) if self._slabs == [None] else None

    def filter(
        self,
        value: Floats,
        noise: Floats,
        precision: Floats,
        exponent: float = 1.0,
        *,
        about_normal: bool = False,
        plain: bool = False,
        texels: Longs | None = None,
        control: api.Control | None = None,
    ) -> tuple[Floats, Floats]:
        """Filter one map. All images are (H, W) float32.

        value: estimates from the rays. noise: an estimate for each, as crude as may be, of the variance of a value of
        precision 1. precision: how many times less a value's variance is; 0 where there are no rays. exponent: the
        map's. about_normal: values are shares of a lobe about the shading normal, so that the plane of a texel's own
        triangle cuts it where that is turned against the normal. plain: no filter; values stay, and their expected
        error is their noise. texels: y · W + x, where no others are asked for, which saves time; they are 0 then, or
        filtered.
        Returns the filtered values, 0 to 1 unless plain, and the expected square of their error. Where there is no
        owner, or a texel's place is no number, the value stays, and its error is 0.
        """
        filtered, error = (np.zeros(value.shape, dtype=np.float32) for _ in range(2))
        these = slice(None) if texels is None else texels
        filtered.reshape(-1)[these] = value.reshape(-1)[these]
        shape = self._surface.owner.shape
        images = (api.address(image, np.float32, *shape) for image in (value, noise, precision, filtered, error))
        shares = _open_shares(exponent) if about_normal else None
        signal = api.Signal(
            *images,
            api.address(shares, np.float32, _OPEN_SHARES),
            _OPEN_SHARES,
            sharpness_of(exponent),
            slope_of(exponent),
            int(plain),
            self._surface.threads,
        )
        for slab in self._slabs:
            part = self._whole or _Part(self._surface, slab, control)
            api.check(api.library().ob_filter_apply(part.handle, byref(signal), api.pointer_to(control)))
            del part  # before the next one is built
        return filtered, error


def sharpness_of(exponent: float) -> float:
    """How fast weights fall as normals turn away, for a map of this exponent."""
    return min(_SHARPNESS * float(power(max(exponent, 1.0), _SHARPNESS_POWER)), _SHARPEST)


def slope_of(exponent: float) -> float:
    """How much values are likely to change by per unit of the normal."""
    return _SLOPE * float(power(max(exponent, 1.0), _SLOPE_POWER))


def _open_shares(exponent: float) -> Floats:
    """Of a lobe above a plane, for cosines of its tilt evenly from 0 to 1."""
    shares: Floats = open_horizon(exponent, np.linspace(0.0, 1.0, _OPEN_SHARES)).astype(np.float32)
    return shares


class _Part:
    """The kernel's filter of one slab, or of all."""

    def __init__(self, surface: TexelSurface, slab: api.Slab | None, control: api.Control | None) -> None:
        self.handle = c_void_p()
        described = surface.described()
        where = None if slab is None else byref(slab)
        api.check(
            api.library().ob_filter_build(
                byref(described), where, surface.threads, api.pointer_to(control), byref(self.handle)
            )
        )
        api.release_with(self, "ob_filter_free", self.handle)


def _slabs(surface: TexelSurface, most: int) -> list[api.Slab | None]:
    """Slabs across the longest axis, of about as many texels each; a None where all texels may be held at once."""
    parts = -(-int(np.count_nonzero(surface.owner >= 0)) // most)
    if parts <= 1:
        return [None]
    sample = TexelSurface(
        surface.mesh, np.ascontiguousarray(surface.owner[_SAMPLED // 2 :: _SAMPLED, _SAMPLED // 2 :: _SAMPLED])
    )
    places = sample.positions[sample.covered]
    places = places[np.isfinite(places).all(axis=1)]
    if not len(places):
        return [None]
    axis = int(np.argmax(np.ptp(places, axis=0)))
    cuts = np.unique(
        np.quantile(places[:, axis], np.arange(1, parts, dtype=np.int64) / parts).astype(np.float32)
    ).tolist()
    return [api.Slab(low, high, axis) for low, high in pairwise([-math.inf, *cuts, math.inf])]
