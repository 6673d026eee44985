"""A figure with eyes in their sockets, and with clothes a centimetre off its skin: surfaces near to one another."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np

from . import shapes, stage
from .figure import EYE, EYEBALL, body
from .surface_nets import Doubles, Flags, Longs

SHIRT, TROUSERS, HAIR = 0.014, 0.007, 0.011  # metres off the skin at the least
FOLD = 0.004  # how much farther off at the most
Plane = tuple[stage.Triple, stage.Triple]  # a point of it, and the way out of what it cuts


def build(scene: bpy.types.Scene) -> stage.Sample:
    """Fill an empty scene."""
    points, quads = body()
    skin = _mesh("Body", points, quads)
    stage.add(scene, "Body", skin, stage.material("Skin", (0.75, 0.48, 0.36)))
    normals = np.empty((len(points), 3), dtype=np.float32)
    skin.vertices.foreach_get("normal", normals.reshape(-1))
    for name, colour, gap, planes in CLOTHES:
        cloth = _mesh(name, *_cut(points + _off(points, gap) * normals, quads, planes))
        stage.add(scene, name, cloth, stage.material(name, colour, 0.9))
    eyeball = shapes.lathe("Eyeball", shapes.arc((0.0, 0.0), EYEBALL, -90.0, 90.0, 32))
    eyeball.materials.append(stage.material("Eye", (0.9, 0.9, 0.88), 0.1))
    for name, side in (("Left eye", 1.0), ("Right eye", -1.0)):
        stage.add(scene, name, eyeball, at=(side * EYE[0], *EYE[1:]), turn=(90, 0, 0))
    stage.add(scene, "Floor", shapes.plane("Floor", 6.0, 6.0), stage.material("Plaster", (0.8, 0.77, 0.72)))
    stage.light(scene, sun=(-2.0, -3.0, 3.0))
    stage.view(scene, position=(0.9, -2.6, 1.2), towards=(0.0, 0.0, 0.62))
    return stage.Sample("character", "A figure with eyes, hair, a shirt and trousers, each an object.", ("Body",))


def _mesh(name: str, points: Doubles, quads: Longs) -> bpy.types.Mesh:
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points, [], quads)
    mesh.shade_smooth()
    return mesh


def _off(points: Doubles, gap: float) -> Doubles:
    """(N, 1): how far cloth is off the skin: with folds."""
    x, y, z = points.T
    waves = np.sin(55.0 * z + 8.0 * np.sin(21.0 * x)) * np.cos(34.0 * x + 17.0 * y)
    off: Doubles = gap + 0.5 * FOLD * (1.0 + waves)
    return off[:, None]


def _cut(points: Doubles, quads: Longs, planes: Sequence[Plane]) -> tuple[Doubles, Longs]:
    """What is on the inner side of all planes. Of a face that a plane cuts the outer corners come down to it: a hem
    without steps."""
    for at, out in planes:
        way = np.array(out) / np.linalg.norm(out)
        beyond = (points - at) @ way
        quads = quads[(beyond[quads] < 0.0).any(axis=1)]
        points = points - np.maximum(beyond, 0.0)[:, None] * way
    kept: Flags = np.zeros(len(points), dtype=bool)
    kept[quads] = True
    return points[kept], (np.cumsum(kept) - 1)[quads]


# The planes cut where nothing else of the figure is on their way. The shirt hangs over the trousers.
_UP, _DOWN = (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)
_SLEEVES: list[Plane] = [((side * 0.235, 0.015, 0.67), (side * 0.65, 0.1, -0.75)) for side in (-1.0, 1.0)]
_HANDS: list[Plane] = [((side * 0.21, 0.0, 0.0), (side, 0.0, 0.0)) for side in (-1.0, 1.0)]
CLOTHES: tuple[tuple[str, stage.Triple, float, list[Plane]], ...] = (
    ("Shirt", (0.1, 0.25, 0.5), SHIRT, [((0.0, 0.0, 0.552), _DOWN), ((0.0, 0.0, 0.873), _UP), *_SLEEVES]),
    ("Trousers", (0.16, 0.14, 0.12), TROUSERS, [((0.0, 0.0, 0.6), _UP), ((0.0, 0.0, 0.24), _DOWN), *_HANDS]),
    ("Hair", (0.12, 0.06, 0.03), HAIR, [((0.0, 0.0, 1.085), (0.0, -0.75, -0.66)), ((0.0, 0.0, 0.96), _DOWN)]),
)
