"""Shading normals that disagree with the surface. Rays fill the hemisphere of the shading normal."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ....core.base.arrays import Doubles
from ....core.scene.scene import Mesh, Scene
from ..shapes import SKEW, box, grid, joined, plane, quad, scene, sphere
from .case import Case, View
from .faces import hollow_ball


def _with_normal(mesh: Mesh, normal: tuple[float, float, float]) -> Mesh:
    unit = np.asarray(normal) / np.linalg.norm(normal)
    return replace(mesh, normals=np.tile(unit.astype(np.float32), (len(mesh.triangles), 3, 1)))


def _negated(mesh: Mesh) -> Mesh:
    a, b, c = (mesh.vertices[mesh.triangles[:, corner]].astype(np.float64) for corner in range(3))
    across = np.cross(b - a, c - a)
    inward = -across / np.linalg.norm(across, axis=1, keepdims=True)
    return replace(mesh, normals=np.repeat(inward.astype(np.float32)[:, None], 3, axis=1))


def coarse_ball() -> Mesh:
    """A smooth sphere of twelve segments."""
    return sphere(segments=12)


def _tilt_loss(view: View) -> Doubles:
    """A point of a closed convex mesh loses what lies below its own triangle: A = (1 + n·g)/2."""
    shading = view.points[1]
    answer: Doubles = 0.5 + 0.5 * np.sum(shading * view.geometric, axis=-1)
    return answer


def _through_triangle(view: View) -> Doubles:
    return 1.0 - _tilt_loss(view)


ANGLES = (11.25, 22.5, 45.0, 80.0)


def _tilted_tiles(over: bool) -> Scene:
    """Four tiles, their shading normals tilted by each angle; over a wide floor, or alone."""
    tiles = []
    for i, degrees in enumerate(ANGLES):
        angle = np.radians(degrees)
        tile = quad((0.01 * i, 0, 0), (0.009, 0, 0), (0, 0.01, 0), (i / 4, 0, i / 4 + 0.25, 1), 0.04)
        tiles.append(_with_normal(tile, (np.sin(angle) * 0.6, np.sin(angle) * 0.8, np.cos(angle))))
    below = (plane(1e4, -1.0, "below"),) if over else ()
    return scene(joined(tiles, "tiles"), *below, under=SKEW)


def _over_floor(view: View) -> Doubles:
    angle = np.radians(np.array(ANGLES)[np.maximum(view.owner, 0) // 2])
    visible: Doubles = 0.5 + 0.5 * np.cos(angle)
    return visible


def _cancelling() -> Scene:
    """An open sheet whose corner normals are each other's opposites, zero, or not numbers."""
    sheet = grid(1.0, 6)
    normals = np.zeros((len(sheet.triangles), 3, 3), dtype=np.float32)
    normals[::4] = np.array([(1, 0, 0), (-1, 0, 0), (0, 0, 0)], dtype=np.float32)
    normals[1::4] = np.array([(0, 0, 1), (0, 0, -1), (0, 0, 1)], dtype=np.float32)
    normals[2::4] = np.nan
    return scene(replace(sheet, normals=normals), under=SKEW)


CASES = (
    Case(
        "smooth normals on a coarse mesh",
        "A smooth ball of 12 segments loses what lies below each triangle: (1 + n·g)/2, n the shading and g the "
        "geometric normal; 0.0096 at 11.25°.",
        "",
        lambda: scene(coarse_ball(), under=SKEW),
        expected=_tilt_loss,
        slack=1e-2,
        mean_slack=1e-3,
    ),
    Case(
        "smooth normals in a closed cavity",
        "0; but what lies below its own triangle a ray sees through it, as in Cycles: (1 - n·g)/2, 0.002 here.",
        "",
        lambda: scene(hollow_ball(smooth=True), under=SKEW),
        expected=_through_triangle,
        slack=8e-3,
        mean_slack=1e-4,
    ),
    Case(
        "tilted normals on an open sheet",
        "Shading normals tilted by 11.25° to 80° on sheets alone in space: 1, the sheet does not block itself.",
        "",
        lambda: _tilted_tiles(over=False),
        expected=lambda view: np.ones(view.covered.shape),
    ),
    Case(
        "tilted normals over a floor",
        "The same over a wide floor: (1 + cos δ)/2.",
        "",
        lambda: _tilted_tiles(over=True),
        expected=_over_floor,
        mean_slack=2e-4,
        slack=2e-4,
    ),
    Case(
        "custom normals pointing inwards",
        "A closed box with its shading normals turned in: all rays go in, 0.",
        "It turns a shading normal that points below its face round again: 1.",
        lambda: scene(_negated(box()), under=SKEW),
        expected=lambda view: np.zeros(view.covered.shape),
    ),
    Case(
        "inward normals on an open sheet",
        "The same on an open sheet: 1.",
        "",
        lambda: scene(_negated(grid(1.0, 3)), under=SKEW),
        expected=lambda view: np.ones(view.covered.shape),
    ),
    Case(
        "normals that cancel, or are no numbers",
        "On an open sheet: 1; where a normal cannot be made, the geometric one stands in.",
        "Blender replaces them when the mesh is made.",
        _cancelling,
        expected=lambda view: np.ones(view.covered.shape),
    ),
)
