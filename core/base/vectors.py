"""Vectors in rows: unit length, and normals under linear maps."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from .arrays import Doubles

_Real = TypeVar("_Real", np.float32, np.float64)


def unit(vectors: NDArray[_Real]) -> NDArray[_Real]:
    """(..., 3) vectors at unit length; zero, and what has no length, becomes zero."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    result: NDArray[_Real] = np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0.0)
    return result


def transformed_normals(normals: NDArray[_Real], linear: Doubles) -> NDArray[_Real]:
    """Normals, (..., 3), under a linear map, by its inverse transpose, at unit length; a zero normal stays zero."""
    inverse = np.linalg.inv(linear)
    inverse /= np.abs(inverse).max()  # the length does not matter, and its square must stay within float32
    with np.errstate(over="ignore", invalid="ignore"):  # normals that are no numbers end as zero
        return unit(normals @ inverse.astype(normals.dtype))  # n·M⁻¹ = (M⁻ᵀ n)ᵀ
