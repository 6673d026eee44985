"""Vectors in rows: lengths, linear maps of points and of normals.

Term by term, not by numpy's matrix products and norms: those are handed to libraries that add up in another order, or
round less often, on each kind of processor, and then bakes of two machines would not give the same bits. They are also
several times as slow on rows so short.
"""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from .arrays import Doubles

_Real = TypeVar("_Real", np.float32, np.float64)


def dot(a: NDArray[_Real], b: NDArray[_Real]) -> NDArray[_Real]:
    """(..., 3) · (..., 3) → (...)."""
    x, y, z = (np.multiply(a[..., axis], b[..., axis]) for axis in range(3))
    product: NDArray[_Real] = x + y + z
    return product


def length_of(vectors: NDArray[_Real]) -> NDArray[_Real]:
    """(..., 3) → (...)."""
    length: NDArray[_Real] = np.sqrt(dot(vectors, vectors))
    return length


def mapped(points: NDArray[_Real], linear: Doubles) -> NDArray[_Real]:
    """M p of each of (..., 3) points, by a (3, 3) matrix; in the points' precision."""
    result = np.empty(points.shape, dtype=points.dtype)
    rows: NDArray[_Real] = linear.astype(points.dtype)
    for axis, row in enumerate(rows):
        result[..., axis] = dot(points, row)
    return result


def weighted(weights: NDArray[_Real], corners: NDArray[_Real]) -> NDArray[_Real]:
    """Σ w_c p_c of each triangle: (..., 3) weights of (..., 3, C) values at its corners → (..., C)."""
    first, second, third = (np.multiply(weights[..., c, np.newaxis], corners[..., c, :]) for c in range(3))
    values: NDArray[_Real] = first + second + third
    return values


def determinant(linear: Doubles) -> float:
    """Of a (3, 3) matrix. In plain numbers, which is ten times as fast as numpy on so few, and the same to the bit."""
    (a, b, c), (d, e, f), (g, h, i) = linear.tolist()
    return float(a * (e * i - f * h) + b * (f * g - d * i) + c * (d * h - e * g))


def inverse_transposed(linear: Doubles) -> Doubles:
    """M⁻ᵀ but for a factor, so that its largest element is 1: the cofactors of M, with the sign of its determinant."""
    # The cofactors of what is tiny would be none. By a power of two, which rounds nothing: the sign stays.
    small = np.ldexp(linear, -np.frexp(np.abs(linear).max())[1])
    cofactors = np.stack([np.cross(small[(i + 1) % 3], small[(i + 2) % 3]) for i in range(3)])
    scaled: Doubles = cofactors * (np.sign(determinant(small)) / np.abs(cofactors).max())
    return scaled


def unit(vectors: NDArray[_Real]) -> NDArray[_Real]:
    """(..., 3) vectors at unit length; zero, and what has no length, becomes zero."""
    length = length_of(vectors)[..., np.newaxis]
    result: NDArray[_Real] = np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0.0)
    return result


def transformed_normals(normals: NDArray[_Real], linear: Doubles) -> NDArray[_Real]:
    """Normals, (..., 3), under a linear map, by its inverse transpose, at unit length; a zero normal stays zero."""
    with np.errstate(over="ignore", invalid="ignore"):  # normals that are no numbers end as zero
        return unit(mapped(normals, inverse_transposed(linear)))
