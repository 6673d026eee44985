"""The filter that knows the surface: texels near one another on it, and local regression over them.

Neighbours are found in space, so they reach across the seams of charts, and not round an edge, through a wall or onto
another sheet. What the filter does stands in kernel/src/smooth_code.h.
"""

from __future__ import annotations

from ctypes import byref, c_void_p

import numpy as np

from . import kernel_api as api
from .scene import Floats, Ints, Placed
from .tracer import describe_surface, pointer_to

# Weights fall as exp(-sharpness (1 - cos)) of the angle between normals: to a third at 10 degrees, to nothing at a
# crease of 30. Lobes narrower than that turn with the normal, and are compared as narrowly.
_SHARPNESS = 60.0
_SHARPEST = 1e6  # beyond it float32 no longer tells normals apart


class Field:
    """The texels of one surface in one image. owner: (H, W) int32, the triangle that owns each, -1 none.

    Raises Cancelled, MemoryError.
    """

    def __init__(self, surface: Placed, owner: Ints, *, threads: int = 0, control: api.Control | None = None) -> None:
        self._threads = threads
        self._handle = c_void_p()
        described = describe_surface(surface, owner)
        api.check(api.library().ob_field_build(byref(described), threads, pointer_to(control), byref(self._handle)))
        api.release_with(self, "ob_field_free", self._handle)

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
        api.check(api.library().ob_field_filter(self._handle, byref(signal), pointer_to(control)))
        return filtered, error
