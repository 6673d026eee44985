"""What keeps bakes from this system, told before the first is asked for."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

from ...core.base.errors import InputError
from ...core.finish.image_file import openimageio
from ...core.rays.embree import open_device

# Embree comes through the kernel: where that cannot be loaded it says so.
_LIBRARIES: tuple[Callable[[], object], ...] = (open_device, openimageio)


@cache
def missing_libraries() -> tuple[str, ...]:
    """A line for each library that cannot be loaded: which, why, the cure. They are loaded by it, once a session."""
    return tuple(line for load in _LIBRARIES if (line := _refusal(load)))


def _refusal(load: Callable[[], object]) -> str:
    try:
        load()
    except InputError as refusal:
        return str(refusal)
    return ""
