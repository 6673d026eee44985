"""Low meshes baked from high ones: by the selection, by names, by the command, and what is said of what cannot be."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.addon.read.block_ref import refs_of  # noqa: E402
from occlusion_bake.addon.read.high_low_pairs import HighMeshes, paired_by_name, paired_with  # noqa: E402
from occlusion_bake.core.base.errors import InputError  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402
from occlusion_bake.tests.oracles.blender import bake_onto, pixels, set_panel  # noqa: E402

pytestmark = pytest.mark.usefixtures("empty_scene", "registered")


@pytest.fixture
def settings() -> Any:
    return partial(set_panel, width=32, height=32, quality="RAYS", rays=16)


def pit(name: str, depth: float = 0.3) -> Any:
    """A plane with a square pit over the middle quarter: 12 by 12 cells, those in the middle deep, walls between."""
    heights = np.zeros((12, 12))
    heights[3:9, 3:9] = -depth
    vertices, faces = [], []

    def add(*corners: Any) -> None:
        faces.append(tuple(range(len(vertices), len(vertices) + 4)))
        vertices.extend(corners)

    at = np.linspace(-1, 1, 13)
    for y in range(12):
        for x in range(12):
            h = heights[y, x]
            add((at[x], at[y], h), (at[x + 1], at[y], h), (at[x + 1], at[y + 1], h), (at[x], at[y + 1], h))
    low, high = at[3], at[9]
    for a, b in (
        ((low, low), (low, high)),
        ((low, high), (high, high)),
        ((high, high), (high, low)),
        ((high, low), (low, low)),
    ):
        add((*a, -depth), (*b, -depth), (*b, 0.0), (*a, 0.0))
    return blender.mesh(name, vertices, faces)


def test_selected_to_active(settings: Any) -> None:
    """The pit of the high mesh shows on the flat low one, which itself blocks no light."""
    blender.plane("Low")
    pit("High")
    settings(source="SELECTED", extrusion=0.4, rays=64)
    assert bake_onto("High", "Low") == {"FINISHED"}
    ao = pixels("Low AO")[::-1, :, 0]
    assert ao[16, 16] < 0.9 < 0.99 < ao[2, 2]
    assert "High AO" not in bpy.data.images
    assert "Occluders: High" in bpy.context.window_manager.occlusion_bake.lines
    bpy.data.objects["Low"].location.z = 0.1  # a lid, if it counted
    bpy.context.view_layer.update()
    assert bake_onto("High", "Low") == {"FINISHED"}
    np.testing.assert_allclose(pixels("Low AO")[::-1, :, 0][16, 16], ao[16, 16], atol=0.1)


def test_selected_to_active_needs_both(settings: Any) -> None:
    blender.plane("Low")
    settings(source="SELECTED")
    with pytest.raises(RuntimeError, match="Low: nothing to bake it from; select the high meshes first"):
        bake_onto("Low")
    assert not [image for image in bpy.data.images if image.name == "Low AO"]


def test_a_cage_that_does_not_render_says_where_to_look(settings: Any) -> None:
    blender.plane("Low")
    blender.plane("High", location=(0, 0, 0.5))
    cage = blender.plane("Cage", location=(0, 0, 0.6))
    cage.hide_render = True
    settings(source="SELECTED")
    with pytest.raises(RuntimeError, match="Low: none of its texels sees a high mesh"):
        bake_onto("High", "Low")
    settings(source="SELECTED", cage=cage)
    assert bake_onto("High", "Cage", "Low") == {"FINISHED"}
    np.testing.assert_array_equal(pixels("Low AO")[::-1, :, 0], 1.0)


def test_pairs_by_name(settings: Any) -> None:
    for low, high, x in (("Rock_low", "Rock_high.001", 0), ("Log.LOW", "log high", 5)):
        blender.plane(low, location=(x, 0, 0))
        pit(high).location.x = x
    blender.plane("Rock_high.002", location=(0, 0, -0.05))
    blender.plane("Other", location=(10, 0, 0))
    settings(source="NAMES", extrusion=0.4)
    assert bake_onto("Rock_high.001", "Log.LOW", "Other") == {"FINISHED"}
    made = {image.name for image in bpy.data.images if image.name.endswith("AO")}
    assert made == {"Rock_low AO", "Log.LOW AO", "Other AO"}
    assert pixels("Log.LOW AO")[::-1, :, 0][16, 16] < 0.9
    assert pixels("Rock_low AO")[::-1, :, 0][16, 16] == 1.0  # the second high mesh closes the pit
    np.testing.assert_array_equal(pixels("Other AO")[::-1, :, 0], 1.0)


@pytest.mark.parametrize("chosen", ["Rock_low", "Rock_high", "Rock_cage"])
def test_any_part_of_a_pair_stands_for_it(settings: Any, chosen: str) -> None:
    for name, height in (("Rock_low", 0.0), ("Rock_high", 0.1), ("Rock_cage", 0.2)):
        blender.plane(name, location=(0, 0, height))
    settings(source="NAMES")
    assert bake_onto(chosen) == {"FINISHED"}
    assert [image.name for image in bpy.data.images if image.name.startswith("Rock")] == ["Rock_low AO"]


def test_a_cage_of_no_pair_is_baked_as_it_is(settings: Any) -> None:
    for name in ("Rock_high", "Rock_cage"):
        blender.plane(name)
    settings(source="NAMES")
    assert bake_onto("Rock_cage") == {"FINISHED"}
    assert "Rock_cage AO" in bpy.data.images


def test_a_high_mesh_of_another_library_is_no_part_of_the_pair(tmp_path: Path) -> None:
    for name in ("Rock_low", "Rock_high"):
        blender.plane(name)
    library = str(tmp_path / "library.blend")
    bpy.data.libraries.write(library, {bpy.data.objects["Rock_high"]})
    with bpy.data.libraries.load(library, link=True) as (_, wanted):
        wanted.objects = ["Rock_high"]
    (other,) = wanted.objects
    bpy.context.scene.collection.objects.link(other)
    (ref,) = refs_of([other])
    assert paired_by_name(bpy.data.objects, [ref], None).targets == (ref,)


def test_which_names_are_pairs() -> None:
    names = ("a_low", "a_high", "a_high_2", "a_cage", "b_low", "Highlands", "Yellow", "c_high", "low", "HIGH.001")
    for name in names:
        blender.plane(name)
    ref = dict(zip(names, blender.refs(*names), strict=True))
    found = paired_by_name(bpy.data.objects, [ref["a_high_2"], ref["Highlands"], ref["Yellow"], ref["c_high"]], 0.5)
    assert found.targets == (ref["Highlands"], ref["Yellow"], ref["c_high"], ref["a_low"])
    assert found.highs == {ref["a_low"]: HighMeshes((ref["a_high"], ref["a_high_2"]), ref["a_cage"], 0.5)}
    assert found.excluded == {ref[name].uid for name in ("a_low", "a_cage", "low")}
    low = paired_by_name(bpy.data.objects, [ref["low"]], None)
    assert low.highs == {ref["low"]: HighMeshes((ref["HIGH.001"],))}
    with pytest.raises(InputError, match="b_low: no mesh named b_high to bake it from"):
        paired_by_name(bpy.data.objects, [ref["a_low"], ref["b_low"]], None)
    x, y, z = ref["a_low"], ref["a_high"], ref["a_cage"]
    assert paired_with(x, [x, y, z], z, None).highs[x].meshes == (y,)


def test_alone_the_high_meshes_hide_their_own_low_one(settings: Any) -> None:
    blender.plane("A_low")
    blender.plane("A_high")
    blender.plane("Roof", location=(0, 0, 0.5))
    settings(source="NAMES", occluders="SELF")
    bake_onto("A_low")
    np.testing.assert_array_equal(pixels("A_low AO")[::-1, :, 0], 1.0)
    settings(source="NAMES", occluders="SCENE")
    bake_onto("A_low")
    assert pixels("A_low AO")[::-1, :, 0].mean() < 0.5


def test_baked_again_by_what_is_kept(settings: Any) -> None:
    blender.plane("Low")
    pit("High")
    settings(source="SELECTED", extrusion=0.4)
    bake_onto("High", "Low")
    first = pixels("Low AO")[::-1, :, 0]
    settings(source="SELF")
    with bpy.context.temp_override(edit_image=bpy.data.images["Low AO"]):
        assert bpy.ops.occlusion_bake.again() == {"FINISHED"}
    np.testing.assert_array_equal(pixels("Low AO")[::-1, :, 0], first)


def test_colours_from_high_meshes(settings: Any) -> None:
    blender.plane("Low")
    pit("High")
    settings(source="SELECTED", extrusion=0.4, output="COLOURS")
    assert bake_onto("High", "Low") == {"FINISHED"}
    colours = bpy.data.objects["Low"].data.color_attributes["AO"].data
    assert all(0.3 < colours[i].color[0] <= 1.0 for i in range(4))


def test_the_command(bake: Any) -> None:
    blender.plane("Low")
    pit("High")
    run = bake("--objects", "Low", "--highs", "High", "--extrusion", "0.4", "--occluders", "self")
    assert run.status == 0 and run.report["occluders"] == ["High"]
    assert run.report["objects"][0]["mean"]["ao"] < 0.99
    bpy.data.objects["Low"].name, bpy.data.objects["High"].name = "P_low", "P_high"
    by_name = bake("--pairs", "--extrusion", "0.4")
    assert [each["name"] for each in by_name.report["objects"]] == ["P_low"]
    assert by_name.report["objects"][0]["mean"] == run.report["objects"][0]["mean"]


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (("--highs", "High"), "--highs: give the one object that is baked from them in --objects"),
        (("--objects", "Low", "--cage", "High"), "--cage: is of an object that is baked from others"),
        (("--pairs", "--extrusion", "-1"), "--extrusion -1: give a length above 0"),
        (("--objects", "Low", "--highs", "Nobody"), "Nobody: no such object in the file"),
        (("--atlas", "--color-attributes", "x.blend"), "--atlas: color attributes are no images"),
    ],
)
def test_what_the_command_refuses(bake: Any, words: Any, line: str) -> None:
    blender.plane("Low")
    blender.plane("High", location=(0, 0, 0.001))
    assert bake(*words).refused().startswith(line)
