"""Singular values of 3 x 3 matrices, whose every bit is the same on all systems: LAPACK's are not."""

from __future__ import annotations

import numpy as np

from .arrays import Doubles, Ints
from .vectors import dot, length_of, mapped

NEGLIGIBLE = 1e-15  # a singular value that is this share of the greatest, or less, is as good as zero
_SWEEPS = 8  # each squares what is left, about: 4 would do
_PAIRS = ((0, 1), (0, 2), (1, 2))


def singular_values(linear: Doubles) -> Doubles:
    """(N, 3), from the greatest to the least, of finite (N, 3, 3)."""
    images, _, exponent = _decomposed(linear)
    values: Doubles = np.ldexp(-np.sort(-length_of(np.swapaxes(images, 1, 2)), axis=1), exponent[:, np.newaxis])
    return values


def pseudo_inverse_transposed(linear: Doubles) -> Doubles:
    """(M⁺)ᵀ of a finite (3, 3) matrix that has no inverse: Moore and Penrose's, but for a power of two."""
    images, axes, _ = (each[0] for each in _decomposed(linear[np.newaxis]))
    squares = dot(images.T, images.T)
    kept = squares > NEGLIGIBLE**2 * squares.max()
    scaled = np.where(kept, images / np.where(kept, squares, 1.0), 0.0)
    return mapped(scaled, axes)


def _decomposed(linear: Doubles) -> tuple[Doubles, Doubles, Ints]:
    """The axes so turned that their images stand upright on one another: M V over a power of two, the rotation V,
    (N, 3, 3) each, and the power, (N,).

    The lengths of the columns of M V are the singular values. One-sided Jacobi rotations (Hestenes, "Inversion of
    matrices by biorthogonalization and related results", 1958).
    """
    exponent = np.frexp(np.abs(linear).max(axis=(1, 2)))[1]
    images = np.ldexp(linear, -exponent[:, np.newaxis, np.newaxis])  # rounds nothing, and no square overflows
    axes = np.broadcast_to(np.eye(3), images.shape).copy()
    for one, other in _SWEEPS * _PAIRS:
        cosine, sine = _rotation(images[..., one], images[..., other])
        for columns in (images, axes):
            first, second = columns[..., one].copy(), columns[..., other].copy()
            columns[..., one] = cosine * first - sine * second
            columns[..., other] = sine * first + cosine * second
    return images, axes, exponent


def _rotation(one: Doubles, other: Doubles) -> tuple[Doubles, Doubles]:
    """Cosine and sine, (N, 1) each, of the lesser angle that makes two columns, (N, 3) each, orthogonal."""
    product = dot(one, other)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        ratio = (dot(other, other) - dot(one, one)) / (2.0 * product)
        tangent = np.copysign(1.0, ratio) / (np.abs(ratio) + np.sqrt(1.0 + ratio * ratio))
    tangent = np.where(product == 0.0, 0.0, tangent)[:, None]
    cosine = 1.0 / np.sqrt(1.0 + tangent * tangent)
    return cosine, cosine * tangent
