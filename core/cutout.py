"""Where materials let light through: pictures of opacity on the triangles of an occluder, as on leaves and fences."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from .errors import InputError
from .scene import Floats, Ints


class Wrap(IntEnum):
    """What lies beyond a picture's edges; the values are the kernel's."""

    REPEAT = 0
    EXTEND = 1
    CLIP = 2  # nothing: it is clear there
    MIRROR = 3


@dataclass(frozen=True, eq=False)
class Alpha:
    """One picture of opacity. values: (h, w) float32, 0 clear to 1 opaque, row 0 at the top; (1, 1) for a constant.
    linear: interpolated between the middles of its texels, else the nearest.

    Raises InputError for values that are not within 0 and 1.
    """

    values: Floats
    linear: bool = True
    wrap: Wrap = Wrap.REPEAT

    def __post_init__(self) -> None:
        if self.values.ndim != 2 or not self.values.size:
            raise InputError(f"opacity of shape {self.values.shape}: give (h, w) values")
        if not (np.isfinite(self.values).all() and self.values.min() >= 0.0 and self.values.max() <= 1.0):
            raise InputError("opacity: values are not within 0 and 1; give 0 for clear, 1 for opaque")


@dataclass(frozen=True, eq=False)
class Cutout:
    """What of a mesh is not opaque. alpha: (T,) int32, which of the pictures covers each triangle, -1 where it is
    opaque. uv: (T, 3, 2) float32, v up. Opacity between 0 and 1 blocks that share of the light."""

    alphas: Sequence[Alpha]
    alpha: Ints
    uv: Floats


def simplified(cutout: Cutout) -> Cutout | None:
    """Without pictures that are opaque everywhere, and triangles whose UVs are no numbers, which are taken for opaque;
    None where nothing is left."""
    solid = np.array([bool(each.values.min() >= 1.0) for each in cutout.alphas], dtype=bool)
    placed = np.isfinite(cutout.uv).all(axis=(1, 2))
    kept = (cutout.alpha >= 0) & placed
    kept[kept] = ~solid[cutout.alpha[kept]]
    if not kept.any():
        return None
    uv = np.where(placed[:, np.newaxis, np.newaxis], cutout.uv, np.float32(0.0))
    return Cutout(cutout.alphas, np.where(kept, cutout.alpha, -1).astype(np.int32), np.ascontiguousarray(uv))
