"""The filter that knows the surface: texels near one another on it, and local regression over them.

Neighbours are found in space, so they reach across the seams of charts, and not round an edge, through a wall or onto
another sheet. What the filter does stands in kernel/src/smooth_code.h.
"""

from __future__ import annotations

import math
from ctypes import byref, c_void_p
from itertools import pairwise

import numpy as np

from ..rays import kernel_api as api
from ..rays.tracer import describe_surface, pointer_to
from ..scene.scene import Floats, Ints, Placed
from ..texels.rasterize import surface_points

# Weights fall as exp(-sharpness (1 - cos)) of the angle between normals: to a third at 10 degrees, to nothing at a
# crease of 30. Lobes narrower than that turn with the normal, and are compared as narrowly.
_SHARPNESS = 60.0
_SHARPEST = 1e6  # beyond it float32 no longer tells normals apart


# Texels of one part: some 0.6 GB. A larger image is filtered slab by slab, each with what it looks at beyond.
MOST_TEXELS = 1 << 23
_SAMPLED = 16  # one row and column in so many tells where the texels lie


class Field:
    """The texels of one surface in one image. owner: (H, W) int32, the triangle that owns each, -1 none; kept, as the
    surface is. most: texels that are held at a time; of more the field is built anew, in parts, at each use.

    Raises Cancelled, MemoryError.
    """

    def __init__(
        self,
        surface: Placed,
        owner: Ints,
        *,
        threads: int = 0,
        most: int = MOST_TEXELS,
        control: api.Control | None = None,
    ) -> None:
        self._surface, self._owner, self._threads = surface, owner, threads
        self._slabs = _slabs(surface, owner, most, threads)
        self._whole = _Part(surface, owner, None, threads, control) if self._slabs == [None] else None

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
        images = (api.address(image, np.float32) for image in (value, noise, precision, filtered, error))
        signal = api.Signal(*images, min(max(_SHARPNESS, exponent), _SHARPEST), int(plain), self._threads)
        for slab in self._slabs:
            part = self._whole or _Part(self._surface, self._owner, slab, self._threads, control)
            api.check(api.library().ob_field_filter(part.handle, byref(signal), pointer_to(control)))
            del part  # before the next one is built
        return filtered, error


class _Part:
    """The kernel's field of one slab, or of all."""

    def __init__(
        self, surface: Placed, owner: Ints, slab: api.Slab | None, threads: int, control: api.Control | None
    ) -> None:
        self.handle = c_void_p()
        described = describe_surface(surface, owner)
        where = None if slab is None else byref(slab)
        api.check(
            api.library().ob_field_build(byref(described), where, threads, pointer_to(control), byref(self.handle))
        )
        api.release_with(self, "ob_field_free", self.handle)


def _slabs(surface: Placed, owner: Ints, most: int, threads: int) -> list[api.Slab | None]:
    """Slabs across the longest axis, of about as many texels each; a None where all texels may be held at once."""
    parts = -(-int(np.count_nonzero(owner >= 0)) // most)
    if parts <= 1:
        return [None]
    sample = np.ascontiguousarray(owner[_SAMPLED // 2 :: _SAMPLED, _SAMPLED // 2 :: _SAMPLED])
    places = surface_points(surface, sample, threads=threads)[0][sample >= 0]
    places = places[np.isfinite(places).all(axis=1)]
    if not len(places):
        return [None]
    axis = int(np.argmax(np.ptp(places, axis=0)))
    cuts = np.unique(np.quantile(places[:, axis], np.arange(1, parts) / parts).astype(np.float32)).tolist()
    return [api.Slab(low, high, axis) for low, high in pairwise([-math.inf, *cuts, math.inf])]
