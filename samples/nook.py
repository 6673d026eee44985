"""An alcove with columns, steps, a niche and an arch: hard surfaces, closed corners beside open ones."""

from __future__ import annotations

from typing import Any

import bpy
from mathutils import Matrix

from . import shapes, stage

BESIDE = Matrix(((0, 0, 1, 0), (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 0, 1)))  # the outline's x, y become the scene's y, z
UPRIGHT = Matrix(((1, 0, 0, 0), (0, 0, 1, 0), (0, 1, 0, 0), (0, 0, 0, 1)))  # … become x, z
DAIS = 0.48  # height of the top step


def build(scene: bpy.types.Scene) -> stage.Sample:
    """Fill an empty scene."""
    plaster, blue = stage.material("Plaster", (0.62, 0.5, 0.36)), stage.material("Blue plaster", (0.08, 0.3, 0.42))
    stone, clay = stage.material("Stone", (0.5, 0.46, 0.4)), stage.material("Clay", (0.65, 0.22, 0.1), 0.45)
    walls = stage.add(scene, "Walls", _walls(), plaster, blue)
    steps = stage.add(scene, "Steps", _steps(), stone)
    for thing in (walls, steps):
        stage.unwrap(scene, thing)
        stage.bevel(thing, 0.012)
    _columns(scene, stone)
    _cheeks(scene, stone)
    vase = shapes.lathe("Vase", VASE)
    stage.add(scene, "Vase", vase, clay, at=(-2.36, 0.1, 1.002))
    stage.add(scene, "Wide vase", vase, at=(1.75, -1.0, 0.703), scale=(1.5, 1.5, 1.1))
    ball = shapes.lathe("Ball", shapes.arc((0.0, 0.4), 0.4, -90.0, 90.0, 32))
    stage.add(
        scene, "Ball", ball, stage.material("Bronze", (0.5, 0.3, 0.12), 0.3, Metallic=1.0), at=(0.0, 2.5, DAIS + 0.002)
    )
    helper = stage.add(
        scene, "Person for scale", shapes.boxes("Person", ((-0.25, -0.15, 0.0), (0.25, 0.15, 1.75))), at=(0, -1, 0)
    )
    helper.hide_render = True
    stage.light(scene, sun=(2.6, -0.7, 2.6))
    stage.view(scene, position=(4.6, -6.4, 3.0), towards=(-0.2, 0.6, 1.25), lens=42.0)
    return stage.Sample(
        "nook", "An alcove behind columns, with steps, an arch and a niche.", ("Walls", "Steps", "Left column")
    )


def _walls() -> bpy.types.Mesh:
    """A back wall with an arch into an alcove, a side wall with a niche."""
    mesh = bpy.data.meshes.new("Walls")
    arch = [(0.75, DAIS - 0.04), *shapes.arc((0.0, 1.9), 0.75, 0.0, 180.0, 24), (-0.75, DAIS - 0.04)]
    niche = [(0.5, 1.0), *shapes.arc((0.1, 1.7), 0.4, 0.0, 180.0, 16), (-0.3, 1.0)]
    with shapes.solid(mesh) as draft:
        back = [(-2.5, -0.1), (2.5, -0.1), (2.5, 3.4), (-2.5, 3.4)]
        shapes.prism(draft, back, (0, 0.3, 0), Matrix.Translation((0, 1.9, 0)) @ UPRIGHT, holes=[arch])
        side = [(-2.5, -0.12), (1.95, -0.12), (1.95, 3.3), (-2.5, 3.3)]
        shapes.prism(draft, side, (0.35, 0, 0), Matrix.Translation((-2.55, 0, 0)) @ BESIDE, holes=[niche])
        shapes.box(draft, (-2.62, -0.5, 0.8), (-2.52, 0.7, 2.3), slot=1)
        around = [(-1.1, 2.1), (-0.9, 2.1), (-0.9, 3.2), (0.9, 3.2), (0.9, 2.1), (1.1, 2.1), (1.1, 3.4), (-1.1, 3.4)]
        shapes.prism(draft, around, (0, 0, 2.7), Matrix.Translation((0, 0, 0.1)), slot=1)
        shapes.box(draft, (-1.2, 2.12, 2.72), (1.2, 3.5, 2.9), slot=1)
    return mesh


