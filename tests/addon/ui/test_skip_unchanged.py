"""Skip Unchanged: what was baked from the same is left as it is, and anything else is baked."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.tests.oracles import blender  # noqa: E402


@pytest.fixture(autouse=True)
def props(registered: None, empty_scene: None, charts_here: None) -> None:
    """Three in a row, each within reach of the next alone."""
    for number in range(3):
        blender.cube(f"Prop {number}", location=(2.5 * number, 0.0, 0.0))
    effort = {"quality": "RAYS", "rays": 4, "width": 32, "height": 32}
    blender.set_panel(**effort, use_distance=True, distance=1.0, use_skip=True)


def baked(*names: str) -> set[str]:
    """Bake these and tell which got new values: all images are blackened first, behind Blender's back."""
    images = [image for image in bpy.data.images if image.name.endswith("AO")]
    for image in images:
        black(image)
    blender.bake_onto(*(names or ("Prop 0", "Prop 1", "Prop 2")))
    return {
        image.name for image in bpy.data.images if image.name.endswith("AO") and blender.pixels(image)[..., 0].any()
    }


def black(image: Any) -> None:
    """As it was packed, so that it does not count as painted on."""
    image.pixels.foreach_set(np.zeros(len(image.pixels), np.float32))
    image.pack()


def panel_lines() -> list[str]:
    manager: Any = bpy.context.window_manager
    lines: list[str] = manager.occlusion_bake.lines.split("\n")
    return lines


ALL = {"Prop 0 AO", "Prop 1 AO", "Prop 2 AO"}


def test_nothing_changed() -> None:
    assert baked() == ALL
    assert baked() == set()
    lines = panel_lines()
    assert "Not changed, and left as it is: 3 objects" in lines


def test_without_it_all_are_baked() -> None:
    baked()
    blender.set_panel(use_skip=False)
    assert baked() == ALL


def test_what_is_within_reach_of_a_change_is_baked() -> None:
    baked()
    bpy.data.objects["Prop 2"].location.z += 0.25
    assert baked() == {"Prop 1 AO", "Prop 2 AO"}


@pytest.mark.parametrize(
    "change",
    [
        lambda: blender.set_panel(rays=8),
        lambda: blender.set_panel(distance=2.0),
        lambda: blender.set_panel(margin=3),
        lambda: blender.set_panel(height=16),
        lambda: blender.set_panel(use_ro=True),
        lambda: blender.set_panel(use_ground=True),
    ],
)
def test_other_settings_are_baked(change: Callable[[], Any]) -> None:
    baked()
    change()
    assert baked() == ALL


def test_what_was_removed_or_painted_on_is_baked() -> None:
    baked()
    bpy.data.images.remove(bpy.data.images["Prop 0 AO"])
    image = bpy.data.images["Prop 1 AO"]
    image.pixels[0] = 0.5
    image.update()
    assert image.is_dirty
    blender.bake_onto("Prop 0", "Prop 1", "Prop 2")
    assert "Not changed, and left as it is: 1 object" in panel_lines()


def test_bake_again(monkeypatch: pytest.MonkeyPatch) -> None:
    baked("Prop 0")
    image = bpy.data.images["Prop 0 AO"]
    with bpy.context.temp_override(edit_image=image):
        blender.press("again")
    assert "Not changed, and left as it is: 1 object" in panel_lines()
    bpy.data.objects["Prop 0"].location.z += 0.5
    with bpy.context.temp_override(edit_image=image):
        blender.press("again")
    assert not any("Not changed" in line for line in panel_lines())


def test_an_atlas(tmp_path: Path) -> None:
    blender.set_panel(layout="ATLAS", atlas="Room", uv="CHARTS")
    assert baked() == {"Room AO"}
    assert baked() == set()
    bpy.data.objects["Prop 0"].location.z += 0.25
    assert baked() == {"Room AO"}


def test_files(tmp_path: Path) -> None:
    blender.set_panel(output="SAVED", path=str(tmp_path / "{object}_{map}"))
    names = ("Prop 0", "Prop 1", "Prop 2")
    blender.bake_onto(*names)
    file = tmp_path / "Prop 1_ao.png"
    before = {path: path.stat().st_mtime_ns for path in tmp_path.iterdir()}
    blender.bake_onto(*names)
    assert {path: path.stat().st_mtime_ns for path in tmp_path.iterdir()} == before
    good = file.read_bytes()
    file.write_bytes(good[:-20])
    blender.bake_onto(*names)
    assert file.read_bytes() == good
    file.unlink()
    blender.bake_onto(*names)
    assert file.read_bytes() == good
    blender.set_panel(depth="8")
    blender.bake_onto(*names)
    assert file.read_bytes() != good


def test_a_file_of_other_hands_is_baked(tmp_path: Path) -> None:
    """Another scene or machine wrote it: what the image tells of itself does not count then."""
    blender.set_panel(output="SAVED", path=str(tmp_path / "{object}_{map}"))
    blender.bake_onto("Prop 0", "Prop 1")
    file = tmp_path / "Prop 0_ao.png"
    good = file.read_bytes()
    file.write_bytes((tmp_path / "Prop 1_ao.png").read_bytes())
    blender.bake_onto("Prop 0", "Prop 1")
    assert file.read_bytes() == good
    blender.set_panel(path=str(tmp_path / "there" / "{object}_{map}"))
    blender.bake_onto("Prop 0")
    assert (tmp_path / "there" / "Prop 0_ao.png").read_bytes() == good


def test_what_is_left_is_shown_in_materials() -> None:
    baked("Prop 0")
    obj = bpy.data.objects["Prop 0"]
    assert not obj.material_slots
    blender.set_panel(use_material=True)
    assert baked("Prop 0") == set() and obj.material_slots
    used = [node.image for node in obj.material_slots[0].material.node_tree.nodes if node.type == "TEX_IMAGE"]
    assert used == [bpy.data.images["Prop 0 AO"]]


def test_a_copy_is_baked() -> None:
    baked("Prop 0")
    copy = bpy.data.objects["Prop 0"].copy()
    bpy.context.collection.objects.link(copy)
    bpy.data.objects.remove(bpy.data.objects["Prop 0"])
    copy.name = "Other"
    blender.bake_onto("Other")
    assert not any("Not changed" in line for line in panel_lines())


def test_what_is_written_into_is_always_baked() -> None:
    blender.set_panel(output="COLOURS")
    blender.bake_onto("Prop 0")
    blender.bake_onto("Prop 0")
    assert not any("Not changed" in line for line in panel_lines())


def test_a_saved_file_knows_it_still(tmp_path: Path) -> None:
    baked()
    path = str(tmp_path / "scene.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    assert baked() == set()
