"""A dry stream bed: thousands of pebbles by geometry nodes, cairns by collection instances."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from . import shapes, stage

PEBBLES = 7000
EDGE = 6.0  # metres of terrain


def build(scene: bpy.types.Scene) -> stage.Sample:
    """Fill an empty scene."""
    stone = _stone()
    kinds = bpy.data.collections.new("Pebble kinds")
    for seed in range(4):
        mesh = shapes.pebble(f"Pebble {seed}", seed)
        mesh.materials.append(stone)
        kinds.objects.link(bpy.data.objects.new(mesh.name, mesh))
    stage.add(scene, "Terrain", _terrain(), stage.material("Sand", (0.42, 0.3, 0.19), 0.9))
    pebbles = stage.add(scene, "Pebbles", _places())
    scatter: Any = pebbles.modifiers.new("Scatter", "NODES")
    scatter.node_group = _scatter(kinds)
    _cairns(scene, kinds)
    stage.light(scene, sun=(3.0, 1.5, 2.4))
    stage.view(scene, position=(0.4, -4.1, 2.5), towards=(0.0, -0.65, 0.05), lens=40.0)
    return stage.Sample("thousands", f"A dry stream bed under {PEBBLES} pebbles, with a few cairns.", ("Terrain",))


def _height(x: Any, y: Any) -> Any:
    """Terrain height in metres, of places as they come: a winding bed between banks, with ripples."""
    off = x - 0.7 * np.sin(1.1 * y + 0.4)
    bank = 0.9 * (1.0 - np.exp(-((off / 1.5) ** 2)))
    ripples = 0.05 * np.sin(3.1 * x + 1.7 * y) + 0.03 * np.sin(5.3 * y - 2.1 * x + 1.0)
    return bank + ripples + 0.012 * np.sin(13.0 * x + 4.0 * np.sin(3.0 * y)) * np.sin(11.0 * y)


def _terrain() -> bpy.types.Mesh:
    side = np.linspace(-EDGE / 2, EDGE / 2, 161)
    x, y = np.meshgrid(side, side)
    return shapes.sheet("Terrain", np.stack([x, y, _height(x, y)], axis=-1))


def _places() -> bpy.types.Mesh:
    """A point per pebble with its rotation and scale; more and larger ones along the bed, a tenth of them mirrored."""
    rng = np.random.default_rng(7)
    x, y = rng.uniform(-EDGE / 2, EDGE / 2, size=(2, 8 * PEBBLES)) * 0.98
    kept = rng.uniform(size=len(x)) < 0.12 + 0.88 * np.exp(-4.0 * _height(x, y))
    x, y = x[kept][:PEBBLES], y[kept][:PEBBLES]
    radius = np.clip(0.028 * rng.lognormal(0.0, 0.5, size=PEBBLES), 0.008, 0.14)
    scale = radius[:, None] * rng.uniform((0.9, 0.7, 0.45), (1.3, 1.0, 0.75), size=(PEBBLES, 3))
    scale[::10, 0] *= -1.0
    z = _height(x, y) + scale[:, 2] * rng.uniform(0.1, 0.5, size=PEBBLES)
    mesh = bpy.data.meshes.new("Pebble places")
    mesh.from_pydata(np.stack([x, y, z], axis=1), [], [])
    turn = rng.normal(0.0, (0.3, 0.3, 3.0), size=(PEBBLES, 3))
    for name, values in (("turn", turn), ("size", scale)):
        attribute: Any = mesh.attributes.new(name, "FLOAT_VECTOR", "POINT")
        attribute.data.foreach_set("vector", values.ravel().astype(np.float32))
    return mesh


def _scatter(kinds: bpy.types.Collection) -> Any:
    """Nodes that put one of `kinds` on each point, by the point's attributes."""
    tree: Any = bpy.data.node_groups.new("Scatter", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    points, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    shape, put = tree.nodes.new("GeometryNodeCollectionInfo"), tree.nodes.new("GeometryNodeInstanceOnPoints")
    shape.inputs["Collection"].default_value = kinds
    shape.inputs["Separate Children"].default_value = True
    put.inputs["Pick Instance"].default_value = True
    tree.links.new(points.outputs[0], put.inputs["Points"])
    tree.links.new(shape.outputs[0], put.inputs["Instance"])
    for attribute, socket in (("turn", "Rotation"), ("size", "Scale")):
        read = tree.nodes.new("GeometryNodeInputNamedAttribute")
        read.data_type = "FLOAT_VECTOR"
        read.inputs["Name"].default_value = attribute
        tree.links.new(read.outputs["Attribute"], put.inputs[socket])
    tree.links.new(put.outputs[0], end.inputs[0])
    return tree


def _cairns(scene: bpy.types.Scene, kinds: bpy.types.Collection) -> None:
    """A pile of stones as a collection, placed a few times: turned, stretched, mirrored."""
    cairn = bpy.data.collections.new("Cairn")
    height = 0.0
    for level, radius in enumerate((0.3, 0.25, 0.19, 0.15, 0.1, 0.07)):
        kind = kinds.objects[level % len(kinds.objects)]
        stone = bpy.data.objects.new(f"Cairn stone {level}", kind.data)
        thick = 0.42 * radius
        stone.location = (0.04 * np.sin(2.3 * level), 0.03 * np.cos(3.1 * level), height + 0.72 * thick)
        stone.scale, stone.rotation_euler = (radius, 0.85 * radius, thick), (0.0, 0.0, 1.9 * level)
        height += 1.42 * thick
        cairn.objects.link(stone)
    places = (((-0.75, -1.2), (1, 1, 1.1)), ((0.95, -0.35), (-0.8, 0.8, 0.9)), ((-0.5, 0.75), (0.9, 0.9, 1.2)))
    for number, ((x, y), scale) in enumerate(places):
        z = float(_height(np.float64(x), np.float64(y))) + 0.02
        empty = stage.add(scene, f"Cairn {number}", None, at=(x, y, z), turn=(0, 0, 75 * number), scale=scale)
        empty.instance_type, empty.instance_collection = "COLLECTION", cairn


def _stone() -> bpy.types.Material:
    """Stone whose colour differs from pebble to pebble."""
    stone = stage.material("Stone", (0.4, 0.38, 0.35), 0.7)
    tree: Any = stone.node_tree
    chance, ramp = tree.nodes.new("ShaderNodeObjectInfo"), tree.nodes.new("ShaderNodeValToRGB")
    colours = ((0.05, 0.055, 0.07), (0.3, 0.27, 0.23), (0.34, 0.15, 0.09), (0.42, 0.41, 0.38), (0.66, 0.6, 0.5))
    ends = ramp.color_ramp.elements
    for place, colour in enumerate(colours):
        stop = ends[0] if place == 0 else ends.new(place / len(colours))
        stop.color = (*colour, 1.0)
    ends.remove(ends[-1])
    tree.links.new(chance.outputs["Random"], ramp.inputs[0])
    tree.links.new(ramp.outputs[0], tree.nodes["Principled BSDF"].inputs["Base Color"])
    return stone
