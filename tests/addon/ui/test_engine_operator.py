"""The panel set for an engine: what its preset says, and a bake that writes it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.addon.ui.engine_presets import PRESETS, panel_settings  # noqa: E402
from occlusion_bake.core.finish.image_file import read_image  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402
from occlusion_bake.tests.oracles.blender import bake_onto, set_panel  # noqa: E402

pytestmark = pytest.mark.usefixtures("empty_scene", "registered")


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("export", PRESETS, ids=lambda each: each.name)
def test_the_panel_takes_every_preset(export: Any, packed: bool) -> None:
    assert bpy.ops.occlusion_bake.for_engine(engine=export.name, packed=packed) == {"FINISHED"}
    chosen = bpy.context.scene.occlusion_bake
    for name, value in panel_settings(export, packed=packed).items():
        assert getattr(chosen, name) == value


@pytest.mark.parametrize("engine", ["godot", "unreal", "unity_hdrp"])
def test_a_bake_for_an_engine_writes_its_files(engine: str, tmp_path: Path) -> None:
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"), check_existing=False)
    blender.plane("Crate")
    blender.wall()
    set_panel(width=32, height=32, quality="RAYS", rays=64)
    bpy.ops.occlusion_bake.for_engine(engine=engine)
    assert bake_onto("Crate") == {"FINISHED"}
    names = sorted(path.name for path in (tmp_path / "textures").iterdir())
    start = "T_Crate" if engine == "unreal" else "Crate"
    assert names == [f"{start}_ao.png", f"{start}_bent.png"]
    bent, told = read_image(tmp_path / "textures" / f"{start}_bent.png")
    assert told["space"] == "tangent" and told["green"] == ("down" if engine == "unreal" else "up")
    upper = bent[:8, 24:, 1].mean() - 0.5  # near the end of a wall that stands at 0 < y < 1: bent past it, to +y
    assert np.sign(upper) == (-1.0 if engine == "unreal" else 1.0)
