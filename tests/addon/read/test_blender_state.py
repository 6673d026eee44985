"""What is changed in Blender for the time comes back."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.tests.oracles import blender  # noqa: E402
from occlusion_bake.tests.oracles.blender import bake_onto, press, set_panel  # noqa: E402

pytestmark = pytest.mark.usefixtures("empty_scene", "registered", "unmeasured")


class Elsewhere(bpy.types.RenderEngine):
    """The engine of a renderer that is not installed here."""

    bl_idname = "A_RENDERER_OF_31_LETTERS_AT_MOST"[:31]
    bl_label = "Elsewhere"


@pytest.fixture
def absent(tmp_path: Path) -> Iterator[str]:
    """A file whose scene is rendered by an engine that is not there."""
    path = str(tmp_path / "scene.blend")
    bpy.utils.register_class(Elsewhere)
    bpy.context.scene.render.engine = Elsewhere.bl_idname
    blender.plane()
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.utils.unregister_class(Elsewhere)
    bpy.ops.wm.open_mainfile(filepath=path)
    assert bpy.context.scene.render.engine != Elsewhere.bl_idname
    yield path


@pytest.mark.parametrize("button", ["bake", "compare"])
def test_an_engine_that_is_not_installed_stays(absent: str, button: str) -> None:
    set_panel(width=16, height=16, quality="RAYS", rays=1, cycles_samples=1)
    shown = bpy.context.scene.render.engine
    blender.select(bpy.data.objects["Plane"])
    assert press(button) == {"FINISHED"}
    assert bpy.context.scene.render.engine == shown
    bpy.ops.wm.save_as_mainfile(filepath=absent)
    bpy.utils.register_class(Elsewhere)
    try:
        bpy.ops.wm.open_mainfile(filepath=absent)
        assert bpy.context.scene.render.engine == Elsewhere.bl_idname
    finally:
        bpy.utils.unregister_class(Elsewhere)


def test_an_engine_that_is_there_stays() -> None:
    blender.plane()
    set_panel(width=16, height=16, quality="RAYS", rays=1)
    for engine in ("CYCLES", "BLENDER_WORKBENCH"):
        bpy.context.scene.render.engine = engine
        assert bake_onto("Plane") == {"FINISHED"}
        assert bpy.context.scene.render.engine == engine
