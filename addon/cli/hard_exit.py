"""The end of a process that has Blender as a module in it."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from typing import NoReturn

from ...core.base.errors import InputError


def leave(status: int) -> NoReturn:
    """End at once, with all output written.

    At an ordinary exit bpy 4.5's static destructors now and then wait for ever for a thread of its sound system.
    """
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)


def run_and_exit(main: Callable[[Sequence[str]], int]) -> NoReturn:
    """Run a command line's `main` and leave with its status; bad input ends it with one line and status 2."""
    try:
        status = main(sys.argv[1:])
    except InputError as refusal:
        sys.stderr.write(f"{refusal}\n")
        status = 2
    leave(status)
