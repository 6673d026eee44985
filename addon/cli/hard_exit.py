"""The end of a process that has Blender as a module in it."""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
import traceback
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import NoReturn

from ...core.base.errors import InputError


def leave(status: int) -> NoReturn:
    """End at once, with all output written, and without what Blender has put into the temporary folder.

    At an ordinary exit bpy 4.5's static destructors now and then wait for ever for a thread of its sound system.
    """
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):  # who read it may be gone
            stream.flush()
    _remove_session_folder()
    os._exit(status)


def _remove_session_folder() -> None:
    """Blender's own, blender_XXXXXX, which it removes at an ordinary exit. Where it could make none, what it names is
    the folder for everybody's temporary files."""
    if "bpy" not in sys.modules:
        return
    folder = Path(sys.modules["bpy"].app.tempdir)
    if folder.match("blender_??????") and folder != Path(tempfile.gettempdir()):
        shutil.rmtree(folder, ignore_errors=True)


def run_and_exit(main: Callable[[Sequence[str]], int]) -> NoReturn:
    """Run a command line's `main` and leave with its status; bad input ends it with one line and status 2, a fault with
    what Python says of it and status 1."""
    status = 1
    try:
        status = main(sys.argv[1:])
    except InputError as refusal:
        sys.stderr.write(f"{refusal}\n")
        status = 2
    except SystemExit as request:  # --help, or a word that is not understood
        if isinstance(request.code, str):
            sys.stderr.write(f"{request.code}\n")
        else:
            status = request.code or 0
    except BaseException:
        traceback.print_exc()
    leave(status)
