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
from ..base.arrays import Floats
from ..rays.texel_surface import TexelSurface

# Weights fall as exp(-sharpness (1 - cos)) of the angle between normals: to a third at 10 degrees, to nothing at a
# crease of 30. Lobes narrower than that turn with the normal, and are compared as narrowly.
_SHARPNESS = 60.0
_SHARPEST = 1e6  # beyond it float32 no longer tells normals apart


# Texels of one part: some 0.6 GB. A larger image is filtered slab by slab, each with what it looks at beyond.
MOST_TEXELS = 1 << 23
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
        plain: bool = False,
        control: api.Control | None = None,
    ) -> tuple[Floats, Floats]:
        """Filter one map. All images are (H, W) float32.

        value: estimates from the rays. noise: an estimate for each, as crude as may be, of the variance of a value of
        precision 1. precision: how many times less a value's variance is; 0 where there are no rays. exponent: the
        map's. plain: no filter; values stay, and their expected error is their noise.
        Returns the filtered values, 0 to 1 unless plain, and the expected square of their error. Where there is no
        owner, or a texel's place is no number, the value stays, and its error is 0.
        """
        filtered, error = value.copy(), np.zeros_like(value)
        shape = self._surface.owner.shape
        images = (api.address(image, np.float32, *shape) for image in (value, noise, precision, filtered, error))
        signal = api.Signal(*images, min(max(_SHARPNESS, exponent), _SHARPEST), int(plain), self._surface.threads)
        for slab in self._slabs:
            part = self._whole or _Part(self._surface, slab, control)
            api.check(api.library().ob_filter_apply(part.handle, byref(signal), api.pointer_to(control)))
            del part  # before the next one is built
        return filtered, error


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
    parts = -(-int(np.count_nonzero(surface.covered)) // most)
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
    cuts = np.unique(np.quantile(places[:, axis], np.arange(1, parts) / parts).astype(np.float32)).tolist()
    return [api.Slab(low, high, axis) for low, high in pairwise([-math.inf, *cuts, math.inf])]
