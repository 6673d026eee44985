"""An image before the artist's eyes: in an Image Editor that is open, else in a window of its own."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import bpy

_SETTLES = 0.2  # seconds until a window that was just opened knows its size


def show_in_editor(context: bpy.types.Context, image: bpy.types.Image) -> None:
    """Show an image whole. UV editors are left alone; in the background nothing is done."""
    if bpy.app.background or context.window is None:
        return
    if not any(_editors(context)):
        bpy.ops.wm.window_new()
        context.window_manager.windows[-1].screen.areas[0].ui_type = "IMAGE_EDITOR"
    for _, area in _editors(context):
        area.spaces.active.image = image
    bpy.app.timers.register(_fit, first_interval=_SETTLES)


def _editors(context: bpy.types.Context) -> Iterator[tuple[Any, Any]]:
    """The first Image Editor of all windows, with its window; none where there is none."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.ui_type == "IMAGE_EDITOR":
                yield window, area
                return


def _fit() -> None:
    for window, area in _editors(bpy.context):
        region = next((each for each in area.regions if each.type == "WINDOW"), None)
        if region is not None:
            with bpy.context.temp_override(window=window, area=area, region=region):
                bpy.ops.image.view_all(fit_view=True)
