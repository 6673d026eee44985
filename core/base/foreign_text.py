"""Text that others have written: names of files, messages, JSON."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from .errors import InputError


def one_line(text: str) -> str:
    """The first."""
    return text.strip().split("\n")[0].strip()


def check_utf8(name: Path | str) -> None:
    """Refuse a name with bytes that are not UTF-8: neither Blender's names nor OpenImageIO's files can be called so.
    Raises InputError."""
    try:
        str(name).encode()
    except UnicodeEncodeError as error:  # each such byte stands in it as a lone surrogate
        raise InputError(f"{name}: a byte of this name is not UTF-8; rename it, or give another") from error


def json_object(text: object) -> dict[str, Any]:
    """The object that a text holds; {} where it holds none, be it broken, nested too deep, or no text at all."""
    try:
        found = json.loads(text) if isinstance(text, str) else {}
    except (ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}
