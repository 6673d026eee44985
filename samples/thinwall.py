"""A desk by a window: paper, card, china and blinds a millimetre or two thick, before a wall of metres."""

from __future__ import annotations

from typing import Any

import bmesh
import bpy
import numpy as np
from mathutils import Matrix, Vector

from . import shapes, stage

SLATS = 30
CLEAR = 0.0006  # metres between things that stand on each other
CARD = 0.002


def build(scene: bpy.types.Scene) -> stage.Sample:
    """Fill an empty scene."""
    china, paper = stage.material("China", (0.12, 0.32, 0.4), 0.25), stage.material("Paper", (0.85, 0.83, 0.78), 0.9)
    table = stage.add(
        scene,
        "Table",
        shapes.boxes("Table", ((-0.9, -0.55, -0.04), (0.9, 0.5, 0.0))),
        stage.material("Wood", (0.4, 0.2, 0.09), 0.5),
    )
    stage.unwrap(scene, table)
    carton = stage.add(
        scene,
        "Box",
        _carton(),
        stage.material("Card", (0.55, 0.36, 0.19), 0.9),
        at=(-0.3, 0.08, CLEAR),
        turn=(0, 0, 24),
    )
    stage.unwrap(scene, carton)
    stage.add(scene, "Leaflet", _leaflet(), paper, at=(0.12, 0.12, CLEAR), turn=(0, 0, -12))
    stage.add(scene, "Letter", _letter(), paper, at=(0.02, -0.24, CLEAR), turn=(0, 0, 20))
    cup = shapes.lathe("Cup", CUP)
    handle = stage.tube("Handle", [_handle()], 0.005)
    for name, at, turn in (("Cup", (0.36, -0.1, CLEAR), -40.0), ("Far cup", (0.5, 0.12, CLEAR), 60.0)):
        stage.add(scene, name, cup, at=at, turn=(0, 0, turn))
        stage.add(scene, f"{name} handle", handle, at=at, turn=(0, 0, turn))
    cup.materials.append(china)
    handle.materials.append(china)
    _window(scene)
    stage.light(scene, sun=(0.8, 2.0, 1.6), strength=6.0, sky=0.6, blur=0.7)
    stage.view(scene, position=(0.3, -1.15, 0.62), towards=(0.05, 0.0, 0.1), lens=46.0)
    targets = ("Table", "Box", "Leaflet", "Letter", "Cup", "Blinds")
    return stage.Sample(
        "thinwall", "A desk by a window: folded paper, a card box, cups and blinds, all paper-thin.", targets
    )


def _carton() -> bpy.types.Mesh:
    """An open box of card with its four flaps folded out."""
    mesh = bpy.data.meshes.new("Box")
    x, y, z = 0.15, 0.11, 0.15
    rim = [(-x, -y), (x, -y), (x, y), (-x, y)]
    with shapes.solid(mesh) as draft:
        low = [draft.verts.new((*corner, 0.0)) for corner in rim]
        high = [draft.verts.new((*corner, z)) for corner in rim]
        draft.faces.new(low[::-1])
        for side, (reach, drop) in enumerate(((0.08, -0.055), (0.085, 0.03), (0.07, 0.05), (0.085, -0.02))):
            there = (side + 1) % 4
            draft.faces.new((low[side], low[there], high[there], high[side]))
            out = Vector([(0, -1, 0), (1, 0, 0), (0, 1, 0), (-1, 0, 0)][side])
            hinge = [high[end].co + 1.3 * CARD * out for end in (side, there)]
            tip = [corner + reach * out + Vector((0.0, 0.0, drop)) for corner in hinge[::-1]]
            draft.faces.new([draft.verts.new(corner) for corner in (*hinge, *tip)])
        draft.normal_update()
        bmesh.ops.solidify(draft, geom=draft.faces[:], thickness=CARD)
    return mesh


def _leaflet() -> bpy.types.Mesh:
    """One sheet in six panels, folded to and fro and standing on edge."""
    x = np.arange(7, dtype=np.int64) * 0.055
    y = np.where(np.arange(7, dtype=np.int64) % 2, 0.04, -0.04)
    bottom, top = np.stack([x, y, 0.0 * x], axis=-1), np.stack([x, y, 0.0 * x + 0.21], axis=-1)
    return shapes.sheet("Leaflet", np.stack([bottom, top]), smooth=False)


