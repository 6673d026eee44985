"""Leaves and fences: what materials cut out of an occluder lets light through, as in Cycles."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.core.bake import bake  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402
from occlusion_bake.tests.oracles.settings import flat_settings  # noqa: E402

pytestmark = pytest.mark.usefixtures("empty_scene")


def cut_material(name: str, values: np.ndarray) -> Any:
    """An image's alpha into the Principled BSDF's."""
    image = bpy.data.images.new(name, *values.shape[::-1], alpha=True)
    pixels = np.ones((*values.shape, 4), dtype=np.float32)
    pixels[..., 3] = values
    image.pixels.foreach_set(pixels.reshape(-1))
    image.pack()
    material = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    tree = material.node_tree
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image, texture.interpolation = image, "Closest"
    surface = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    tree.links.new(texture.outputs["Alpha"], surface.inputs["Alpha"])
    return material


@pytest.fixture
def fence() -> Any:
    """A floor below a plate of which every other square is clear."""
    blender.plane("Floor")
    plate = blender.plane("Plate", location=(0.0, 0.0, 0.5))
    plate.data.materials.append(cut_material("Checks", np.indices((8, 8), dtype=np.int64).sum(axis=0) % 2))
    return plate


def test_a_cut_plate_shades_as_in_cycles(fence: Any, bake: Any) -> None:
    run = bake(
        "--objects", "Floor", "--compare-cycles", "1024", "--size", "32", "--margin", "0", effort=("--rays", "1024")
    )
    assert run.status == 0, run.err
    cycles = run.report["objects"][0]["cycles"]
    assert abs(cycles["bias"]) < 2e-3 and cycles["rmse"] < 0.02
    cut = run.report["objects"][0]["mean"]["ao"]
    bpy.data.objects["Plate"].data.materials.clear()
    opaque = bake("--objects", "Floor", effort=("--rays", "64")).report["objects"][0]["mean"]["ao"]
    assert cut - opaque == pytest.approx(0.5 * (1.0 - opaque), abs=0.03)  # half of what the plate hid


def test_instances_are_cut_too_and_half_clear_ones_let_half_through(bake: Any) -> None:
    blender.plane("Floor")
    for number in range(3):
        plate = blender.plane(f"Plate {number}", location=(0.0, 0.0, 0.2 + 0.1 * number))
        plate.data = bpy.data.objects["Plate 0"].data
        plate.scale = (100.0, 100.0, 1.0)
    plate.data.materials.append(cut_material("Film", np.full((4, 4), 0.5)))
    run = bake("--objects", "Floor", effort=("--rays", "1024"))
    assert run.report["objects"][0]["mean"]["ao"] == pytest.approx(0.5**3, abs=5e-3)


def test_what_is_not_read_is_said_in_a_line_and_opaque(bake: Any) -> None:
    blender.plane("Floor")
    plate = blender.plane("Plate", location=(0.0, 0.0, 0.5))
    material = bpy.data.materials.new("Clouds")
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    tree = material.node_tree
    noise = tree.nodes.new("ShaderNodeTexNoise")
    surface = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    tree.links.new(noise.outputs[0], surface.inputs["Alpha"])
    plate.data.materials.append(material)
    run = bake("--objects", "Floor")
    assert [line for line in run.lines if line.startswith("Clouds: ") and "as if opaque" in line]


def test_a_linked_material_is_told_from_one_that_is_called_as_it_is_listed(tmp_path: Path) -> None:
    """A floor under a clear roof and an opaque one, whose materials Blender's lists call the same."""
    opaque = blender.material("Leaf")
    bpy.data.libraries.write(str(tmp_path / "library.blend"), {opaque})
    bpy.data.materials.remove(opaque)
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, wanted):
        wanted.materials = ["Leaf"]
    clear = blender.material("Leaf [library.blend]")
    blender.principled(clear).inputs["Alpha"].default_value = 0.0
    assert clear.name_full == wanted.materials[0].name_full
    for y, material in ((-0.5, clear), (0.5, wanted.materials[0])):
        roof = blender.plane(f"Roof {y}", location=(0.0, y, 0.01))
        roof.scale.y = 0.5
        roof.data.materials.append(material)
    blender.plane("Floor")
    (baked,) = bake(blender.read(["Floor"])[0], flat_settings(width=8, height=8, rays=16, margin=0))
    values = baked.maps["ao"].values  # row 0 is the far side, under the opaque roof
    assert values[:3].max() < 0.2 and values[5:].min() > 0.8
