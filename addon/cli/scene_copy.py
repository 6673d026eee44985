"""A copy of the scene as it is now, beside what was baked."""

from __future__ import annotations

from pathlib import Path

import bpy

from ...core.base.atomic_file import refusal, replacing
from ...core.base.errors import InputError
from ..operator_errors import cause_of


def save_copy(path: Path, what: str) -> None:
    """Write it whole. what: of use in it, for the line where that fails. Raises InputError."""
    try:
        with replacing(path) as temporary:  # uncompressed: on a full disk Blender takes a compressed stump for success
            bpy.ops.wm.save_as_mainfile(filepath=str(temporary), copy=True, compress=False)
    except OSError as error:
        raise refusal(path, error) from error
    except RuntimeError as error:
        cause = cause_of(error)
        raise InputError(f"{path}: the {what} cannot be saved ({cause}); check that the disk has room") from error
