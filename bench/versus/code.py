"""Which state of our code a point was measured with: a page is written from runs of many days."""

from __future__ import annotations

import hashlib
from functools import cache

from ..pages import ROOT

_SOURCES = ("core/**/*.py", "core/kernel/src/*", "core/kernel/include/*")


@cache
def state_of_code() -> str:
    """Eight hexadecimal digits that tell states of the core and its kernel apart."""
    digest = hashlib.blake2b(digest_size=4)
    for file in sorted(file for pattern in _SOURCES for file in ROOT.glob(pattern)):
        digest.update(file.read_bytes())
    return digest.hexdigest()
