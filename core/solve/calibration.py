"""What an expected error comes to: by what probes measure where as much is expected."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..base import elementary
from ..base.arrays import Doubles, Longs

_OF_A_PART = 256  # probes at least, so that few of them do not decide
_MOST_PARTS = 16


def calibrated(expected: Doubles, of: Longs, squares: Doubles, weight: Doubles) -> Doubles:
    """The mean squared errors of blocks of texels, of the shape of what is expected of them; as it is without probes.

    What the filter expects is told by the same noisy values as it filters: too little where they agree by chance, and
    too much where they do not. So blocks are put in order of it, and in each part of that order it is scaled to what
    the probes there measure; below the middle of the first as much is taken as there. Where nothing is expected their
    own probes tell. Together it comes to what all probes measure.

    of: (N,) int64, the number of each probe's block. squares, weight: (N,) float64, their squared errors, which noise
    may carry below 0, and what they stand for.
    """
    there = expected.reshape(-1)[of]
    some = np.flatnonzero(there > 0.0)
    parts = np.array_split(
        some[np.argsort(there[some], kind="stable")], min(max(len(some) // _OF_A_PART, 1), _MOST_PARTS)
    )
    told = _scaled(expected, [(there[part], squares[part], weight[part]) for part in parts if len(part)])
    if len(some) < len(of):
        nothing = np.flatnonzero(there <= 0.0)
        told[expected <= 0.0] = max(float(np.average(squares[nothing], weights=weight[nothing])), 0.0)
    measured, together = float((weight * squares).sum()), float((weight * told.reshape(-1)[of]).sum())
    return told * (measured / together) if measured > 0.0 and together > 0.0 else told


def _scaled(expected: Doubles, parts: Sequence[tuple[Doubles, Doubles, Doubles]]) -> Doubles:
    """What is expected, scaled between the parts' means as in these. Of each part what its probes expect, their squares
    and weights."""
    known = [(float(np.average(each, weights=weight)), _measured(squares, weight)) for each, squares, weight in parts]
    known = [(mean, measured) for mean, measured in known if measured > 0.0]
    if not known:
        return expected.copy()
    means, measured = np.array(known).T
    at_least = np.maximum(expected, means[0])
    by = np.interp(elementary.log(at_least), elementary.log(means), elementary.log(measured / means))
    scaled: Doubles = at_least * elementary.exp(by)
    return scaled


def _measured(squares: Doubles, weight: Doubles) -> float:
    """Their mean, or its own noise where that is more."""
    mean = float(np.average(squares, weights=weight))
    return max(mean, math.sqrt(float(((weight * (squares - mean)) ** 2).sum())) / float(weight.sum()))
