"""An image before the artist's eyes: in an Image Editor that is open, else in a window of its own."""

from __future__ import annotations

from typing import Any

import bpy

from ..typed import window_manager_in

_SETTLES = 0.2  # seconds until a window that was just opened knows its size


def show_in_editor(context: bpy.types.Context, image: bpy.types.Image) -> None:
    """Show an image whole. UV editors are left alone; in the background nothing is done."""
    if bpy.app.background or context.window is None:
        return
    if _editor(context) is None:
        bpy.ops.wm.window_new()
        window_manager_in(context).windows[-1].screen.areas[0].ui_type = "IMAGE_EDITOR"
    if (found := _editor(context)) is not None:
        found[1].spaces.active.image = image
    bpy.app.timers.register(_fit, first_interval=_SETTLES)


def _editor(context: bpy.types.Context) -> tuple[Any, Any] | None:
    """The first Image Editor of all windows, as window and area."""
    places = ((window, area) for window in window_manager_in(context).windows for area in window.screen.areas)
    return next((place for place in places if place[1].ui_type == "IMAGE_EDITOR"), None)


def _fit() -> None:
    found = _editor(bpy.context)
    if found is None:
        return
    window, area = found
    region = next((each for each in area.regions if each.type == "WINDOW"), None)
    if region is not None:
        with bpy.context.temp_override(window=window, area=area, region=region):
            bpy.ops.image.view_all(fit_view=True)
