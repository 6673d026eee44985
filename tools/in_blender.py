"""Runs inside Blender, or Blender as a module, for try_extension.py: `-- VERB [ARGUMENT…]`, several parted by `--`.

install ZIP: install and enable the extension. again: switch it off and on. check FOLDER: its wheels import, from
within FOLDER. version NUMBER: it is this one. update NUMBER: bake, take what its repository offers, which is this one,
and bake again. scene FILE: save a small scene. command FILE ARGUMENT…: call the extension's command on FILE. operator:
bake the default cube. charts: bake it without its UV map.
"""

from __future__ import annotations

import importlib
import os
import sys
import traceback
from collections.abc import Callable
from itertools import groupby
from pathlib import Path
from typing import Any

import bpy

EXTENSION, PANEL = "occlusion_bake", "OCCLUSION_BAKE_PT_bake"
# With the extension installed there is more than the stubs of Blender know.
context: Any = bpy.context
ops: Any = bpy.ops
WHEELS = ("OpenImageIO", "embreex", "occlusion_bake_kernel")


def install(path: str) -> None:
    bpy.ops.extensions.package_install_files(filepath=path, repo="user_default", enable_on_install=True)


def module() -> str:
    """What the enabled extension is called, from whichever repository. SystemExit where it is not enabled."""
    found = [each.module for each in context.preferences.addons if each.module.endswith(f".{EXTENSION}")]
    if len(found) != 1:
        raise SystemExit(f"{EXTENSION} is enabled {len(found)} times: {', '.join(found)}")
    return str(found[0])


def check(folder: str) -> None:
    module()
    for name in WHEELS:
        origin = importlib.import_module(name).__file__ or ""
        if not Path(origin).is_relative_to(folder):
            raise SystemExit(f"{name} is not the extension's own but {origin}")
    library = importlib.import_module("occlusion_bake_kernel").library_path()
    importlib.import_module("ctypes").CDLL(str(library))
    python = ".".join(map(str, sys.version_info[:3]))
    print(f"Blender {bpy.app.version_string}, Python {python}: enabled, its wheels import, the kernel loads")


def version(wanted: str) -> None:
    found = importlib.import_module(f"{module()}.core.base.version").version()
    if found != wanted:
        raise SystemExit(f"it is {found}, and should be {wanted}")


def update(wanted: str) -> None:
    """While the old one's libraries are loaded."""
    operator()
    ops.extensions.repo_sync_all()
    ops.extensions.package_upgrade_all(use_active_only=False)
    version(wanted)
    for image in list(bpy.data.images):
        bpy.data.images.remove(image)
    operator()


def again() -> None:
    """Switched off it leaves nothing, and on again it works."""
    name = module()
    ops.preferences.addon_disable(module=name)
    if hasattr(bpy.types, PANEL) or hasattr(bpy.types.Scene, EXTENSION):
        raise SystemExit("switched off, but its panel or its settings are still there")
    ops.preferences.addon_enable(module=name)
    if not hasattr(bpy.types, PANEL):
        raise SystemExit("switched on again, but its panel is not there")


def scene(path: str) -> None:
    """A cube on a floor, both with UVs."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_plane_add(size=4.0)
    bpy.ops.mesh.primitive_cube_add(size=1.0, location=(0.0, 0.0, 0.5))
    bpy.ops.wm.save_as_mainfile(filepath=path)


def command(path: str, *arguments: str) -> None:
    status = importlib.import_module(f"{module()}.addon.cli.command").main([path, *arguments])
    if status:
        raise SystemExit(f"the command ended with {status}")


def operator() -> None:
    """The operator bakes the cube of the default scene and leaves a picture of it."""
    cube: Any = bpy.data.objects["Cube"]
    context.view_layer.objects.active = cube
    cube.select_set(True)
    before = {image.name for image in bpy.data.images}
    if (result := ops.occlusion_bake.bake()) != {"FINISHED"}:
        raise SystemExit(f"bpy.ops.occlusion_bake.bake() gave {result}")
    left = [image for image in bpy.data.images if image.name not in before and min(image.size) > 0]
    if not left:
        raise SystemExit("bpy.ops.occlusion_bake.bake() left no image")
    print(f"the operator left {', '.join(f'{image.name} {tuple(image.size)}' for image in left)}")


def in_the_wrong_place(*_: Any, **__: Any) -> None:
    raise SystemExit("charts were to be made in Blender's own process")


def charts() -> None:
    """The operator makes a UV map where there is none; in a process of its own, which finds all that it needs among
    what the extension brought along."""
    apart: Any = importlib.import_module(f"{module()}.core.charts.unwrap_process")
    apart.unwrap = in_the_wrong_place
    cube: Any = bpy.data.objects["Cube"]
    context.view_layer.objects.active = cube
    for layer in list(cube.data.uv_layers):
        cube.data.uv_layers.remove(layer)
    try:
        ops.occlusion_bake.bake()
    except RuntimeError as refusal:
        raise SystemExit(f"a mesh without UVs was refused: {refusal}") from refusal
    print(f"the operator made the UV map {cube.data.uv_layers[0].name}")


VERBS: dict[str, Callable[..., None]] = {
    "install": install,
    "check": check,
    "version": version,
    "update": update,
    "again": again,
    "scene": scene,
    "command": command,
    "operator": operator,
    "charts": charts,
}


def main(arguments: list[str]) -> None:
    for parted, words in groupby(arguments, lambda word: word == "--"):
        if not parted:
            verb, *rest = words
            VERBS[verb](*rest)


def as_module(arguments: list[str]) -> None:
    """`main`, then the end at once: Blender as a module now and then hangs in its destructors."""
    status = 1
    try:
        main(arguments)
        status = 0
    except SystemExit as refusal:
        print(refusal.code, file=sys.stderr)
    except BaseException:
        traceback.print_exc()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)


if __name__ == "__main__":
    (main if bpy.app.binary_path else as_module)(sys.argv[sys.argv.index("--") + 1 :])
