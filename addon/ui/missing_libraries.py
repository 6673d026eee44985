"""What keeps bakes from this system, told before the first is asked for."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

from ...core.base.errors import InputError
from ...core.base.kernel_api import library
from ...core.finish.image_file import openimageio
from ...core.rays.embree import open_device

# Embree comes through the kernel: without that nothing is to be said of it.
_CHAINS: tuple[tuple[Callable[[], object], ...], ...] = ((library, open_device), (openimageio,))


@cache
def missing_libraries() -> tuple[str, ...]:
    """A line for each library that cannot be loaded: which, why, the cure. They are loaded by it, once a session."""
    return tuple(line for chain in _CHAINS if (line := _first_refusal(chain)))


def _first_refusal(chain: tuple[Callable[[], object], ...]) -> str:
    try:
        for load in chain:
            load()
    except InputError as refusal:
        return str(refusal)
    return ""
