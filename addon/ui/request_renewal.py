"""What images keep of their bakes, and objects of their images, brought up to date when a file is saved or loaded.

Objects are kept by session id, name and library: names are those at saving, ids those of the session, so that what is
renamed in one session is known in the next.
"""

from __future__ import annotations

import json
from contextlib import suppress
from typing import Any

import bpy

from ...core.base.foreign_text import json_object
from ..output.ownership import renew_holders
from ..read.block_ref import Renewal
from ..typed import library_of, persistent
from .request import KEPT, is_ours


@persistent
def renew(*_: object) -> None:
    """Of all images of ours in the file, and all objects that hold one."""
    renew_holders()
    renewal = Renewal()
    for image in bpy.data.images:
        if is_ours(image) and library_of(image) is None:
            with suppress(ValueError, KeyError, TypeError):  # kept by another version
                kept = json_object(image[KEPT])
                kept["roles"]["objects"] = renewal.of(kept["roles"]["objects"])
                image[KEPT] = json.dumps(kept)


def start() -> None:
    """Renew from now on."""
    for handlers in _handlers():
        handlers.append(renew)


def stop() -> None:
    """Renew no more."""
    for handlers in _handlers():
        handlers.remove(renew)


def _handlers() -> tuple[Any, Any]:
    return bpy.app.handlers.save_pre, bpy.app.handlers.load_post
