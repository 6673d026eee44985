"""Files into Blender, for the command."""

from __future__ import annotations

import io
from collections.abc import Callable
from contextlib import redirect_stderr
from pathlib import Path

import bpy

from ...core.base.atomic_file import leads_to
from ...core.base.errors import InputError
from ..job.stop_signals import STOPPING, interrupted_by
from ..operator_errors import cause_of

_IMPORTERS: dict[str, Callable[[str], object]] = {
    ".obj": lambda path: bpy.ops.wm.obj_import(filepath=path),
    ".ply": lambda path: bpy.ops.wm.ply_import(filepath=path),
    ".stl": lambda path: bpy.ops.wm.stl_import(filepath=path),
    ".glb": lambda path: bpy.ops.import_scene.gltf(filepath=path),
    ".gltf": lambda path: bpy.ops.import_scene.gltf(filepath=path),
}


def load(path: Path) -> None:
    """Open a .blend file, or import another into an empty scene.

    Raises InputError, one line that names the file, where it is missing, of an unknown kind, or not what its name says.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such file; check the path")
    kind = path.suffix.lower()
    if kind != ".blend" and kind not in _IMPORTERS:
        raise InputError(f"{path}: unknown kind of file; give .blend, {', '.join(_IMPORTERS)}")
    absolute = str(leads_to(path))
    try:
        with interrupted_by(STOPPING):
            _read(absolute, kind)
    except (RuntimeError, UnicodeDecodeError) as error:
        how = ", uncompressed" if kind in (".glb", ".gltf") else ""
        raise InputError(
            f"{path}: cannot be read as {kind} ({cause_of(error)}); see that it is whole, or save it anew{how}"
        ) from error
    if kind != ".blend" and not any(obj.type == "MESH" for obj in bpy.data.objects):
        raise InputError(f"{path}: holds no mesh that can be read as {kind}; check that it is what its name says")


def _read(absolute: str, kind: str) -> None:
    if kind == ".blend":
        bpy.ops.wm.open_mainfile(filepath=absolute, load_ui=False)
        return
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    with redirect_stderr(io.StringIO()):  # where Blender prints an importer's traceback, beside raising it
        _IMPORTERS[kind](absolute)
