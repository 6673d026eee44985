"""The version, read from the manifest, where alone it stands."""

from __future__ import annotations

import tomllib
from functools import cache
from pathlib import Path


@cache
def version() -> str:
    """Of the extension, as "1.2.3"."""
    manifest = Path(__file__).absolute().parents[2] / "blender_manifest.toml"
    return str(tomllib.loads(manifest.read_text(encoding="utf-8"))["version"])
