"""The version, read from the manifest, where alone it stands, and the algorithm's, which stands here."""

from __future__ import annotations

import tomllib
from functools import cache
from pathlib import Path

ALGORITHM = 1  # one more whenever a bake of the same input gets other bits: what was baked before is baked again then


@cache
def version() -> str:
    """Of the extension, as "1.2.3"."""
    manifest = Path(__file__).absolute().parents[2] / "blender_manifest.toml"
    return str(tomllib.loads(manifest.read_text(encoding="utf-8"))["version"])
