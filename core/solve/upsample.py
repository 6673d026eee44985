"""From the texels of a coarse image of a surface to those of one twice as wide and high.

Where texels are finer than what changes, not each needs rays of its own. About each a plane is fitted to the values of
the coarse texels around it, by place and by normal (joint upsampling, Kopf et al. 2007, of first order); what those
leave over about it tells where that is not enough. How that is done stands in kernel/src/upsample_code.h.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from ctypes import byref, c_void_p
from dataclasses import dataclass

import numpy as np

from ..base import kernel_api as api
from ..base.arrays import Floats
from ..rays.texel_surface import TexelSurface
from .surface_filter import sharpness_of, slope_of

NOTHING_TOLD = 1.0  # the detail of a texel of which a coarser image tells nothing


@dataclass(frozen=True, eq=False)
class Estimates:
    """One map as known so far. rows: (H, W) float32 each, the values first. expected: (H, W) float32, the square of
    their error. rays: all that they took."""

    rows: Sequence[Floats]
    expected: Floats
    rays: int


@dataclass(frozen=True, eq=False)
class Upsampled(Estimates):
    """As a coarser image tells them. detail: (H, W) float32, the part of `expected` that is detail between its texels;
    1 where it tells nothing."""

    detail: Floats


def upsampled(
    coarse: TexelSurface,
    estimates: Estimates,
    fine: TexelSurface,
    exponent: float,
    *,
    control: api.Control | None = None,
) -> Upsampled:
    """Values of a finer image, twice as wide and high, of the same surface; 0 where it has no owner. exponent: the
    map's. Raises Cancelled, MemoryError."""
    rows = [np.zeros(fine.owner.shape, dtype=np.float32) for _ in estimates.rows]
    expected, detail = (np.zeros(fine.owner.shape, dtype=np.float32) for _ in range(2))
    shape = coarse.owner.shape
    values = _addresses(estimates.rows, shape)
    described = api.Coarse(
        api.address(coarse.owner, np.int32, *shape),
        api.address(coarse.positions, np.float32, *shape, 3),
        api.address(coarse.normals, np.float32, *shape, 3),
        values,
        api.address(estimates.expected, np.float32, *shape),
        sharpness_of(exponent),
        slope_of(exponent),
        *shape[::-1],
    )
    surface = fine.described()
    status = api.library().ob_upsample(
        byref(surface),
        byref(described),
        len(rows),
        fine.threads,
        api.pointer_to(control),
        _addresses(rows, fine.owner.shape),
        *(api.address(each, np.float32, *fine.owner.shape) for each in (expected, detail)),
    )
    api.check(status)
    expected += detail
    return Upsampled(rows, expected, estimates.rays, detail)


def _addresses(rows: Sequence[Floats], shape: tuple[int, ...]) -> ctypes.Array[c_void_p]:
    return (c_void_p * len(rows))(*(api.address(row, np.float32, *shape) for row in rows))
