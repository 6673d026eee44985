"""What an expected error comes to: by what probes measure where as much is expected."""

from __future__ import annotations

import math

import numpy as np

from ..base.arrays import Doubles, Longs

_OF_A_PART = 256  # probes at least, so that few of them do not decide
_MOST_PARTS = 16


def calibrated(expected: Doubles, of: Longs, squares: Doubles, weight: Doubles) -> Doubles:
    """The mean squared errors of blocks of texels, of the shape of what is expected of them.

    What the filter expects is told by the same noisy values as it filters: too little where they agree by chance, and
    too much where they do not. So blocks are put in order of it, and in each part of that order it is scaled to what
    the probes there measure; below the first as much is taken as in that.

    of: (N,) int64, the number of each probe's block. squares, weight: (N,) float64, their squared errors, which noise
    may carry below 0, and what they stand for.
    """
    there = expected.reshape(-1)[of]
    order = np.argsort(there)
    parts = np.array_split(order, min(max(len(of) // _OF_A_PART, 1), _MOST_PARTS))
    known = [found for part in parts if (found := _mean(there[part], squares[part], weight[part])) is not None]
    if not known:
        return expected
    places, scales = (np.log(each) for each in zip(*known, strict=True))
    least = math.exp(places[0])
    scale = np.exp(np.interp(np.log(np.maximum(expected, least)), places, scales))
    told: Doubles = np.maximum(expected, least) * scale
    return told


def _mean(expected: Doubles, squares: Doubles, weight: Doubles) -> tuple[float, float] | None:
    """What is expected of a part, and how many times that is measured; None where either is nothing."""
    total = float(weight.sum())
    if not total > 0.0:
        return None
    mean, measured = float(weight @ expected) / total, float(weight @ squares) / total
    doubt = math.sqrt(float((weight * (squares - measured)) @ (weight * (squares - measured)))) / total
    measured = max(measured, doubt)
    return (mean, measured / mean) if mean > 0.0 and measured > 0.0 else None
