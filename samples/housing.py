"""A machine's housing, high with bevels, bolts and grooves, and low without them: what is baked from high to low."""

from __future__ import annotations

from itertools import pairwise
from math import radians
from typing import TYPE_CHECKING

import bmesh
import bpy
import numpy as np
from mathutils import Matrix, Vector

from . import shapes, stage

if TYPE_CHECKING:  # there is none before bpy
    from bmesh.types import BMesh

LOW, HIGH = "Housing_low", "Housing_high"
CLEAR = 0.0005  # metres between the housing and the ground
DEPTH = 0.7  # metres, along y
SUNK = 0.004  # how deep what is put on a face stands in it
BORE, BORE_AT = 0.13, (0.0, 0.3)
_UPRIGHT = Matrix(((1, 0, 0, 0), (0, 0, 1, 0), (0, 1, 0, 0), (0, 0, 0, 1)))  # the outline's x, y become x, z
_OUTLINE: list[shapes.Pair] = [
    (-0.6, 0.0), (0.6, 0.0), (0.6, 0.12), (0.35, 0.12), (0.35, 0.42), (0.2, 0.55),
    (-0.2, 0.55), (-0.35, 0.42), (-0.35, 0.12), (-0.6, 0.12),
]  # fmt: skip
_GROOVES = (0.2, 0.27, 0.34)  # heights on both sides
_GROOVE = (0.022, 0.012)  # width and depth


def build(scene: bpy.types.Scene) -> stage.Sample:
    """Fill an empty scene."""
    steel = stage.material("Steel", (0.35, 0.36, 0.38), 0.4, Metallic=1.0)
    low = stage.add(scene, LOW, _shaded(_low()), steel)
    stage.unwrap(scene, low)
    high = stage.add(scene, HIGH, _shaded(_high()), steel)
    stage.bevel(high, 0.008)
    concrete = stage.material("Concrete", (0.5, 0.5, 0.48))
    stage.add(scene, "Ground", shapes.plane("Ground", 8.0, 8.0), concrete, at=(0, 0, -CLEAR))
    stage.light(scene, sun=(-2.0, -2.5, 3.0))
    stage.view(scene, position=(1.3, -2.0, 1.3), towards=(0.0, 0.0, 0.22))
    return stage.Sample("bevel_low", "A housing with bevels, bolts and grooves onto a low one.", (LOW,), highs=(HIGH,))


def _shaded(mesh: bpy.types.Mesh) -> bpy.types.Mesh:
    """Smooth, its sharp edges marked."""
    mesh.shade_smooth()
    mesh.set_sharp_from_angle(angle=radians(30.0))
    return mesh


def _low() -> bpy.types.Mesh:
    mesh = bpy.data.meshes.new(LOW)
    with shapes.solid(mesh) as draft:
        _body(draft, _OUTLINE, 16)
    return mesh


def _high() -> bpy.types.Mesh:
    mesh = bpy.data.meshes.new(HIGH)
    with shapes.solid(mesh) as draft:
        _body(draft, _with_grooves(), 96)
        for y, out in ((0.0, -1.0), (DEPTH, 1.0)):
            _rim(draft, y - 0.5 * DEPTH, out)
        for x in (-0.5, 0.5):
            for y in (-0.24, 0.0, 0.24):
                _bolt(draft, (x, y, 0.12))
        shapes.box(draft, (-0.14, -0.27, 0.55 - SUNK), (0.14, 0.27, 0.561))
        _rivets(draft)
    return mesh


def _body(draft: BMesh, outline: list[shapes.Pair], around: int) -> None:
    """All but its underside, which nobody sees."""
    place = Matrix.Translation((0.0, -0.5 * DEPTH, 0.0)) @ _UPRIGHT
    shapes.prism(draft, outline, (0.0, DEPTH, 0.0), place, holes=[_circle(BORE, around)])
    below = [face for face in draft.faces if all(vertex.co.z == 0.0 for vertex in face.verts)]
    bmesh.ops.delete(draft, geom=below, context="FACES_ONLY")


def _with_grooves() -> list[shapes.Pair]:
    """The outline, both of its upright sides cut in."""
    width, deep = _GROOVE
    right = [(0.35 - deep * inward, z + end) for z in _GROOVES for inward, end in _notch(width)]
    left = [(-x, z) for x, z in reversed(right)]
    return [*_OUTLINE[:4], *right, *_OUTLINE[4:8], *left, *_OUTLINE[8:]]


def _notch(width: float) -> list[tuple[float, float]]:
    return [(0.0, 0.0), (1.0, 0.2 * width), (1.0, 0.8 * width), (0.0, width)]


def _circle(radius: float, corners: int) -> list[shapes.Pair]:
    return shapes.arc(BORE_AT, radius, 0.0, 360.0, corners)[:-1]


def _rim(draft: BMesh, y: float, out: float) -> None:
    """A ring about the bore that stands off the face at y."""
    place = Matrix.Translation((0.0, y - out * SUNK, 0.0)) @ _UPRIGHT
    shapes.prism(draft, _circle(0.175, 96), (0.0, out * 0.012, 0.0), place, holes=[_circle(BORE + 0.012, 96)])


def _bolt(draft: BMesh, foot: stage.Triple) -> None:
    """A washer and a hexagon on it."""
    for radius, corners, rise in ((0.045, 32, 0.004), (0.03, 6, 0.011)):
        outline = shapes.arc((0.0, 0.0), radius, 0.0, 360.0, corners)[:-1]
        place = Matrix.Translation(Vector(foot) - Vector((0.0, 0.0, SUNK)))
        shapes.prism(draft, outline, (0.0, 0.0, rise + SUNK), place)


def _rivets(draft: BMesh) -> None:
    """Balls in rows along the slopes, half of each in them."""
    middle, slope = np.array((0.275, 0.0, 0.485)), np.array((-0.15, 0.0, 0.13))
    for share in (-0.3, 0.3):
        for y in np.linspace(-0.29, 0.29, 12):
            x, _, z = middle + share * slope
            for side in (-1.0, 1.0):
                _ball(draft, (side * float(x), float(y), float(z)), 0.011)


def _ball(draft: BMesh, middle: stage.Triple, radius: float, rings: int = 16, around: int = 24) -> None:
    """Of rings of quads; bmesh's own operator looks for doubles in the whole mesh, each time."""
    across, up = np.meshgrid(
        2.0 * np.pi * np.arange(around, dtype=np.int64) / around,
        np.pi * (np.arange(1, rings, dtype=np.int64) / rings - 0.5),
    )
    points = np.stack([np.cos(up) * np.cos(across), np.cos(up) * np.sin(across), np.sin(up)], axis=-1)
    net = [[draft.verts.new(middle + radius * point) for point in ring] for ring in points]
    poles = [draft.verts.new((*middle[:2], middle[2] + end * radius)) for end in (-1.0, 1.0)]
    for here in range(around):
        there = (here + 1) % around
        draft.faces.new((poles[0], net[0][there], net[0][here]))
        draft.faces.new((net[-1][here], net[-1][there], poles[1]))
        for low, high in pairwise(net):
            draft.faces.new((low[here], low[there], high[there], high[here]))