def _steps() -> bpy.types.Mesh:
    mesh = bpy.data.meshes.new("Steps")
    edge = [(-2.6, -0.2), (-2.6, 0.0), (0.1, 0.0), (0.1, 0.16), (0.4, 0.16), (0.4, 0.32), (0.7, 0.32), (0.7, DAIS)]
    with shapes.solid(mesh) as draft:
        outline = [*edge, (3.3, DAIS), (3.3, -0.2)]
        shapes.prism(draft, outline, (5.3, 0, 0), Matrix.Translation((-2.65, 0, 0)) @ BESIDE)
    return mesh


def _columns(scene: bpy.types.Scene, stone: bpy.types.Material) -> None:
    """Two columns of one mesh with a lintel and its inscription, and the same mesh squat, as a pedestal."""
    column = shapes.lathe("Column", COLUMN)
    stage.add(scene, "Left column", column, stone, at=(-1.2, 1.25, DAIS + 0.112))
    stage.add(scene, "Right column", column, at=(1.2, 1.25, DAIS + 0.112))
    stage.add(scene, "Pedestal", column, at=(1.75, -1.0, 0.002), scale=(1.25, 1.25, 0.35))
    block = shapes.boxes("Block", ((-0.24, -0.24, 0.0), (0.24, 0.24, 0.11)))
    for x in (-1.2, 1.2):
        for z in (DAIS + 0.001, DAIS + 2.115):
            stage.bevel(stage.add(scene, "Block", block, at=(x, 1.25, z)), 0.015)
    block.materials.append(stone)
    beam = stage.add(
        scene,
        "Lintel",
        shapes.boxes("Lintel", ((-1.6, 1.0, 2.71), (1.6, 1.95, 3.02)), ((-1.7, 0.9, 3.021), (1.7, 1.96, 3.1))),
        stone,
    )
    stage.bevel(beam, 0.012)
    text: Any = bpy.data.curves.new("Inscription", "FONT")
    text.body, text.size, text.extrude, text.align_x = "OCCLUSION", 0.24, 0.015, "CENTER"
    text.space_character = 1.25
    stage.add(scene, "Inscription", text, stone, at=(0, 0.984, 2.78), turn=(90, 0, 0))


def _cheeks(scene: bpy.types.Scene, stone: bpy.types.Material) -> None:
    """Walls beside the steps; the right one is the left one mirrored."""
    mesh = bpy.data.meshes.new("Cheek")
    outline = [
        (-0.35, -0.05),
        (0.9, -0.05),
        (0.9, 0.78),
        (0.62, 0.78),
        *shapes.arc((-0.12, 0.74), 0.4, -20.0, -110.0),
        (-0.35, 0.36),
    ]
    with shapes.solid(mesh) as draft:
        shapes.prism(draft, outline, (0.26, 0, 0), BESIDE)
    for name, x, mirror in (("Left cheek", -1.95, 1.0), ("Right cheek", 1.95, -1.0)):
        stage.bevel(stage.add(scene, name, mesh, at=(x, 0.0, 0.0), scale=(mirror, 1.0, 1.0)), 0.02)
    mesh.materials.append(stone)


COLUMN = [
    (0.0, 0.0), (0.21, 0.0),
    *shapes.arc((0.2, 0.045), 0.04, -80.0, 80.0, 10),
    (0.17, 0.09), (0.17, 0.11), *shapes.arc((0.168, 0.135), 0.022, -80.0, 80.0, 6), (0.16, 0.17),
    (0.16, 0.6), (0.156, 1.0), (0.146, 1.4), (0.13, 1.78),
    *shapes.arc((0.132, 1.8), 0.016, -80.0, 80.0, 6), (0.13, 1.82), (0.13, 1.87),
    *shapes.arc((0.14, 1.95), 0.08, -70.0, 0.0, 8), (0.22, 2.0), (0.0, 2.0),
]  # fmt: skip
VASE = [
    (0.0, 0.0), (0.075, 0.0), (0.08, 0.01), (0.12, 0.08), (0.145, 0.17), (0.15, 0.25), (0.13, 0.34),
    (0.09, 0.41), (0.065, 0.46), (0.065, 0.5),
    (0.09, 0.55), (0.085, 0.555), (0.055, 0.5), (0.055, 0.46), (0.08, 0.4), (0.12, 0.33), (0.14, 0.25),
    (0.13, 0.16), (0.1, 0.07), (0.06, 0.02), (0.0, 0.018),
]  # fmt: skip
