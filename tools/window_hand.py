"""A person before Blender's window, for window_session.py: eyes that take screenshots, a hand on the mouse.

X11 with xdotool and ImageMagick's `import`. What takes time is a generator of the seconds until it goes on, so that
Blender's own loop runs meanwhile.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
import traceback
from collections.abc import Callable, Generator
from typing import Any, NoReturn

import bpy

Waits = Generator[float, None, None]

context: Any = bpy.context  # whose window and region the stubs take to be missing
_ROW = 14  # pixels between two places to look at: less than a button is high
_LOOK = 0.15  # seconds until a window drawn in software has seen where the mouse is


def act(session: Waits) -> None:
    """Go through the session once the window is there, then quit as a person does; on a failure say why and end."""

    def go_on() -> float | None:
        try:
            return next(session)
        except StopIteration:
            bpy.ops.wm.quit_blender()
            return None
        except BaseException:
            _end()

    bpy.app.timers.register(go_on, first_interval=3.0, persistent=True)


def _end() -> NoReturn:
    traceback.print_exc()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(1)  # no exception of a timer ends Blender


def until(reached: Callable[[], bool], seconds: float, what: str) -> Waits:
    """Wait for something. Raises TimeoutError."""
    end = time.monotonic() + seconds
    while not reached():
        if time.monotonic() > end:
            raise TimeoutError(f"{what}: not within {seconds:g} s")
        yield 0.05


def picture(path: str) -> None:
    """A screenshot of the whole display."""
    subprocess.run(["import", "-window", "root", path], check=True)


def sidebar() -> tuple[Any, Any, Any]:
    """Window, area and region of the 3D view's sidebar."""
    window = context.window_manager.windows[0]
    area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    return window, area, next(region for region in area.regions if region.type == "UI")


def open_tab(name: str) -> Waits:
    """Show a tab of the sidebar."""
    _, area, region = sidebar()
    area.spaces.active.show_region_ui = True
    yield 0.5
    region.active_panel_category = name
    region.tag_redraw()
    yield 0.5


def press(operator: str) -> Waits:
    """Go down the middle of the sidebar to the button of an operator and click it. Raises LookupError."""
    window, _, region = sidebar()
    x = region.x + region.width // 2
    for y in range(region.y + region.height - 30, region.y, -_ROW):
        _mouse("mousemove", x, window.height - y)
        yield _LOOK
        if _hovered() == f"bpy.ops.{operator}()":
            _mouse("click", 1)
            yield _LOOK
            return
    raise LookupError(f"no button of {operator} in the sidebar")


def key(name: str) -> None:
    """Press a key where the mouse is."""
    _mouse("key", name)


def _mouse(*words: str | int) -> None:
    subprocess.run(["xdotool", *map(str, words)], check=True)


def _hovered() -> str:
    """What the button under the mouse would do, as Blender words it; empty where there is none."""
    window, area, region = sidebar()
    manager = context.window_manager
    manager.clipboard = ""
    with context.temp_override(window=window, area=area, region=region):
        try:
            bpy.ops.ui.copy_python_command_button()
        except RuntimeError:
            return ""
    return str(manager.clipboard)
