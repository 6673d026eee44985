"""The sample scenes by name, and the command that writes them as .blend files."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import bpy

from ..addon.typed import scene_in
from . import foliage, nook, suzanne, thinwall, thousands
from .stage import Sample

SCENES: dict[str, Callable[[bpy.types.Scene], Sample]] = {
    "suzanne": suzanne.build,
    "nook": nook.build,
    "thousands": thousands.build,
    "thinwall": thinwall.build,
    "foliage": foliage.build,
}


def build(name: str) -> Sample:
    """Replace whatever file is open by the sample scene `name`, from Blender's empty factory file."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return SCENES[name](scene_in(bpy.context))


def write(name: str, folder: Path) -> Path:
    """Build the sample scene `name` and save it as name.blend in `folder`, made if missing."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder.resolve() / f"{name}.blend"
    build(name)
    preferences: Any = bpy.context.preferences
    preferences.filepaths.save_version = 0
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True)
    return path


def main(arguments: Sequence[str] | None = None) -> int:
    """The command line: names (all where none is given) and a folder."""
    parser = argparse.ArgumentParser(
        "python -m occlusion_bake.samples", description="Write sample scenes as .blend files."
    )
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"which: {', '.join(SCENES)} (all)")
    parser.add_argument("--folder", type=Path, default=Path(), help="where to (here)")
    chosen = parser.parse_args(arguments)
    unknown = [name for name in chosen.names if name not in SCENES]
    if unknown:
        parser.error(f"{unknown[0]}: no such sample scene; choose from {', '.join(SCENES)}")
    for name in chosen.names or SCENES:
        write(name, chosen.folder)
    return 0
