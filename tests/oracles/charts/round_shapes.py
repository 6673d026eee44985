"""Round things: tubes, cones, rings, domes, springs, capsules, tori, as finely cut as asked."""

from __future__ import annotations

import numpy as np

from ....core.base.arrays import Longs
from .polygon_mesh import PolygonMesh, joined, lathe, net, of_faces, placed


def tube(sides: int, height: float = 2.0, rows: int = 1, closed: bool = False) -> PolygonMesh:
    """A cylinder of radius 1; closed: with an n-gon at either end."""
    levels = np.linspace(0.0, height, rows + 1)
    side = lathe(np.stack([np.ones(rows + 1), levels], axis=1), sides)
    return _with_ends(side, sides, top=True, bottom=True) if closed else side


def cone(sides: int, height: float = 2.0, base: bool = True) -> PolygonMesh:
    """A cone of radius 1, triangles about its apex."""
    side = lathe([(1.0, 0.0), (0.0, height)], sides)
    return _with_ends(side, sides, bottom=True) if base else side


def ring(sides: int, inner: float = 0.5) -> PolygonMesh:
    """A flat disc of radius 1 with a hole."""
    return lathe([(1.0, 0.0), (inner, 0.0)], sides)


def torus(sides: int, around: int, thickness: float = 0.3) -> PolygonMesh:
    """sides: along the ring of radius 1. around: about its section."""
    turn, roll = (
        2.0 * np.pi * np.arange(sides, dtype=np.int64) / sides,
        2.0 * np.pi * np.arange(around, dtype=np.int64)[:, None] / around,
    )
    reach = 1.0 + thickness * np.cos(roll)
    points = [reach * np.cos(turn), reach * np.sin(turn), thickness * np.sin(roll) + 0.0 * turn]
    return net(np.stack(points, axis=-1), close_rows=True, close_columns=True)


def dome(sides: int, rows: int = 8) -> PolygonMesh:
    """A hemisphere, open below."""
    rise = 0.5 * np.pi * np.arange(rows + 1, dtype=np.int64) / rows
    profile = np.stack([np.cos(rise), np.sin(rise)], axis=1)
    profile[-1] = (0.0, 1.0)
    return lathe(profile, sides)


def sphere(columns: int = 24, rows: int = 12) -> PolygonMesh:
    """Of quads; those at the poles have two corners in one place, so half of each has no area."""
    rise, turn = (
        np.pi * np.arange(rows + 1, dtype=np.int64) / rows,
        2.0 * np.pi * np.arange(columns, dtype=np.int64) / columns,
    )
    ring = np.sin(rise)[:, None]
    points = np.stack([ring * np.cos(turn), ring * np.sin(turn), -np.cos(rise)[:, None] + 0.0 * turn], axis=-1)
    points[0], points[-1] = (0.0, 0.0, -1.0), (0.0, 0.0, 1.0)
    return net(points, close_columns=True)


def capsule(sides: int, rows: int = 6, length: float = 2.0) -> PolygonMesh:
    """A tube of radius 1 with a dome on either end."""
    rise = 0.5 * np.pi * np.arange(rows + 1, dtype=np.int64) / rows
    upper = np.stack([np.cos(rise), np.sin(rise) + 0.5 * length], axis=1)
    upper[-1] = (0.0, 1.0 + 0.5 * length)
    return lathe(np.concatenate([upper[::-1] * (1.0, -1.0), upper]), sides)


def spring(sides: int, turns: float = 4.0, steps: int = 24, wire: float = 0.12, pitch: float = 0.5) -> PolygonMesh:
    """A helix of radius 1 of round wire, open at its ends. sides: of the wire. steps: a turn."""
    angle = np.linspace(0.0, 2.0 * np.pi * turns, max(2, round(steps * turns) + 1))[:, None]
    climb = pitch / (2.0 * np.pi)
    outward = np.concatenate([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    binormal = np.concatenate([-climb * np.sin(angle), climb * np.cos(angle), -np.ones_like(angle)], axis=1)
    binormal /= np.hypot(1.0, climb)
    middle = outward + climb * angle * np.array([0.0, 0.0, 1.0])
    roll = 2.0 * np.pi * np.arange(sides, dtype=np.int64)[:, None] / sides
    section = np.cos(roll) * outward[:, None] + np.sin(roll) * binormal[:, None]
    return net(middle[:, None] + wire * section, close_columns=True)


def thread(sides: int, turns: int = 6, pitch: float = 0.15) -> PolygonMesh:
    """Of a screw of radius 1: two flanks that wind about it. sides: a turn."""
    angle = np.linspace(0.0, 2.0 * np.pi * turns, sides * turns + 1)
    climb = pitch * angle / (2.0 * np.pi)
    rows = []
    for radius, rise in ((1.0, 0.0), (1.0 + pitch, 0.5 * pitch), (1.0, pitch)):
        rows.append(np.stack([radius * np.cos(angle), radius * np.sin(angle), climb + rise], axis=1))
    return net(np.stack(rows, axis=1))


def round_parts(sides: int) -> PolygonMesh:
    """A tube, a ring on it and a cone within, none of their vertices shared."""
    parts = [tube(sides, 0.5), placed(ring(sides, 0.6), at=(0, 0, 0.5)), placed(cone(sides, 0.4), scale=(0.3, 0.3, 1))]
    return joined(parts)


def _with_ends(side: PolygonMesh, sides: int, top: bool = False, bottom: bool = False) -> PolygonMesh:
    """n-gons over the first and the last ring of a lathed tube; they share its vertices."""
    around, rings = np.arange(sides, dtype=np.int64), len(side.vertices) // sides
    caps: list[Longs] = []
    if bottom:
        caps.append(around[::-1])
    if top:
        caps.append(around + (rings - 1) * sides)
    ends = of_faces(side.vertices, np.array(caps))
    return PolygonMesh(
        side.vertices,
        np.concatenate([side.triangles, ends.triangles]),
        np.concatenate([side.polygons, ends.polygons + side.polygons.max() + 1]).astype(np.int32),
    )
