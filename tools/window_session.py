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
# With the extension installed there is more than the stubs of Blender know.
context: Any = bpy.context
ops: Any = bpy.ops
UNDER = 0.169  # visibility half a metre below the middle of a square of 2 m: 1 less its form factor, 0.831
OPEN = 0.99  # and more in a far corner of the floor


def session(archive: str, folder: Path, name: str) -> Waits:
    install(archive)
    floor = make_scene()
    yield from open_tab("Occlusion")
    yield from cancelled(floor)
    yield from baked(floor, folder, name)
    yield from batched(floor, folder, name)
    yield from charted(floor, folder, name)
    yield from compared(floor, folder, name)
    yield from rebuilt(floor, folder)
    yield from disturbed(floor)
    print(f"Blender {bpy.app.version_string}: the window bakes, cancels, compares and bears what comes", flush=True)
    yield from started()  # and quits with a bake under way


def install(archive: str) -> None:
    """Without saving the preferences: a comparison's own Blender must do without them."""
    window, _, _ = sidebar()
    with context.temp_override(window=window):
        bpy.ops.extensions.package_install_files(filepath=archive, repo="user_default", enable_on_install=True)


def make_scene() -> Any:
    """The default cube above a floor, which is selected."""
    bpy.data.objects["Cube"].location.z = 1.5
    bpy.ops.mesh.primitive_plane_add(size=12.0)
    chosen = context.scene.occlusion_bake
    chosen.width = chosen.height = 1024
    chosen.quality, chosen.rays = "RAYS", 1024  # a bake long enough to be looked at and cancelled
    return context.object


def running() -> bool:
    return importlib.import_module(f"{MODULE}.addon.ui.modal_operator").running() is not None


def cancelled(floor: Any) -> Waits:
    """Escape stops the bake at once and leaves no image and no material."""
    yield from press("occlusion_bake.bake")
    yield from until(running, 5.0, "a bake after its button was pressed")
    yield 0.7
    asked, ended = when_cancelled()
    key("Escape")
    yield from until(lambda: bool(ended), 5.0, "the end of the bake after Escape")
    print(f"cancelled {ended[0] - asked[0]:.3f} s after Blender told of Escape", flush=True)
    check("AO" not in image_names() and not floor.data.materials, f"cancelled, but there are {image_names()}")


def gaps(when: str) -> Waits:
    """How long the window keeps a timer of 0.03 s waiting, until the bake ends."""
    beats: list[float] = []
    while running():
        beats.append(time.monotonic())
        yield 0.03
    check(len(beats) > 10, f"the window came to life {len(beats)} times in a bake")
    waits = np.diff(beats)
    most, longest, long = np.quantile(waits, 0.99), waits.max(), np.count_nonzero(waits > 0.1)
    print(f"{when}: 99 of 100 gaps within {most:.3f} s, the longest {longest:.3f} s, {long} of {len(waits)} over 0.1 s")


def when_cancelled() -> tuple[list[float], list[float]]:
    """Will hold when the running bake was asked to stop, and when it had."""
    modal = importlib.import_module(f"{MODULE}.addon.ui.modal_operator")
    operator, progress = modal.LongOperator._active, modal.running()
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


