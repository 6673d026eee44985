"""Runs inside a Blender with a window, for try_window.py: `-- ZIP FOLDER NAME`.

Installs the extension, presses its buttons by mouse as an artist would (bake, cancel, compare), looks at what comes of
it, and leaves screenshots FOLDER/NAME_….png.
"""

from __future__ import annotations

import importlib
import sys
import time
from pathlib import Path
from typing import Any

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))

from window_hand import Waits, act, key, open_tab, picture, press, sidebar, until

MODULE = "bl_ext.user_default.occlusion_bake"
UNDER = 0.169  # visibility half a metre below the middle of a square of 2 m: 1 less its form factor, 0.831
OPEN = 0.99  # and more in a far corner of the floor


def session(archive: str, folder: Path, name: str) -> Waits:
    install(archive)
    floor = make_scene()
    yield from open_tab("Occlusion")
    yield from cancelled(floor)
    yield from baked(floor, folder, name)
    yield from compared(floor, folder, name)
    print(f"Blender {bpy.app.version_string}: the window bakes, cancels and compares", flush=True)


def install(archive: str) -> None:
    """Without saving the preferences: a comparison's own Blender must do without them."""
    window, _, _ = sidebar()
    with bpy.context.temp_override(window=window):
        bpy.ops.extensions.package_install_files(filepath=archive, repo="user_default", enable_on_install=True)


def make_scene() -> Any:
    """The default cube above a floor, which is selected."""
    bpy.data.objects["Cube"].location.z = 1.5
    bpy.ops.mesh.primitive_plane_add(size=12.0)
    chosen = bpy.context.scene.occlusion_bake
    chosen.width = chosen.height = 1024
    chosen.quality, chosen.rays = "RAYS", 1024  # a bake long enough to be looked at and cancelled
    return bpy.context.object


def running() -> bool:
    return importlib.import_module(f"{MODULE}.addon.modal").running() is not None


def cancelled(floor: Any) -> Waits:
    """Escape stops the bake at once and leaves no image and no material."""
    yield from press("occlusion_bake.bake")
    yield from until(running, 5.0, "a bake after its button was pressed")
    yield 0.7
    key("Escape")
    yield from until(lambda: not running(), 5.0, "the end of the bake after Escape")
    check("AO" not in image_names() and not floor.data.materials, f"cancelled, but there are {image_names()}")


def baked(floor: Any, folder: Path, name: str) -> Waits:
    """The window lives while the bake goes on; then the image holds the right values."""
    yield from press("occlusion_bake.bake")
    yield from until(running, 5.0, "a bake after its button was pressed")
    yield 1.5
    picture(str(folder / f"{name}_baking.png"))
    check(running(), "the bake was over before it could be looked at")
    beats: list[float] = []
    while running():
        beats.append(time.monotonic())
        yield 0.03
    check(len(beats) > 10, f"the window came to life {len(beats)} times in a bake")
    gaps = np.diff(beats)
    print(f"while it bakes: 99 of 100 gaps within {np.quantile(gaps, 0.99):.3f} s, the longest {gaps.max():.3f} s")
    width, height = bpy.data.images[f"{floor.name} AO"].size
    values = np.array(bpy.data.images[f"{floor.name} AO"].pixels).reshape(height, width, 4)[..., 0]
    middle = float(values[height // 2 - 4 : height // 2 + 4, width // 2 - 4 : width // 2 + 4].mean())
    check(abs(middle - UNDER) < 0.01, f"visibility {middle:.3f} below the cube, {UNDER} is right")
    check(float(values[:8, :8].mean()) > OPEN, f"visibility {values[:8, :8].mean():.3f} in the corner")
    check(bool(((values >= 0.0) & (values <= 1.0)).all()), "values outside [0, 1]")
    check(not floor.data.materials, "there is a material that nobody asked for")
    yield 1.0
    picture(str(folder / f"{name}_baked.png"))


def compared(floor: Any, folder: Path, name: str) -> Waits:
    """The comparison starts a Blender of its own and shows both times, the errors and a picture."""
    chosen = bpy.context.scene.occlusion_bake
    chosen.width = chosen.height = 256
    chosen.cycles_samples = 16
    window, area, region = sidebar()
    with bpy.context.temp_override(window=window, area=area, region=region):  # its panel is closed at first
        bpy.ops.occlusion_bake.compare("INVOKE_DEFAULT")
    yield from until(running, 5.0, "a comparison")
    yield from until(lambda: not running(), 90.0, "the end of the comparison")
    lines = bpy.context.window_manager.occlusion_bake.lines
    check(
        "RMSE" in lines and f"{floor.name} Comparison" in image_names(), f"compared, and all that is shown is {lines}"
    )
    yield 1.0
    picture(str(folder / f"{name}_compared.png"))
    print(lines, flush=True)


def image_names() -> str:
    return ", ".join(image.name for image in bpy.data.images)


def check(right: bool, what: str) -> None:
    """Raises AssertionError; an assert statement would vanish under -O."""
    if not right:
        raise AssertionError(what)


if __name__ == "__main__":
    bpy.context.preferences.view.show_splash = False
    bpy.context.preferences.use_preferences_save = False
    given = sys.argv[sys.argv.index("--") + 1 :]
    act(session(given[0], Path(given[1]), given[2]))
