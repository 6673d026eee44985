"""What the command says, how it ends, and how it is ended."""

from __future__ import annotations

import errno
import io
import sys
import time
import traceback
from collections.abc import Callable
from enum import IntEnum
from typing import TextIO

from ...core.base.errors import Cancelled, InputError
from ...core.progress import Progress
from ..job.stop_signals import STOPPING, interrupted_by

NAME = "occlusion_bake"
_CLEAR = "\r\x1b[K"


class Status(IntEnum):
    """That the command ends with. FAULT: one of ours. IN_PART: some objects were refused, or are missing, and all
    others are done."""

    DONE = 0
    FAULT = 1
    BAD_INPUT = 2
    CANCELLED = 3
    IN_PART = 4


def guarded(body: Callable[[], int]) -> int:
    """The status of a command's body, what it raises told in a line."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # a terminal may lack letters of an object's name
            stream.reconfigure(errors="backslashreplace")
    try:
        with interrupted_by(STOPPING):
            return body()
    except InputError as error:
        complain(error)
        return Status.BAD_INPUT
    except (Cancelled, KeyboardInterrupt):  # the latter before and after the bake
        complain("cancelled")
        return Status.CANCELLED
    except BrokenPipeError:  # who reads what is said has left, as `head` does
        return Status.CANCELLED
    except SystemExit as request:  # --help
        return int(request.code or 0)
    except MemoryError as error:
        complain(f"{error or 'not enough memory'}; bake fewer objects or a smaller image")
        return Status.FAULT
    except Exception:
        traceback.print_exc()
        return Status.FAULT


def complain(line: object) -> None:
    say(f"{NAME}: {line}", sys.stderr)


def say(line: str, stream: TextIO | None = None) -> None:
    """Print a line, in the place of the progress on a terminal. Raises BrokenPipeError where nobody reads it."""
    stream = stream or sys.stdout
    try:
        print(f"{_CLEAR if stream.isatty() else ''}{line}", file=stream, flush=True)
    except OSError as error:
        if error.errno == errno.EINVAL:  # as Windows has it
            raise BrokenPipeError from error
        raise


class ProgressLine:
    """Progress on the terminal: one line that is written over; elsewhere a line for each stage."""

    def __init__(self) -> None:
        self._stage = ""
        self._due = 0.0

    def show(self, progress: Progress) -> None:
        if sys.stdout.isatty():
            now = time.monotonic()
            if now >= self._due:
                self._due = now + 0.1
                print(f"{_CLEAR}{100.0 * progress.fraction:5.1f} %  {progress.stage}", end="\r", flush=True)
        elif progress.stage != self._stage:
            self._stage = progress.stage
            say(f"{100.0 * progress.fraction:5.1f} %  {progress.stage}")
