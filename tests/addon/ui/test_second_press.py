"""Where the making of charts breaks down, the next press lets Blender unwrap: those objects, and no others."""

from __future__ import annotations

from typing import Any

import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.addon.charts import chart_layout  # noqa: E402
from occlusion_bake.core.base.errors import NoUnwrapper  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402
from occlusion_bake.tests.oracles.blender import bake_onto, press, select, set_panel  # noqa: E402

BROKEN = "the process that makes them crashed"
SMART = " charts by Smart UV Project"


@pytest.fixture(autouse=True)
def scene(registered: None, empty_scene: None, charts_here: None, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Charts of whatever is called Bad break down."""
    unwrap = chart_layout.unwrap_in_process

    def broken(name: str, *arguments: Any, **options: Any) -> Any:
        if name == "Bad":
            raise NoUnwrapper(name, BROKEN)
        return unwrap(name, *arguments, **options)

    monkeypatch.setattr(chart_layout, "unwrap_in_process", broken)
    for i, name in enumerate(("Bad", "Good", "Other")):
        blender.bare_cube(name, location=(5 * i, 0, 0))
    return set_panel(width=64, height=64, quality="RAYS", rays=1, margin=0, threads=2)


def said() -> str:
    return bpy.context.window_manager.occlusion_bake.lines


def told(button: str = "bake") -> str:
    select(bpy.data.objects["Bad"])
    with pytest.raises(RuntimeError, match=BROKEN):
        press(button)
    return said()


@pytest.mark.parametrize("button", ["bake", "unwrap"])
def test_the_next_press_of_either_button_unwraps(button: str) -> None:
    assert "press Bake or Make UV Charts again, or choose Smart UV Project as the UV map" in told(button)
    assert press() == {"FINISHED"} and f"Bad: 6{SMART}" in said()


def test_another_object_gets_charts_of_ours() -> None:
    told()
    assert bake_onto("Good") == {"FINISHED"} and "Good: 6 charts in the UV map" in said()
    told()  # what was told is of the last press


def test_beside_others_that_one_alone_is_unwrapped() -> None:
    assert bake_onto("Bad", "Good") == {"FINISHED"} and BROKEN in said()
    assert bake_onto("Bad", "Other") == {"FINISHED"}
    assert f"Bad: 6{SMART}" in said() and "Other: 6 charts in the UV map" in said()


def test_a_press_that_is_refused_first_does_not_use_it_up(tmp_path: Any) -> None:
    told()
    (tmp_path / "file").touch()
    set_panel(output="SAVED", path=str(tmp_path / "file" / "{object}_{map}"))
    with pytest.raises(RuntimeError):
        press()
    assert BROKEN not in said()
    set_panel(output="PACKED")
    assert press() == {"FINISHED"} and f"Bad: 6{SMART}" in said()


def test_a_renamed_object_is_the_same() -> None:
    told()
    bpy.data.objects["Bad"].name = "Worse"
    assert press() == {"FINISHED"} and f"Worse: 6{SMART}" in said()
