"""The surface of a figure: limbs, trunk and head that flow into one another, sockets and a mouth cut into them."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from .surface_nets import Doubles, Longs, surface_net

Triple = tuple[float, float, float]
Distance = Callable[[Doubles], Doubles]  # (..., 3) places to signed distances, negative inside

CELL = 0.0062  # metres: a quad of the surface is about as long
LOW, HIGH = (-0.55, -0.24, -0.02), (0.55, 0.24, 1.3)
SOLE = 0.0005  # metres: how far the soles are off the floor
EYE, EYEBALL = (0.062, -0.125, 1.085), 0.036  # the left eye's middle and radius
SOCKET, LID = EYEBALL + 0.0012, EYEBALL + 0.015  # radii: the hollow that it lies in, and the lids over it


def body() -> tuple[Doubles, Longs]:
    """(V, 3) points and (Q, 4) quads. It faces against y and stands on z = 0."""
    block = _Block()
    for start, end, thick, thin, blend in LIMBS:
        block.join(_limb(start, end, thick, thin), _box((start, end), max(thick, thin)), blend)
    for middle, radii, blend in ROUND:
        block.join(_ellipsoid(middle, radii), _box((middle,), max(radii)), blend)
    block.join(_ellipsoid(EYE, (LID,) * 3), _box((EYE,), LID), 0.006)
    for middle, radii, blend in HOLLOWS:
        block.cut(_ellipsoid(middle, radii), _box((middle,), max(radii)), blend)
    block.cut(lambda place: place[..., 2] - SOLE, (np.array(LOW), np.array([*HIGH[:2], 0.05])), 0.0)
    return surface_net(block.values, [float(axis[0]) for axis in block.axes], CELL)


class _Block:
    """A field on a grid, carved piece by piece; what is said of x > 0 is as true of x < 0."""

    def __init__(self) -> None:
        ends = [(math.floor(low / CELL), math.ceil(high / CELL)) for low, high in zip(LOW, HIGH, strict=True)]
        self.axes = [
            CELL * np.arange(first, last + 1, dtype=np.int64) for first, last in ends
        ]  # alike on both sides of x = 0
        self.values = np.ones([len(axis) for axis in self.axes])

    def join(self, piece: Distance, box: tuple[Doubles, Doubles], blend: float) -> None:
        """Add a piece, rounding what is between within `blend`. box: of the piece where x > 0."""
        self._change(piece, box, blend, lambda values, distance: _least(values, distance, blend))

    def cut(self, piece: Distance, box: tuple[Doubles, Doubles], blend: float) -> None:
        """Take it away."""
        self._change(piece, box, blend, lambda values, distance: -_least(-values, distance, blend))

    def _change(
        self,
        piece: Distance,
        box: tuple[Doubles, Doubles],
        blend: float,
        change: Callable[[Doubles, Doubles], Doubles],
    ) -> None:
        pad = blend + 3.0 * CELL  # beyond which nothing near the surface changes
        there = [_within(axis, *ends) for axis, *ends in zip(self.axes, box[0] - pad, box[1] + pad, strict=True)]
        there[0] = _within(np.abs(self.axes[0]), box[0][0] - pad, box[1][0] + pad)
        x, y, z = np.meshgrid(*(axis[rows] for axis, rows in zip(self.axes, there, strict=True)), indexing="ij")
        rows = np.ix_(*there)
        self.values[rows] = change(self.values[rows], piece(np.stack([np.abs(x), y, z], axis=-1)))


def _within(axis: Doubles, low: float, high: float) -> Longs:
    return np.flatnonzero((axis >= low) & (axis <= high))


def _box(points: tuple[Triple, ...], radius: float) -> tuple[Doubles, Doubles]:
    corners = np.array(points)
    return corners.min(axis=0) - radius, corners.max(axis=0) + radius


def _least(a: Doubles, b: Doubles, blend: float) -> Doubles:
    """The lesser, with a fillet where they are within `blend` of one another."""
    least: Doubles = np.minimum(a, b)
    if blend > 0.0:
        least = least - np.maximum(blend - np.abs(a - b), 0.0) ** 2 / (4.0 * blend)
    return least


def _limb(start: Triple, end: Triple, thick: float, thin: float) -> Distance:
    """A capsule that tapers."""
    first, along = np.array(start), np.array(end) - start

    def distance(place: Doubles) -> Doubles:
        share = np.clip((place - first) @ along / (along @ along), 0.0, 1.0)
        off: Doubles = np.linalg.norm(place - first - share[..., None] * along, axis=-1)
        off -= thick + (thin - thick) * share
        return off

    return distance


def _ellipsoid(middle: Triple, radii: Triple) -> Distance:
    """Near its surface a distance, farther off about one."""

    def distance(place: Doubles) -> Doubles:
        scaled = (place - middle) / np.array(radii)
        length = np.linalg.norm(scaled, axis=-1)
        slope: Doubles = np.linalg.norm(scaled / np.array(radii), axis=-1)
        off: Doubles = length * (length - 1.0) / np.maximum(slope, 1e-9)
        return off

    return distance


_FINGERS = (((0.409, -0.086, 0.446), (0.436, -0.129, 0.401)), ((0.418, -0.058, 0.433), (0.455, -0.078, 0.374)),
            ((0.416, -0.030, 0.436), (0.446, -0.031, 0.388)))  # fmt: skip
# From, to, radius there and here, fillet. Then middles, radii, fillet.
LIMBS: tuple[tuple[Triple, Triple, float, float, float], ...] = (
    ((0.05, 0.0, 0.8), (0.125, 0.0, 0.79), 0.045, 0.045, 0.05),
    ((0.135, 0.0, 0.785), (0.27, 0.02, 0.63), 0.042, 0.034, 0.03),
    ((0.27, 0.02, 0.63), (0.37, -0.03, 0.49), 0.034, 0.027, 0.02),
    ((0.378, -0.037, 0.48), (0.405, -0.056, 0.447), 0.026, 0.029, 0.02),
    *((start, end, 0.0115, 0.0095, 0.008) for start, end in _FINGERS),
    ((0.375, -0.065, 0.468), (0.362, -0.116, 0.436), 0.013, 0.0105, 0.01),
    ((0.0, 0.01, 0.82), (0.0, 0.005, 0.93), 0.05, 0.05, 0.03),
    ((0.065, 0.005, 0.5), (0.075, -0.005, 0.29), 0.062, 0.048, 0.02),
    ((0.075, -0.005, 0.29), (0.08, 0.015, 0.08), 0.047, 0.036, 0.02),
    ((0.08, 0.02, 0.045), (0.095, -0.1, 0.035), 0.038, 0.036, 0.02),
)
ROUND: tuple[tuple[Triple, Triple, float], ...] = (
    ((0.0, 0.01, 0.52), (0.115, 0.085, 0.085), 0.03),
    ((0.0, -0.01, 0.63), (0.105, 0.085, 0.1), 0.04),
    ((0.0, 0.0, 0.74), (0.12, 0.08, 0.1), 0.04),
    ((0.0, 0.0, 1.06), (0.155, 0.16, 0.17), 0.03),
    ((0.0, -0.05, 0.97), (0.09, 0.08, 0.06), 0.05),
    ((0.075, -0.1, 1.0), (0.045, 0.04, 0.04), 0.03),
    ((0.0, -0.172, 1.035), (0.024, 0.03, 0.021), 0.015),
    ((0.165, 0.01, 1.05), (0.02, 0.036, 0.05), 0.012),
    ((0.062, -0.142, 1.142), (0.045, 0.016, 0.011), 0.015),
)
HOLLOWS: tuple[tuple[Triple, Triple, float], ...] = (
    ((0.064, -0.178, 1.082), (0.034, 0.055, 0.024), 0.008),
    (EYE, (SOCKET,) * 3, 0.0),
    ((0.0, -0.135, 0.966), (0.042, 0.035, 0.009), 0.006),
    ((0.185, -0.012, 1.05), (0.014, 0.02, 0.03), 0.008),
)
