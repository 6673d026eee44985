"""Elementary functions, and matrix products, whose every bit is the same on all systems and processors: numpy's, and
Python's, are those of the system's C library or made for the processor, and differ in their last bits. What decides
values goes by these."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from . import kernel_api as api
from .arrays import Doubles, Floats

_SIN, _COS, _EXP, _LOG, _LOG1P, _ARCCOS = range(6)  # of enum ob_function


def sin(x: ArrayLike) -> Doubles:
    """Of angles up to a million; float64, as all of these, of the shape of what is given."""
    return _of(_SIN, x)


def cos(x: ArrayLike) -> Doubles:
    """Of angles up to a million."""
    return _of(_COS, x)


def exp(x: ArrayLike) -> Doubles:
    """Nothing below -708, infinite above 709."""
    return _of(_EXP, x)


def log(x: ArrayLike) -> Doubles:
    """Of 0 minus infinity, of less not a number."""
    return _of(_LOG, x)


def log1p(x: ArrayLike) -> Doubles:
    """log(1 + x), as exact near 0. Of -1 minus infinity, of less not a number."""
    return _of(_LOG1P, x)


def arccos(x: ArrayLike) -> Doubles:
    """Of -1 to 1, else not a number."""
    return _of(_ARCCOS, x)


def arcsin(x: ArrayLike) -> Doubles:
    """Of -1 to 1, else not a number."""
    sines = np.asarray(x, dtype=np.float64)
    return arctan2(sines, np.sqrt((1.0 - sines) * (1.0 + sines)))


def arctan2(y: ArrayLike, x: ArrayLike) -> Doubles:
    """The angle of (x, y) from the first axis, within π either way."""
    one, other = np.broadcast_arrays(np.asarray(y, dtype=np.float64), np.asarray(x, dtype=np.float64))
    one, other = (np.ascontiguousarray(each).reshape(each.shape) for each in (one, other))
    angles = np.empty(one.shape)
    places = (api.address(each, np.float64, *one.shape) for each in (one, other))
    api.check(api.library().ob_atan2(*places, one.size, api.address(angles, np.float64, *one.shape)))
    return angles


def power(x: ArrayLike, exponent: float) -> Doubles:
    """Of numbers above 0."""
    return exp(exponent * log(x))


def powers(x: Floats, exponent: float) -> Floats:
    """(...) float32 of numbers above 0 and up to about 1; exponent: 0 or more. The faster one, in single precision."""
    given = np.ascontiguousarray(x)
    values = np.empty_like(given)
    place = api.address(given, np.float32, *given.shape)
    api.check(api.library().ob_powers(place, given.size, exponent, api.address(values, np.float32, *given.shape)))
    return values


def product(a: Floats, b: Floats, threads: int = 0) -> Floats:
    """(N, K) times (K, M) → (N, M) float32, each sum from the first product to the last. threads 0: all."""
    (rows, inner), columns = a.shape, b.shape[1]
    left, right, result = np.ascontiguousarray(a), np.ascontiguousarray(b), np.empty((rows, columns), dtype=np.float32)
    places = (api.address(left, np.float32, rows, inner), api.address(right, np.float32, inner, columns))
    into = api.address(result, np.float32, rows, columns)
    api.check(api.library().ob_product(*places, rows, inner, columns, threads, into))
    return result


def _of(function: int, x: ArrayLike) -> Doubles:
    given = np.ascontiguousarray(x, dtype=np.float64).reshape(np.shape(x))
    values = np.empty(given.shape)
    place = api.address(given, np.float64, *given.shape)
    api.check(api.library().ob_elementary(function, place, given.size, api.address(values, np.float64, *given.shape)))
    return values
