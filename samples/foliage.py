"""A plant in a pot: hundreds of open, two-sided leaves in one mesh."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

from . import shapes, stage

STEMS, PER_STEM = 13, 36
CELLS = 22  # leaves along an edge of the texture
Doubles = NDArray[np.float64]


def build(scene: bpy.types.Scene) -> stage.Sample:
    """Fill an empty scene."""
    clay, soil = stage.material("Terracotta", (0.6, 0.2, 0.09), 0.75), stage.material("Soil", (0.05, 0.03, 0.02), 1.0)
    stage.add(scene, "Ground", shapes.plane("Ground", 8.0, 8.0), stage.material("Stone", (0.6, 0.57, 0.52)))
    stage.add(scene, "Pot", shapes.lathe("Pot", POT), clay, at=(0, 0, 0.021))
    stage.add(scene, "Saucer", shapes.lathe("Saucer", SAUCER), clay, at=(0, 0, 0.001))
    stage.add(scene, "Soil", shapes.lathe("Soil", [(0.165, 0.24), (0.1, 0.262), (0.0, 0.27)]), soil)
    stems = _stems()
    lines = [[tuple(point) for point in stem] for stem in stems.tolist()]
    stage.add(scene, "Stems", stage.tube("Stems", lines, 0.006), stage.material("Bark", (0.16, 0.12, 0.05), 0.8))
    stage.add(scene, "Leaves", _leaves(stems), stage.material("Leaf", (0.1, 0.26, 0.045), 0.4))
    stage.light(scene, sun=(-2.0, -1.2, 3.2))
    stage.view(scene, position=(0.4, -2.1, 1.75), towards=(0.05, 0.0, 0.4), lens=44.0)
    return stage.Sample(
        "foliage", f"A potted plant with {STEMS * PER_STEM} open, curved leaves.", ("Leaves", "Pot", "Ground")
    )


def _stems() -> Doubles:
    """(STEMS, points, 3): arches from the soil outwards, the inner ones steep and tall."""
    rng = np.random.default_rng(5)
    turn = 2.39996 * np.arange(STEMS, dtype=np.int64) + rng.normal(
        0.0, 0.15, STEMS
    )  # the golden angle spreads them evenly
    spread = np.sqrt((np.arange(STEMS, dtype=np.int64) + 0.5) / STEMS)
    t = np.linspace(0.0, 1.0, 25)
    out = 0.09 * spread[:, None] + (0.12 + 0.4 * spread[:, None]) * t**1.5
    rise = 0.25 + (0.78 - 0.3 * spread[:, None]) * (t - 0.35 * spread[:, None] * t**3)
    return np.stack([out * np.cos(turn)[:, None], out * np.sin(turn)[:, None], rise + 0.0 * out], axis=-1)


def _leaves(stems: Doubles) -> bpy.types.Mesh:
    """Leaves around the upper part of each stem, turned by the golden angle from one to the next."""
    rng = np.random.default_rng(11)
    t = np.tile(np.linspace(0.25, 1.0, PER_STEM), STEMS)
    stem = np.repeat(np.arange(STEMS, dtype=np.int64), PER_STEM)
    place = t * (stems.shape[1] - 1)
    low = np.minimum(place.astype(int), stems.shape[1] - 2)
    start, step = stems[stem, low], stems[stem, low + 1] - stems[stem, low]
    root = start + (place - low)[:, None] * step
    up = _unit(step)
    side = _unit(np.cross(up, (0.3, 0.5, 0.2)))
    angle = 2.39996 * np.arange(len(t), dtype=np.int64) + rng.normal(0.0, 0.2, len(t))
    out = np.cos(angle)[:, None] * side + np.sin(angle)[:, None] * np.cross(up, side)
    forward = _unit(out + (0.25 + 1.0 * t[:, None] ** 6) * up + (0.0, 0.0, 0.25))
    length = rng.uniform(0.1, 0.15, len(t)) * (1.15 - 0.4 * t)
    return _mesh(root, forward, length, rng.uniform(0.1, 0.5, len(t)))


def _mesh(root: Doubles, forward: Doubles, length: Doubles, droop: Doubles) -> bpy.types.Mesh:
    """One sheet per leaf: a pointed outline, folded along its middle and drooping to the tip."""
    s, across = np.linspace(0.0, 1.0, 10), np.linspace(-1.0, 1.0, 5)
    outline = 0.02 + 0.98 * np.sin(np.pi * s**0.8) ** 0.9  # never 0: no face without area
    left = _unit(np.cross((0.0, 0.0, 1.0), forward))
    upward = np.cross(forward, left)
    width = 0.22 * across[:, None] * outline
    fold = 0.35 * np.abs(width) - 0.4 * width**2
    local = np.stack(np.broadcast_arrays(s[None, None], width[None], fold[None] - droop[:, None, None] * s**2), axis=-1)
    basis = np.stack([forward, left, upward], axis=1)
    points = root[:, None, None] + length[:, None, None, None] * np.einsum("nrci,nij->nrcj", local, basis)
    mesh = shapes.sheet("Leaves", points)
    _lay_out(mesh, outline, across, len(points))
    return mesh


def _lay_out(mesh: bpy.types.Mesh, outline: Doubles, across: Doubles, count: int) -> None:
    """Each leaf's outline in a cell of its own."""
    corners = np.empty(len(mesh.loops), dtype=np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    u = np.broadcast_to(np.linspace(0.0, 1.0, len(outline)), (len(across), len(outline)))
    v = 0.5 + 0.5 * across[:, None] * outline
    flat = np.stack([u, v], axis=-1).reshape(1, -1, 2) * 0.94 + 0.03
    cell = np.stack(np.divmod(np.arange(count, dtype=np.int64), CELLS), axis=-1)[:, None]
    mesh.uv_layers.remove(mesh.uv_layers[0])
    shapes.set_uv(mesh, ((flat + cell) / CELLS).reshape(-1, 2)[corners])


def _unit(vectors: Doubles) -> Doubles:
    unit: Doubles = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return unit


POT = [
    (0.0, 0.0), (0.125, 0.0), (0.13, 0.005), (0.168, 0.22), (0.19, 0.222), (0.194, 0.226), (0.2, 0.275),
    (0.196, 0.28), (0.182, 0.28), (0.178, 0.276),
    (0.165, 0.22), (0.12, 0.02), (0.0, 0.018),
]  # fmt: skip
SAUCER = [
    (0.0, 0.0),
    (0.15, 0.0),
    (0.155, 0.003),
    (0.2, 0.035),
    (0.198, 0.04),
    (0.194, 0.04),
    (0.15, 0.014),
    (0.145, 0.012),
    (0.0, 0.012),
]
