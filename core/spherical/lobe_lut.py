"""The lobe's integrals as a small image, from which shaders rebuild reflection occlusion: of degree 3 or less.

∫_H Y_lm L_R dω depends on the exponent and on n·R alone, but for (sin θ)^m cos mφ, which is Re (R_x + i R_y)^m. What is
left once that is divided out is smooth up to R = N, so that a shader needs no angle.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from ..base.arrays import Doubles, Floats
from ..base.elementary import cos
from .spherical_harmonics import DIGITS, basis, lobe_terms, orders

DEGREE = 3
SIDE = 64  # texels of a tile
TILES = 4
PADDED = SIDE + 2  # texels of a tile of `lobe_splines`
_NEAREST = 0.03  # radians from the normal to which the sine can be divided out; nearer the integrals no longer change


@cache
def lobe_lut() -> Floats:
    """(SIDE, TILES · SIDE, 3) float32: terms f_lm by n·R along the rows and the lobe's width down them. Made once, and
    not to be written to.

    Column i of a tile is n·R = i / (SIDE − 1), row j is √(2 / (e + 2)) = j / (SIDE − 1): 1 is exponent 0, 0 a mirror.
    The terms, three a tile, are (l, m) = 00, 10, 20 | 30, 11, 21 | 31, 22, 32 | 33 and two channels of 0. Interpolated,
    they put RO off by less than 0.0025 for exponents from 1 to 300.
    """
    cosines = np.linspace(0.0, 1.0, SIDE)
    widths = np.linspace(0.0, 1.0, SIDE)[1:]
    rows = [_mirror(cosines), *(_smooth_terms(2.0 / width**2 - 2.0, cosines) for width in widths)]
    terms = np.stack(rows)
    placed = sorted(orders(DEGREE), key=lambda order: (order[1], order[0]))
    image = np.zeros((SIDE, SIDE, 3 * TILES), dtype=np.float32)
    for channel, (l, m) in enumerate(placed):  # noqa: E741
        image[..., channel] = terms[..., l * (l + 1) // 2 + m]
    tiled: Floats = np.concatenate(np.split(image, TILES, axis=2), axis=1)
    tiled.flags.writeable = False
    return tiled


@cache
def lobe_splines() -> Floats:
    """(PADDED, TILES · PADDED, 3) float32: coefficients of the cubic B-splines through `lobe_lut`, a tile each. Made
    once, and not to be written to.

    Sampled by a cubic B-spline, as shaders' bicubic filters are, they give the terms no less exactly. Texel i + 1 is
    above column i: one more on either side, which the filter takes in.
    """
    to_splines = _spline_matrix(SIDE)
    tiles = np.stack(np.split(lobe_lut().astype(np.float64), TILES, axis=1))
    down = (to_splines[None, :, :, None, None] * tiles[:, None]).sum(axis=2)
    splines = (to_splines[None, None, :, :, None] * down[:, :, None]).sum(axis=3)
    image: Floats = np.concatenate(splines.astype(np.float32), axis=1)
    image.flags.writeable = False
    return image


def _spline_matrix(count: int) -> Doubles:
    """(count + 2, count): coefficients of the spline through values at 0, 1, …; at either end its third derivative goes
    on across the first knot ("not a knot" in words of splines), so that the pieces there are one cubic."""
    weights = np.zeros((count + 2, count + 2))
    for place in range(count):
        weights[place + 1, place : place + 3] = 1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0
    weights[0, :5] = weights[-1, -5:] = 1.0, -4.0, 6.0, -4.0, 1.0
    return np.asarray(np.round(np.linalg.inv(weights)[:, 1:-1], DIGITS))


def _smooth_terms(exponent: float, cosines: Doubles) -> Doubles:
    """`lobe_terms` over (sin θ)^m."""
    held = np.minimum(cosines, cos(_NEAREST))
    sines = np.sqrt(1.0 - held**2)
    terms: Doubles = lobe_terms(exponent, held, DEGREE) / _powers(sines)[:, [m for _, m in orders(DEGREE)]]
    return terms


def _mirror(cosines: Doubles) -> Doubles:
    """The limit of an exponent without end: Y_lm at R, of which the horizon leaves half."""
    held = np.minimum(cosines, cos(_NEAREST))
    sines = np.sqrt(1.0 - held**2)
    powers = _powers(sines)
    values = basis(np.stack([sines, np.zeros_like(held), held], axis=1), DEGREE)
    terms: Doubles = np.stack([values[:, l * (l + 1) + m] / powers[:, m] for l, m in orders(DEGREE)], axis=1)  # noqa: E741
    terms[0] *= 0.5
    return terms


def _powers(sines: Doubles) -> Doubles:
    """(C,) → (C, DEGREE + 1): from 1 on, one product after the other."""
    return np.cumprod(np.stack([np.ones_like(sines), *DEGREE * [sines]], axis=1), axis=1)