def _letter() -> bpy.types.Mesh:
    """A sheet that still remembers being folded in three."""
    x, y = np.meshgrid(np.linspace(-0.105, 0.105, 13), np.linspace(-0.1485, 0.1485, 49))
    lift = 0.05 * np.clip((np.abs(y) - 0.05) / 0.1, 0.0, 1.0) ** 1.4 * np.where(y > 0, 1.0, 0.55)
    return shapes.sheet(
        "Letter", np.stack([x, y * (1 - 0.4 * lift / 0.05 * np.abs(y)), lift + 0.002 * (x / 0.1) ** 2], axis=-1)
    )


def _handle() -> list[tuple[float, float, float]]:
    return [(0.036 + 0.8 * x, 0.0, z) for x, z in shapes.arc((0.0, 0.047), 0.028, -80.0, 80.0, 16)]


def _window(scene: bpy.types.Scene) -> None:
    """A wall with a window, blinds of one slat and an array, a card that throws light and no shadow."""
    mesh = bpy.data.meshes.new("Wall")
    outline = [(-1.6, -0.9), (1.6, -0.9), (1.6, 1.7), (-1.6, 1.7)]
    opening = [(-0.7, 0.1), (0.7, 0.1), (0.7, 1.1), (-0.7, 1.1)]
    with shapes.solid(mesh) as draft:
        upright = Matrix(((1, 0, 0, 0), (0, 0, 1, 0.55), (0, 1, 0, 0), (0, 0, 0, 1)))
        shapes.prism(draft, outline, (0.0, 0.16, 0.0), upright, holes=[opening])
    stage.add(scene, "Wall", mesh, stage.material("Plaster", (0.72, 0.66, 0.56)))
    card = stage.add(scene, "Bounce card", shapes.plane("Bounce card", 2.0, 1.0), at=(0, -0.5, 1.3), turn=(-25, 0, 0))
    card.visible_shadow = False
    slat = stage.add(scene, "Blinds", _slat(), stage.material("Enamel", (0.8, 0.76, 0.68), 0.4), at=(0, 0.6, 0.115))
    blinds: Any = slat.modifiers.new("Array", "ARRAY")
    blinds.count, blinds.use_relative_offset, blinds.use_constant_offset = SLATS, False, True
    blinds.constant_offset_displace, blinds.offset_v = (0.0, 0.0, 0.0325), 1.0 / SLATS


def _slat() -> bpy.types.Mesh:
    """A bowed slat a millimetre thick, its UVs in the lowest of SLATS strips."""
    across = np.linspace(-1.0, 1.0, 7)
    bow = np.stack([0.0175 * across, 0.003 * (1.0 - across**2)], axis=-1)
    ring = np.concatenate([bow, bow[::-1] - (0.0, 0.001)])
    tilt = np.radians(8.0)
    turn = np.array([(np.cos(tilt), np.sin(tilt)), (-np.sin(tilt), np.cos(tilt))])
    y, z = (ring @ turn).T
    net = np.array([[(x, y[i], z[i]) for x in (-0.69, 0.69)] for i in range(len(ring))])
    mesh = shapes.sheet("Slat", net, closed=True)
    uv = np.empty(2 * len(mesh.loops), dtype=np.float32)
    mesh.uv_layers[0].uv.foreach_get("vector", uv)
    uv[1::2] = (0.1 + 0.8 * uv[1::2]) / SLATS
    mesh.uv_layers[0].uv.foreach_set("vector", uv)
    mesh.set_sharp_from_angle(angle=np.radians(40.0))
    return mesh


CUP = [
    (0.0, 0.0), (0.026, 0.0), (0.029, 0.002), (0.034, 0.012), (0.0385, 0.035), (0.041, 0.07), (0.042, 0.086),
    (0.0414, 0.0872), (0.0402, 0.0872),
    (0.0396, 0.086), (0.0386, 0.07), (0.0361, 0.035), (0.0318, 0.0135), (0.027, 0.006), (0.022, 0.004), (0.0, 0.0036),
]  # fmt: skip
