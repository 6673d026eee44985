"""A person before Blender's window, for its sessions: eyes that take screenshots, a hand on the mouse.

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
from pathlib import Path
from typing import Any, NoReturn

import bpy

Waits = Generator[float, None, None]

context: Any = bpy.context  # whose window and region the stubs take to be missing
_ROW = 14  # pixels between two places to look at: less than a button is high
_LOOKS = (0.15, 0.5)  # seconds until a window drawn in software has seen where the mouse is, mostly and at most
_found: dict[str, int] = {}  # by operator: a row above its button


def act(session: Callable[[str, Path, str], Waits]) -> None:
    """Go through a session by the arguments ZIP FOLDER NAME once the window is there, then quit as a person does; on a
    failure say why and end."""
    context.preferences.view.show_splash = False
    context.preferences.use_preferences_save = False
    archive, folder, name = sys.argv[sys.argv.index("--") + 1 :]
    steps = session(archive, Path(folder), name)

    def go_on() -> float | None:
        try:
            return next(steps)
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


def install(archive: str) -> None:
    """Without saving the preferences: a comparison's own Blender must do without them."""
    window, _, _ = sidebar()
    with context.temp_override(window=window):
        bpy.ops.extensions.package_install_files(filepath=archive, repo="user_default", enable_on_install=True)


def until(reached: Callable[[], bool], seconds: float, what: str) -> Waits:
    """Wait for something. Raises TimeoutError."""
    end = time.monotonic() + seconds
    while not reached():
        if time.monotonic() > end:
            raise TimeoutError(f"{what}: not within {seconds:g} s")
        yield 0.05


def check(right: bool, what: str) -> None:
    """Raises AssertionError; an assert statement would vanish under -O."""
    if not right:
        raise AssertionError(what)


def picture(path: str) -> None:
    """A screenshot of the whole display."""
    subprocess.run(["import", "-window", "root", path], check=True)


def sidebar() -> tuple[Any, Any, Any]:
    """Window, area and region of the 3D view's sidebar."""
    window = context.window_manager.windows[0]
    area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    return window, area, next(region for region in area.regions if region.type == "UI")


def in_view() -> Any:
    """The 3D view's context, as for a person over it."""
    window, area, region = sidebar()
    return context.temp_override(window=window, area=area, region=region)


def open_tab(name: str) -> Waits:
    """Show a tab of the sidebar."""
    _, area, region = sidebar()
    area.spaces.active.show_region_ui = True
    yield 0.5
    region.active_panel_category = name
    region.tag_redraw()
    yield 0.5


def press(operator: str) -> Waits:
    """Go down the middle of the sidebar to the button of an operator and click it: from where it was last, and more
    slowly where the window has not seen the mouse in time. Raises LookupError."""
    window, _, region = sidebar()
    x, top = region.x + region.width // 2, region.y + region.height - 30
    for first, look in ((_found.get(operator, top), _LOOKS[0]), *((top, look) for look in _LOOKS)):
        for y in range(first, region.y, -_ROW):
            _mouse("mousemove", x, window.height - y)
            yield look
            if _hovered() == f"bpy.ops.{operator}()":
                _mouse("click", 1)
                _found[operator] = y + _ROW
                yield look
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