def baked(floor: Any, folder: Path, name: str) -> Waits:
    """The window lives while the bake goes on; then the image holds the right values."""
    yield from press("occlusion_bake.bake")
    yield from until(running, 5.0, "a bake after its button was pressed")
    yield 1.5
    picture(str(folder / f"{name}_baking.png"))
    check(running(), "the bake was over before it could be looked at")
    yield 1.5  # the camera takes its time, too
    yield from gaps("while it bakes")
    width, height = bpy.data.images[f"{floor.name} AO"].size
    values = np.array(bpy.data.images[f"{floor.name} AO"].pixels).reshape(height, width, 4)[..., 0]
    middle = float(values[height // 2 - 4 : height // 2 + 4, width // 2 - 4 : width // 2 + 4].mean())
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
    yield 2.5  # the panel grows slowly where it is drawn in software
    yield from gaps("and with nothing shown on the object")
    shown.show = True


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


def rebuilt(floor: Any, folder: Path) -> Waits:
    """RO from a code is in EEVEE what it is in Cycles, about normals too that turn within pixels, where a table that
    is filtered tells."""
    chosen = context.scene.occlusion_bake
    chosen.width = chosen.height = 16  # texels larger than pixels, for their mip maps are right to differ
    chosen.use_ao, chosen.use_code, chosen.use_material = False, True, True
    yield from started()
    yield from ended("baking a code")
    tree = floor.active_material.node_tree
    group, end = (next(node for node in tree.nodes if node.type == kind) for kind in ("GROUP", "OUTPUT_MATERIAL"))
    light, normal = tree.nodes.new("ShaderNodeEmission"), tree.nodes.new("ShaderNodeNewGeometry").outputs["Position"]
    turned = ("MULTIPLY", (12, 12, 12)), ("SINE",), ("MULTIPLY_ADD", (0.4, 0.4, 0), (0, 0, 1)), ("NORMALIZE",)
    for operation, *operands in turned:
        node = tree.nodes.new("ShaderNodeVectorMath")
        node.operation = operation
        for operand, socket in zip(operands, node.inputs[1:], strict=False):
            socket.default_value = operand
        tree.links.new(normal, node.inputs[0])
        normal = node.outputs["Vector"]
    tree.links.new(normal, group.inputs["Normal"])
    tree.links.new(group.outputs["RO"], light.inputs["Color"])
    tree.links.new(light.outputs[0], end.inputs["Surface"])
    bpy.data.objects["Cube"].hide_render = True
    eevee = rendered("BLENDER_EEVEE" if bpy.app.version >= (5, 0) else "BLENDER_EEVEE_NEXT", folder / "eevee.exr")
    cycles = rendered("CYCLES", folder / "cycles.exr")
    seen = (eevee[:, 3] == 1.0) & (cycles[:, 3] == 1.0)
    apart = np.abs(eevee - cycles)[seen, 0]
    check(seen.sum() > 1000 and cycles[seen, 0].std() > 0.05, "the pictures of the code show nothing")
    check(apart.max() < 0.03, f"RO in EEVEE is up to {apart.max():.3f} off Cycles'")
    print(f"RO in EEVEE: within {apart.max():.4f} of Cycles, RMSE {np.sqrt((apart**2).mean()):.5f}", flush=True)
    chosen.use_ao, chosen.use_code, chosen.use_material = True, False, False


def rendered(engine: str, path: Path) -> Any:
    """(64², 4) values in the middles of pixels, not filtered."""
    scene, image = context.scene, context.scene.render.image_settings
    scene.render.engine, scene.render.filter_size, scene.eevee.taa_render_samples = engine, 0.0, 1
    scene.cycles.samples, scene.cycles.use_denoising = 1, False
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BOX", 0.01
    scene.render.resolution_x = scene.render.resolution_y = 64
    scene.render.film_transparent, scene.view_settings.view_transform = True, "Raw"
    image.file_format, image.color_depth, image.color_mode = "OPEN_EXR", "32", "RGBA"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    made = bpy.data.images.load(str(path))
    values = np.array(made.pixels).reshape(-1, 4)
    bpy.data.images.remove(made)
    path.unlink()
    return values


def batched(floor: Any, folder: Path, name: str) -> Waits:
    """Four objects without UVs in one atlas, then a detailed mesh onto a plain one, by the real button."""
    chosen = context.scene.occlusion_bake
    chosen.width = chosen.height = 512
    chosen.rays = 256
    with in_view():
        bpy.ops.object.select_all(action="DESELECT")
    bodies = [body(i) for i in range(4)]
    chosen.layout, chosen.uv = "ATLAS", "CHARTS"
    yield from press("occlusion_bake.bake")
    yield from until(lambda: "tracing" in stage(), 60.0, "an atlas' tracing")
    yield 1.0  # panels grow slowly
    picture(str(folder / f"{name}_queue.png"))
    yield from ended("pressing the button for four objects")
    check("Atlas AO" in image_names(), f"no atlas: {image_names()}; {lines()}")
    check(all("Occlusion Bake Atlas" in each.data.uv_layers for each in bodies), "an object without the atlas' UV map")
    yield 1.0
    picture(str(folder / f"{name}_atlas.png"))
    chosen.layout, chosen.source = "EACH", "SELECTED"
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
    with in_view():
        bpy.ops.object.select_all(action="DESELECT")
        bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=7, calc_uvs=False, location=(0.0, -4.0, 1.0))
    ball = context.object
    ball.name = "Rock"
    yield from press("occlusion_bake.bake")
    yield from until(running, 5.0, "a bake after its button was pressed")
    yield 1.0
    check(running() and "tracing" not in stage(), f"the charts were made before they could be cancelled: {stage()}")
    key("Escape")
    yield from until(lambda: not running(), 2.0, "the end of the charts after Escape")
    check(not ball.data.uv_layers, "cancelled, but there is a UV map")
    check(f"{ball.name} AO" not in image_names(), f"cancelled, but there are {image_names()}")
    with in_view():
        ops.occlusion_bake.unwrap("INVOKE_DEFAULT")
    yield from gaps("while charts are made")
    check([layer.name for layer in ball.data.uv_layers] == ["Occlusion Bake"], f"no charts: {lines()}")
    check("charts in the UV map Occlusion Bake" in lines(), f"the panel says of charts: {lines()}")
    print(lines(), flush=True)
    yield 1.0
    picture(str(folder / f"{name}_charts.png"))
    bpy.data.objects.remove(ball)
    floor.select_set(True)
    context.view_layer.objects.active = floor


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


def stage() -> str:
    progress = importlib.import_module(f"{MODULE}.addon.ui.modal_operator").running()
    return progress.stage if progress is not None else ""


def disturbed(floor: Any) -> Waits:
    """What an artist may do while a bake goes on: it ends well, or with a line, and the window lives."""
    chosen = context.scene.occlusion_bake
    chosen.width = chosen.height = 1024
    chosen.rays = 256
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
    yield from started()
    with in_view():
        bpy.ops.wm.read_homefile()
    yield 1.0
    check(not running(), "a bake goes on in another file")
    with in_view():
        bpy.ops.mesh.primitive_plane_add(size=12.0)
    chosen = context.scene.occlusion_bake
    chosen.quality, chosen.rays = "RAYS", 256


def started() -> Waits:
    """A bake of the selected object, as its button starts it."""
    with in_view():
        ops.occlusion_bake.bake("INVOKE_DEFAULT")
    yield from until(running, 5.0, "a bake")
    yield 0.5


def ended(after: str) -> Waits:
    yield from until(lambda: not running(), 60.0, f"the end of the bake after {after}")


def in_view() -> Any:
    """The 3D view's context, as for a person over it."""
    window, area, region = sidebar()
    return context.temp_override(window=window, area=area, region=region)


def lines() -> str:
    """What the panel says."""
    return str(context.window_manager.occlusion_bake.lines)


def image_names() -> str:
    return ", ".join(image.name for image in bpy.data.images)


def check(right: bool, what: str) -> None:
    """Raises AssertionError; an assert statement would vanish under -O."""
    if not right:
        raise AssertionError(what)


if __name__ == "__main__":
    context.preferences.view.show_splash = False
    context.preferences.use_preferences_save = False
    given = sys.argv[sys.argv.index("--") + 1 :]
    act(session(given[0], Path(given[1]), given[2]))
