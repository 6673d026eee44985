"""Export presets: how an engine takes our textures, as settings of the panel.

A preset says what a map's file is like, which way its bent normals tell directions, and which channel of a packed image
holds AO. docs/engines has a page for each, of its name, that says the same in words, where it goes in the engine, and
where that is known from.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ...core.maps.registry import MAPS


@dataclass(frozen=True)
class FileFormat:
    """How a map is written. path: a template, as in output/destination.py. format: as in core/finish/image_file.py.
    depth: bits a channel."""

    path: str
    format: str = "png"
    depth: int = 8


@dataclass(frozen=True)
class BentNormalFormat:
    """How bent normals are written. y, space: as the panel names them. alpha: AO in their fourth channel."""

    file: FileFormat
    y: str
    space: str = "TANGENT"
    alpha: bool = False


@dataclass(frozen=True)
class EnginePreset:
    """A preset. name: that of its page. ao: None where it stays in the file, for the glTF exporter. bent: None where
    the engine has no place for them. packed: the channel of a packed image that AO belongs into."""

    name: str
    label: str
    ao: FileFormat | None
    bent: BentNormalFormat | None
    packed: str


_FILES = FileFormat("//textures/{object}_{map}")
_UNREAL = FileFormat("//textures/T_{object}_{map}")

PRESETS = (
    EnginePreset("gltf", "glTF", ao=None, bent=None, packed="R"),
    EnginePreset("godot", "Godot", _FILES, BentNormalFormat(_FILES, y="UP"), packed="R"),
    EnginePreset("unreal", "Unreal", _UNREAL, BentNormalFormat(_UNREAL, y="DOWN"), packed="R"),
    EnginePreset("unity_hdrp", "Unity HDRP", _FILES, BentNormalFormat(_FILES, y="UP"), packed="G"),
    EnginePreset("three_js", "three.js", _FILES, bent=None, packed="R"),
)


def panel_settings(preset: EnginePreset, *, packed: bool = False) -> dict[str, Any]:
    """What a preset sets in the panel, by the names of its properties; all else stays as it is.

    packed: AO goes into the channel of an image that is there, in place of files. That takes AO alone.
    """
    if packed:
        maps = dict.fromkeys([*(entry.switch for entry in MAPS if entry.switch), "use_light"], False)
        return {**maps, "use_ao": True, "output": "CHANNEL", "channel": preset.packed, "use_dither": True}
    return {"use_ao": True, "use_gltf": preset.ao is None, **_output(preset.ao), **_bent(preset.bent)}


def _output(file: FileFormat | None) -> dict[str, Any]:
    if file is None:
        return {"output": "PACKED"}
    return {
        "output": "SAVED",
        "path": file.path,
        "format": file.format.upper(),
        "depth": str(file.depth),
        "use_dither": True,
    }


def _bent(bent: BentNormalFormat | None) -> dict[str, Any]:
    if bent is None:
        return {"use_bent": False}
    return {"use_bent": True, "bent_space": bent.space, "bent_y": bent.y, "bent_alpha": bent.alpha}
