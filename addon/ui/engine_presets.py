"""Export presets: how an engine takes our textures, as settings of the panel.

A preset says what a map's file is like, which way its bent normals tell directions, and which channel of a packed image
holds AO. docs/engines has a page for each, of its name, that says the same in words, where it goes in the engine, and
where that is known from.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Picture:
    """How a map is written. path: a template, as in output/destination.py. format: as in core/finish/image_file.py.
    depth: bits a channel."""

    path: str
    format: str = "png"
    depth: int = 8


@dataclass(frozen=True)
class BentPicture:
    """How bent normals are written. y, space: as the panel names them. alpha: AO in their fourth channel."""

    picture: Picture
    y: str
    space: str = "TANGENT"
    alpha: bool = False


@dataclass(frozen=True)
class Export:
    """A preset. name: that of its page. ao: None where it stays in the file, for the glTF exporter. bent: None where
    the engine has no place for them. packed: the channel of a packed image that AO belongs into."""

    name: str
    label: str
    ao: Picture | None
    bent: BentPicture | None
    packed: str


_FILES = Picture("//textures/{object}_{map}")
_UNREAL = Picture("//textures/T_{object}_{map}")

EXPORTS = (
    Export("gltf", "glTF", ao=None, bent=None, packed="R"),
    Export("godot", "Godot", _FILES, BentPicture(_FILES, y="UP"), packed="R"),
    Export("unreal", "Unreal", _UNREAL, BentPicture(_UNREAL, y="DOWN"), packed="R"),
    Export("unity_hdrp", "Unity HDRP", _FILES, BentPicture(_FILES, y="UP"), packed="G"),
    Export("three_js", "three.js", _FILES, bent=None, packed="R"),
)


def panel_settings(export: Export, *, packed: bool = False) -> dict[str, Any]:
    """What a preset sets in the panel, by the names of its properties; all else stays as it is.

    packed: AO goes into the channel of an image that is there, in place of files. That takes AO alone.
    """
    if packed:
        others = dict.fromkeys(("use_ro", "use_bent", "use_code", "use_light"), False)
        return {"use_ao": True, **others, "output": "CHANNEL", "channel": export.packed, "use_dither": True}
    return {"use_ao": True, "use_gltf": export.ao is None, **_output(export.ao), **_bent(export.bent)}


def _output(picture: Picture | None) -> dict[str, Any]:
    if picture is None:
        return {"output": "PACKED"}
    return {
        "output": "SAVED",
        "path": picture.path,
        "format": picture.format.upper(),
        "depth": str(picture.depth),
        "use_dither": True,
    }


def _bent(bent: BentPicture | None) -> dict[str, Any]:
    if bent is None:
        return {"use_bent": False}
    return {"use_bent": True, "bent_space": bent.space, "bent_y": bent.y, "bent_alpha": bent.alpha}
