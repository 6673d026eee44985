"""Small files that many machines read and write, and what is said of those that cannot be read."""

from __future__ import annotations

import json
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ..base.atomic_file import refusal, replacing
from ..base.errors import InputError
from ..base.foreign_text import one_line

PLAN_AGAIN = "plan again"


def write_json(path: Path, content: Any, indent: int | None = None) -> None:
    """Write it whole, into a folder that is made where it is not there. Raises InputError."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as temporary:
            temporary.write_text(json.dumps(content, indent=indent) + "\n", encoding="utf-8")
    except OSError as error:
        raise refusal(path, error) from error


def json_of(path: Path) -> Any:
    """What a file holds; None where there is none, or no JSON in it."""
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None


@contextmanager
def broken_told(path: Path, line: str, cure: str) -> Iterator[None]:
    """What is raised of arrays that are missing, cut off or not as we write them becomes an InputError. line: what they
    are not, {} in it for the cause."""
    try:
        yield
    except OSError as error:
        raise unreadable(path, error, cure) from error
    except (ValueError, LookupError, TypeError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        raise InputError(f"{path}: {line.format(one_line(str(error)))}; {cure}") from error


def unreadable(path: Path, error: OSError, cure: str) -> InputError:
    """What to say of a file that is missing or may not be read."""
    return InputError(f"{path}: {one_line(error.strerror or str(error))}; {cure}")
