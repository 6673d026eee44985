"""Runs inside a Blender with a window, for try_window.py: `-- ZIP FOLDER NAME`.

Installs the extension, presses its buttons by mouse as an artist would (bake, cancel, compare), looks at what comes of
it, and leaves screenshots FOLDER/NAME_….png. It waits for what must come about, never for a time within which that may
have happened or not: machines are fast and slow.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))

from window_hand import Waits, act, check, in_view, install, key, open_tab, picture, press, sidebar, until
from window_pace import (
    ENDLESS,
    FEWEST,
    Beating,
    Pace,
    Pacing,
    beating,
    check_alive,
    ended,
    measured,
    modal_operator,
    running,
    share,
    stage,
    started,
    under_way,
)

# With the extension installed there is more than the stubs of Blender know.
context: Any = bpy.context
ops: Any = bpy.ops
UNDER = 0.169  # visibility half a metre below the middle of a square of 2 m: 1 less its form factor, 0.831
OPEN = 0.99  # and more in a far corner of the floor
_TELLING = 4.0  # seconds within which the drawings of a panel that grows are no large part


def session(archive: str, folder: Path, name: str) -> Waits:
    install(archive)
    floor = make_scene()
    yield from open_tab("Occlusion")
    pace = yield from cancelled(floor)
    yield from baked(floor, folder, name, pace)
    yield from skipped(floor, folder, name)
    yield from batched(floor, folder, name, pace)
    yield from charted(floor, folder, name)
    yield from compared(floor, folder, name)
    yield from disturbed(floor, pace)
    print(f"Blender {bpy.app.version_string}: the window bakes, cancels, compares and bears what comes", flush=True)
    yield from started()  # and quits with a bake under way


def make_scene() -> Any:
    """The default cube above a floor, which is selected."""
    bpy.data.objects["Cube"].location.z = 1.5
    bpy.ops.mesh.primitive_plane_add(size=12.0)
    chosen = context.scene.occlusion_bake
    chosen.width = chosen.height = 1024
    chosen.quality, chosen.rays = "RAYS", ENDLESS
    return context.object


def cancelled(floor: Any) -> Pacing:
    """Escape stops the bake at once and leaves no image and no material. Returns how fast it was."""
    yield from press("occlusion_bake.bake")
    yield from until(running, 5.0, "a bake after its button was pressed")
    yield from under_way(lambda: "tracing" in stage(), "its tracing")
    pace = yield from measured()
    asked, ended = when_cancelled()
    key("Escape")
    yield from until(lambda: bool(ended), 5.0, "the end of the bake after Escape")
    print(f"cancelled {ended[0] - asked[0]:.3f} s after Blender told of Escape", flush=True)
    check("AO" not in image_names() and not floor.data.materials, f"cancelled, but there are {image_names()}")
    return pace


def when_cancelled() -> tuple[list[float], list[float]]:
    """Will hold when the running bake was asked to stop, and when it had."""
    operator, progress = modal_operator().LongOperator._active, modal_operator().running()
    asked: list[float] = []
    ended: list[float] = []
    cancel, end = progress.cancel, type(operator)._end

    def cancelled() -> None:
        asked.append(time.monotonic())
        cancel()

    def ending(self: Any, context: Any) -> None:
        type(operator)._end = end
        end(self, context)
        ended.append(time.monotonic())

    progress.cancel, type(operator)._end = cancelled, ending
    return asked, ended


def baked(floor: Any, folder: Path, name: str, pace: Pace) -> Waits:
    """The window lives while the bake goes on; then the image holds the right values."""
    chosen = context.scene.occlusion_bake
    chosen.rays = pace.rays(10.0, chosen.width * chosen.height)
    print(f"{pace.rays_per_second / 1e6:.1f} million rays a second: bakes of {chosen.rays} rays a texel", flush=True)
    yield from press("occlusion_bake.bake")
    yield from until(running, 5.0, "a bake after its button was pressed")
    yield from under_way(lambda: share() > 0.2, "it could be looked at")
    picture(str(folder / f"{name}_baking.png"))
    yield 1.5  # the camera takes its time, too
    check_alive((yield from beating()), "while it bakes")
    width, height = bpy.data.images[f"{floor.name} AO"].size
    values = np.array(bpy.data.images[f"{floor.name} AO"].pixels).reshape(height, width, 4)[..., 0]
    middle = float(values[height // 2 - 8 : height // 2 + 8, width // 2 - 8 : width // 2 + 8].mean())
    check(abs(middle - UNDER) < 0.01, f"visibility {middle:.3f} below the cube, {UNDER} is right")
    check(float(values[:8, :8].mean()) > OPEN, f"visibility {values[:8, :8].mean():.3f} in the corner")
    check(bool(((values >= 0.0) & (values <= 1.0)).all()), "values outside [0, 1]")
    check(not floor.data.materials, "there is a material that nobody asked for")
    yield 1.0
    picture(str(folder / f"{name}_baked.png"))
    shown = context.window_manager.occlusion_bake
    shown.show = False
    yield from press("occlusion_bake.bake")
    yield from until(running, 5.0, "a bake after its button was pressed")
    yield from under_way(lambda: share() > 0.2, "its panel had grown, slowly where it is drawn in software")
    check_alive((yield from beating()), "and with nothing shown on the object")
    shown.show = True


def skipped(floor: Any, folder: Path, name: str) -> Waits:
    """With Skip Unchanged the floor is baked once, left as it is then, and baked again when what it sees has moved."""
    chosen = context.scene.occlusion_bake
    chosen.use_skip, chosen.rays = True, FEWEST
    for moved, is_left in ((0.0, False), (0.0, True), (0.25, False)):
        bpy.data.objects["Cube"].location.x += moved
        yield from press("occlusion_bake.bake")
        yield from ended("pressing the button with Skip Unchanged")
        check(("left as it is: 1 object" in lines()) == is_left, f"moved by {moved} the panel says: {lines()}")
        if is_left:
            yield 1.0
            picture(str(folder / f"{name}_skipped.png"))
    bpy.data.objects["Cube"].location.x -= 0.25
    chosen.use_skip = False


def compared(floor: Any, folder: Path, name: str) -> Waits:
    """The comparison starts a Blender of its own and shows both times, the errors and a picture."""
    chosen = context.scene.occlusion_bake
    chosen.width = chosen.height = 256
    chosen.rays, chosen.cycles_samples = 1024, 16
    window, area, region = sidebar()
    with context.temp_override(window=window, area=area, region=region):  # its panel is closed at first
        ops.occlusion_bake.compare("INVOKE_DEFAULT")
    yield from until(running, 5.0, "a comparison")
    yield from until(lambda: not running(), 90.0, "the end of the comparison")
    lines = context.window_manager.occlusion_bake.lines
    check(
        "RMSE" in lines and f"{floor.name} Comparison" in image_names(), f"compared, and all that is shown is {lines}"
    )
    yield 1.0
    picture(str(folder / f"{name}_compared.png"))
    print(lines, flush=True)
    check(len(context.window_manager.windows) == 2, "the comparison's picture is in no window")
    with context.temp_override(window=context.window_manager.windows[1]):
        bpy.ops.wm.window_close()
    yield 0.5


def batched(floor: Any, folder: Path, name: str, pace: Pace) -> Waits:
    """Four objects without UVs in one atlas, then a detailed mesh onto a plain one, by the real button."""
    chosen = context.scene.occlusion_bake
    chosen.width = chosen.height = 512
    chosen.rays = pace.rays(3.0, chosen.width * chosen.height)
    with in_view():
        bpy.ops.object.select_all(action="DESELECT")
    bodies = [body(i) for i in range(4)]
    chosen.layout, chosen.uv = "ATLAS", "CHARTS"
    yield from press("occlusion_bake.bake")
    yield from under_way(lambda: "tracing" in stage(), "an atlas' tracing")
    yield 1.0  # panels grow slowly
    picture(str(folder / f"{name}_queue.png"))
    yield from ended("pressing the button for four objects")
    check("Atlas AO" in image_names(), f"no atlas: {image_names()}; {lines()}")
    check(all("Occlusion Bake Atlas" in each.data.uv_layers for each in bodies), "an object without the atlas' UV map")
    yield 1.0
    picture(str(folder / f"{name}_atlas.png"))
    chosen.layout, chosen.source = "EACH", "SELECTED"
    chosen.rays = FEWEST
    low, high = bodies[0], bodies[1]
    high.location = low.location
    for each in bodies[2:]:
        each.select_set(False)
    context.view_layer.objects.active = low
    yield from press("occlusion_bake.bake")
    yield from ended("pressing the button for high to low")
    check(f"{low.name} AO" in image_names(), f"nothing from high to low: {image_names()}; {lines()}")
    occluders = lines().split("Occluders: ")[1].split("\n")[0].split(", ")
    check(high.name in occluders and low.name not in occluders, f"who occluded: {lines()}")
    yield 1.0
    picture(str(folder / f"{name}_high_to_low.png"))
    chosen.source, chosen.uv = "SELF", "ACTIVE"
    for each in bodies:
        bpy.data.objects.remove(each)
    floor.select_set(True)
    context.view_layer.objects.active = floor


def charted(floor: Any, folder: Path, name: str) -> Waits:
    """Escape while charts are made leaves a mesh as it was; left alone, they are made, and the panel says what."""
    context.scene.occlusion_bake.rays = ENDLESS
    ball = rock(8)
    yield from press("occlusion_bake.bake")
    yield from until(running, 5.0, "a bake after its button was pressed")
    yield from under_way(lambda: share() > 0.0, "the first of its charts")
    check("tracing" not in stage(), f"the charts were made before they could be cancelled: {stage()}")
    key("Escape")
    yield from until(lambda: not running(), 5.0, "the end of the charts after Escape")
    check(not ball.data.uv_layers, "cancelled, but there is a UV map")
    check(f"{ball.name} AO" not in image_names(), f"cancelled, but there are {image_names()}")
    gaps = yield from unwrapped(ball)
    if gaps.sum() < _TELLING:
        bpy.data.objects.remove(ball)
        ball = rock(9)
        gaps = yield from unwrapped(ball)
    check_alive(gaps, "while charts are made")
    print(lines(), flush=True)
    yield 1.0
    picture(str(folder / f"{name}_charts.png"))
    bpy.data.objects.remove(ball)
    floor.select_set(True)
    context.view_layer.objects.active = floor


def unwrapped(ball: Any) -> Beating:
    """Make charts, whose UV map is there then. Returns how long the window kept a timer waiting meanwhile."""
    with in_view():
        ops.occlusion_bake.unwrap("INVOKE_DEFAULT")
    gaps = yield from beating()
    check([layer.name for layer in ball.data.uv_layers] == ["Occlusion Bake"], f"no charts: {lines()}")
    check("charts in the UV map Occlusion Bake" in lines(), f"the panel says of charts: {lines()}")
    return gaps


def rock(subdivisions: int) -> Any:
    """A ball without UVs, which alone is selected."""
    with in_view():
        bpy.ops.object.select_all(action="DESELECT")
        bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=subdivisions, calc_uvs=False, location=(0.0, -4.0, 1.0))
    context.object.name = "Rock"
    return context.object


def body(number: int) -> Any:
    """A selected ball without UVs, each finer than the last."""
    with in_view():
        bpy.ops.mesh.primitive_ico_sphere_add(
            subdivisions=3 + number, calc_uvs=False, location=(3.0 * number - 4.5, -4.0, 0.5)
        )
    made = context.object
    for obj in [each for each in bpy.data.objects if each.name.startswith("Icosphere")]:
        obj.select_set(True)
    return made


def disturbed(floor: Any, pace: Pace) -> Waits:
    """What an artist may do while a bake goes on: it ends well, or with a line, and the window lives."""
    chosen = context.scene.occlusion_bake
    chosen.width = chosen.height = 1024
    chosen.rays = pace.rays(2.0, chosen.width * chosen.height)
    name = floor.name  # after an undo the object is another to Python
    yield from started()
    check(not ops.occlusion_bake.bake.poll(), "a second bake could be started")
    with in_view():
        bpy.ops.object.mode_set(mode="EDIT")
    yield from ended("baking in Edit Mode")
    check(floor.mode == "EDIT", f"the bake left the mode {floor.mode}")
    with in_view():
        bpy.ops.object.mode_set(mode="OBJECT")
        bpy.ops.ed.undo_push(message="Before")
        floor.location.z = -1.0
        bpy.ops.ed.undo_push(message="Moved")
    yield from started()
    with in_view():
        bpy.ops.ed.undo()
    yield from ended("undoing")
    yield from started()
    bpy.data.objects.remove(bpy.data.objects[name])
    yield from ended("removing the object")
    check(name in lines() and "removed" in lines(), f"the object was removed, and the panel says {lines()}")
    with in_view():
        bpy.ops.mesh.primitive_plane_add(size=12.0)
    context.scene.occlusion_bake.rays = ENDLESS
    yield from started()
    with in_view():
        bpy.ops.wm.read_homefile()
    yield 1.0
    check(not running(), "a bake goes on in another file")
    with in_view():
        bpy.ops.mesh.primitive_plane_add(size=12.0)
    chosen = context.scene.occlusion_bake
    chosen.quality, chosen.rays = "RAYS", ENDLESS


def lines() -> str:
    """What the panel says."""
    return str(context.window_manager.occlusion_bake.lines)


def image_names() -> str:
    return ", ".join(image.name for image in bpy.data.images)


if __name__ == "__main__":
    act(session)
