"""Hundreds of props on a ground, stones, pots and crates of some kinds, each with a texture of its own."""

from __future__ import annotations

import bpy
import numpy as np

from . import shapes, stage

SIDE, SPACING = 20, 0.55  # props along a side of the ground, and metres from one to the next
STONES, POTS, CRATES = 6, 8, 6  # kinds
CLEAR = 0.0005  # metres between a prop and the ground
SIZE = 128  # texels a side of each texture


def build(scene: bpy.types.Scene) -> stage.Sample:
    """Fill an empty scene."""
    rng = np.random.default_rng(23)
    ground = 1.5 * SIDE * SPACING
    stage.add(scene, "Ground", shapes.plane("Ground", ground, ground), stage.material("Sand", (0.5, 0.42, 0.3), 0.9))
    kinds = _kinds(scene)
    names = []
    for number in range(SIDE * SIDE):
        mesh = kinds[int(rng.integers(len(kinds)))]
        row, column = divmod(number, SIDE)
        x, y = SPACING * (np.array((column, row)) - 0.5 * (SIDE - 1) + rng.uniform(-0.12, 0.12, 2))
        size, turn = float(rng.uniform(0.6, 1.1)), float(rng.uniform(0.0, 360.0))
        at = (float(x), float(y), CLEAR - size * _foot(mesh))
        name = f"Prop {number:03}"
        prop = stage.add(scene, name, mesh, at=at, turn=(0, 0, turn), scale=(size, size, size))
        if mesh.name.startswith("Crate"):
            stage.bevel(prop, 0.006)
        names.append(name)
    stage.light(scene, sun=(3.0, 1.5, 2.4))
    stage.view(scene, position=(3.0, -7.0, 4.5), towards=(0.0, -0.8, 0.0), lens=35.0)
    description = f"{len(names)} props of {len(kinds)} kinds on a ground, each its own texture."
    return stage.Sample("props", description, tuple(names), SIZE)


def _kinds(scene: bpy.types.Scene) -> list[bpy.types.Mesh]:
    """Meshes with UVs."""
    rng = np.random.default_rng(4)
    stone, clay = stage.material("Stone", (0.4, 0.38, 0.35), 0.7), stage.material("Clay", (0.6, 0.25, 0.12), 0.6)
    wood = stage.material("Wood", (0.4, 0.24, 0.12), 0.7)
    stones = [_unwrapped(scene, _stone(number), stone) for number in range(STONES)]
    pots = [_pot(f"Pot {number}", rng) for number in range(POTS)]
    for pot in pots:
        pot.materials.append(clay)
    return [*stones, *pots, *(_unwrapped(scene, _crate(f"Crate {n}", rng), wood) for n in range(CRATES))]


def _unwrapped(scene: bpy.types.Scene, mesh: bpy.types.Mesh, material: bpy.types.Material) -> bpy.types.Mesh:
    thing = stage.add(scene, mesh.name, mesh, material)
    stage.unwrap(scene, thing, margin=0.02)
    bpy.data.objects.remove(thing)
    return mesh


def _stone(seed: int) -> bpy.types.Mesh:
    mesh = shapes.pebble(f"Stone {seed}", 40 + seed)
    points = np.array([vertex.co for vertex in mesh.vertices]) * (0.16, 0.13, 0.1)
    mesh.vertices.foreach_set("co", points.astype(np.float32).ravel())
    return mesh


def _pot(name: str, rng: np.random.Generator) -> bpy.types.Mesh:
    """Turned, hollow, with a belly and a neck."""
    height = np.linspace(0.0, 1.0, 14)
    belly, neck, tall = rng.uniform(0.09, 0.16), rng.uniform(0.04, 0.08), rng.uniform(0.2, 0.38)
    outer = neck + (belly - neck) * np.sin(np.pi * np.clip(height, 0.08, 1.0) ** rng.uniform(0.6, 1.1)) ** 0.8
    wall = [(float(radius), float(tall * share)) for radius, share in zip(outer, height, strict=True)]
    rim = [(wall[-1][0] - 0.006, wall[-1][1] + 0.003)]
    inside = [(radius - 0.012, z) for radius, z in reversed(wall[1:])]
    return shapes.lathe(name, [(0.0, 0.0), *wall, *rim, *inside, (0.0, inside[-1][1])], segments=32)


def _crate(name: str, rng: np.random.Generator) -> bpy.types.Mesh:
    """A box of planks, some gaps between them."""
    x, y, z = rng.uniform((0.14, 0.12, 0.1), (0.19, 0.16, 0.2))
    count = int(rng.integers(2, 5))
    pitch, thick = z / count, 0.012
    corners: list[tuple[stage.Triple, stage.Triple]] = [((-x, -y, 0.0), (x, y, thick))]
    for level in range(count):
        low, high = thick + 0.004 + level * pitch, thick + (level + 1) * pitch
        corners += [((-x, side * y - thick / 2, low), (x, side * y + thick / 2, high)) for side in (-1.0, 1.0)]
        ends = y - thick / 2 - 0.002
        corners += [((side * x - thick, -ends, low), (side * x, ends, high)) for side in (-0.9, 0.9)]
    return shapes.boxes(name, *corners)


def _foot(mesh: bpy.types.Mesh) -> float:
    """Its lowest height."""
    return min(vertex.co.z for vertex in mesh.vertices)
