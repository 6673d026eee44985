"""Visibility over the hemisphere in spherical harmonics, and reflection occlusion from them, for any view.

Real, orthonormal over the sphere, without the phase (-1)^m: with Q_lm(z) = P_l^m(z) / (1 − z²)^(m/2),

    Y_l0 = K_l0 Q_l0(z),  Y_l,m = √2 K_lm Q_lm(z) Re (x + iy)^m,  Y_l,−m = √2 K_lm Q_lm(z) Im (x + iy)^m,
    K_lm = √((2l+1)/(4π) · (l−m)!/(l+m)!),

in the frame of the texel (`cells`), Y_lm at place l(l+1) + m. Y_1,−1, Y_10 and Y_11 are √(3/(4π)) times y, z and x.

A reflection meets only V above the horizon, so the code is fitted there and the lobe cut off there, by quadrature:
RO = Σ c_lm ∫_H Y_lm L_R dω. Against the convolution that Ramamoorthi & Hanrahan (An Efficient Representation for
Irradiance Environment Maps, 2001) use for whole spheres this takes a third of the error off, and more of wide lobes.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from math import factorial, pi, sqrt

import numpy as np

from ..base.arrays import Doubles, Floats, Reals
from ..base.elementary import arctan2, cos, product
from ..base.errors import InputError
from .hemisphere_cells import check_cells, integrals
from .lobe import check_exponent, lobe_nodes

DEGREES = range(1, 7)
_GRAZING = 0.25  # added to the weight cos θ: what is low counts less, since less of the lobes is there
_REGULAR = 2e-3  # added to the Gram matrix, whose eigenvalues are 1 at most: keeps coefficients, and noise, small
_ANGLES = 513  # of R, in the tables


def check_degree(degree: int) -> None:
    """Raises InputError for a degree that is not baked."""
    if degree not in DEGREES:
        raise InputError(f"spherical harmonics of degree {degree}: not baked; choose 1 to {DEGREES[-1]}")


def count_of(degree: int) -> int:
    """How many coefficients a degree has."""
    return (degree + 1) ** 2


def orders(degree: int) -> Iterator[tuple[int, int]]:
    """All (l, m) with m ≥ 0, in the order of `lobe_terms`: place l(l+1)/2 + m."""
    return ((l, m) for l in range(degree + 1) for m in range(l + 1))  # noqa: E741 - the letter of the field


def basis(ways: Doubles, degree: int) -> Doubles:
    """Y_lm at (N, 3) unit directions: (N, (degree+1)²) float64."""
    values = np.empty((len(ways), count_of(degree)))
    legendre = _legendre(ways[:, 2], degree)
    powers = _azimuths(ways[:, 0], ways[:, 1], degree)
    for place, (l, m) in enumerate(orders(degree)):  # noqa: E741
        cosine, sine = powers[m]
        values[:, l * (l + 1) + m] = legendre[place] * cosine
        if m:
            values[:, l * (l + 1) - m] = legendre[place] * sine
    return values


def fit(cells: Floats, degree: int) -> Floats:
    """The code of mean visibilities in cells: (N, side, side) float32 → (N, (degree+1)²) float32.

    Least squares over the hemisphere with the weight ¼ + cos θ, regularised; what is equally visible everywhere comes
    out exactly, so that RO of an open texel is the open horizon. Raises InputError for shapes and degrees that are not
    baked.
    """
    check_degree(degree)
    check_cells(cells)
    matrix = _fit_matrix(degree, cells.shape[1])
    return product(cells.reshape(len(cells), -1), matrix.astype(np.float32).T)


@lru_cache
def bounds(degree: int, side: int = 16) -> tuple[Floats, Floats]:
    """The least and the greatest value of each coefficient that any cells can have: ((degree+1)²,) float32 each.

    The fit is linear and visibility lies within [0, 1]: about the code of ½ everywhere, which is √π, 0, 0, …, each
    coefficient goes as far to both sides as half of the sum of the absolute values of its row of the matrix. They are
    reached: the cells of positive weight open, the others closed. Raises InputError for a degree that is not baked.
    """
    check_degree(degree)
    reach = 0.5 * np.abs(_fit_matrix(degree, side)).sum(axis=1)
    middle = 0.5 * _open_code(degree)
    return (middle - reach).astype(np.float32), (middle + reach).astype(np.float32)


def rebuild(code: Floats, reflected: Reals, exponent: float) -> Floats:
    """RO from codes: (N, (degree+1)²), and unit R in the texels' frames, (N, 3) → (N,) float32, 0 to H_e(R).

    R below the horizon is taken for one on it. Raises InputError for another number of coefficients or an exponent
    below 0.
    """
    degree = _degree_of(code)
    x, y, z = (np.asarray(reflected[:, axis], dtype=np.float64) for axis in range(3))
    table = _lobe_table(check_exponent(exponent), degree)
    place = arctan2(np.sqrt(x * x + y * y), np.maximum(z, 0.0)) * ((_ANGLES - 1) / (0.5 * pi))
    first = np.minimum(place.astype(np.int64), _ANGLES - 2)
    terms = table[first] + (place - first)[:, None] * (table[first + 1] - table[first])
    length = np.sqrt(x * x + y * y)
    turned = length > 0.0
    along = np.divide(x, length, out=np.ones_like(x), where=turned)
    powers = _azimuths(along, np.divide(y, length, out=np.zeros_like(y), where=turned), degree)
    sums = np.zeros(len(code))
    for column, (l, m) in enumerate(orders(degree)):  # noqa: E741
        cosine, sine = powers[m]
        about = code[:, l * (l + 1) + m] * cosine
        if m:
            about = about + code[:, l * (l + 1) - m] * sine
        sums += terms[:, column] * about
    return np.clip(sums, 0.0, sqrt(4.0 * pi) * terms[:, 0]).astype(np.float32)


def lobe_terms(exponent: float, cosines: Doubles, degree: int) -> Doubles:
    """∫_H Y_lm L_R dω for m ≥ 0 and R = (sin θ, 0, cos θ): (C,) cos θ → (C, (degree+1)(degree+2)/2) float64.

    For any other R, Y_l,m takes cos mφ of it and Y_l,−m sin mφ, φ the azimuth of R. The first term is H_e / √(4π).
    """
    terms = np.empty((len(cosines), (degree + 1) * (degree + 2) // 2))
    for start in range(0, len(cosines), _AT_A_TIME):
        part = slice(start, start + _AT_A_TIME)
        ways, weights = lobe_nodes(exponent, cosines[part])
        legendre = _legendre(ways[..., 2], degree)
        powers = _azimuths(ways[..., 0], ways[..., 1], degree)
        for column, (_, m) in enumerate(orders(degree)):
            terms[part, column] = (weights * legendre[column] * powers[m][0]).sum(axis=1)
    return terms


_AT_A_TIME = 64  # lobes: their nodes fit the cache


def _degree_of(code: Floats) -> int:
    degree = next((each for each in DEGREES if count_of(each) == code.shape[1]), None)
    if degree is None:
        raise InputError(f"{code.shape[1]} coefficients a texel: no whole degree; give (degree + 1)² of degree 1 to 6")
    return degree


@lru_cache(maxsize=32)
def _lobe_table(exponent: float, degree: int) -> Doubles:
    """`lobe_terms` at _ANGLES angles of R, from the normal to the horizon."""
    return lobe_terms(exponent, cos(np.linspace(0.0, 0.5 * pi, _ANGLES)), degree)


def _legendre(z: Doubles, degree: int) -> list[Doubles]:
    """√2 K_lm Q_lm(z), of m = 0 without the √2, in the order of `orders`, by the recurrence in l."""
    plain: dict[tuple[int, int], Doubles] = {}
    scaled = []
    for l, m in orders(degree):  # noqa: E741
        if l == m:
            plain[l, m] = np.full_like(z, factorial(2 * m) / (2**m * factorial(m)))  # (2m − 1)!!
        else:
            before = plain[l - 2, m] * (l + m - 1) if l - 2 >= m else 0.0
            plain[l, m] = (z * plain[l - 1, m] * (2 * l - 1) - before) / (l - m)
        factor = (2 * l + 1) / (4.0 * pi) * factorial(l - m) / factorial(l + m)
        scaled.append(plain[l, m] * sqrt(factor * (2.0 if m else 1.0)))
    return scaled


def _azimuths(x: Doubles, y: Doubles, degree: int) -> list[tuple[Doubles, Doubles]]:
    """(x + iy)^m for m up to the degree, real and imaginary parts: numpy multiplies complex numbers with more or fewer
    roundings, as the processor has it."""
    powers = [(np.ones_like(x), np.zeros_like(x))]
    for _ in range(degree):
        real, imaginary = powers[-1]
        powers.append((real * x - imaginary * y, real * y + imaginary * x))
    return powers


def _open_code(degree: int) -> Doubles:
    """The code of visibility 1."""
    return np.concatenate([[sqrt(4.0 * pi)], np.zeros(count_of(degree) - 1)])


DIGITS = 12  # after the point: beyond them each system's linear algebra has its own, and what is 0 by symmetry none


@lru_cache
def _fit_matrix(degree: int, side: int) -> Doubles:
    """((degree+1)², side²): what each cell adds to each coefficient.

    The normal equations (G + λ) c = ∫ w V Y, w the weight over its mean. The means of the cells over all go straight to
    the code of their constant, and only what differs from it through the equations.
    """

    def weighted(ways: Doubles) -> Doubles:
        return basis(ways, degree) * ((_GRAZING + ways[:, 2:]) / (_GRAZING + 0.5))

    def products(ways: Doubles) -> Doubles:
        return (weighted(ways)[:, :, None] * basis(ways, degree)[:, None, :]).reshape(len(ways), -1)

    count = count_of(degree)
    gram = integrals(products, 8).sum(axis=0).reshape(count, count)
    matrix = np.linalg.solve(gram + _REGULAR * np.eye(count), integrals(weighted, side).T)
    left = matrix + (_open_code(degree) - matrix.sum(axis=1))[:, None] / side**2
    rounded: Doubles = np.round(left, DIGITS) + 0.0  # no -0
    return rounded
