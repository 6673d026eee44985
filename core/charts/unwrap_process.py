"""The unwrap in a process of its own.

xatlas keeps Python's global lock while it works, seconds to minutes with a dense mesh: in a thread it would freeze
Blender's window all the same, and nothing could stop it. A process can be killed.
"""

from __future__ import annotations

import errno
import os
import pickle
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import asdict
from pathlib import Path
from typing import Any

from ..base.arrays import Floats, Ints
from ..base.errors import Cancelled, InputError, NoUnwrapper
from .unwrap import Charts, Stretch, unwrap

# Seconds between two looks at `cancelled`.
PERIOD = 0.05

# What the child runs. The parent's name for the package (bl_ext.…) means nothing there, so the child imports the folder
# by its own name. It does so with nothing else on the path: beside an installed extension lie all the others.
_BOOT = """
import importlib, pickle, sys
release, home, package, path = pickle.load(sys.stdin.buffer)
if sys.version_info[:2] != release:
    sys.exit(f"Python {release} was wanted, this is {sys.version}")
own, sys.path[:] = sys.path[:], [home]
importlib.import_module(package)
sys.path[:] = path + own
importlib.import_module(package + ".core.charts.unwrap_process").answer()
"""


_DONE, _REFUSED, _UNABLE = "done", "refused", "unable"  # what became of it
_TOO_LITTLE = "there is too little memory to make them"
_CRASHED = 0x80000000  # on Windows: the first of the statuses of processes that crashed


class _NoAnswer(Exception):
    """No child could be asked, or it gave up without an answer; the message says why, with the child's stderr."""


def unwrap_in_process(
    name: str,
    vertices: Floats,
    triangles: Ints,
    polygons: Ints | None,
    size: int | tuple[int, int],
    padding: int,
    *,
    cancelled: Callable[[], bool],
) -> Charts:
    """`charts.unwrap` in a process of its own: the same arguments, the same bits, the same InputError.

    Other threads run meanwhile. `cancelled` is asked every 0.05 s, in the calling thread; once it says True the process
    is killed and Cancelled raised.

    Where no child can be asked (no Python of this release is found, a sandbox forbids it, that Python cannot load
    numpy), the unwrap runs in this process: the window then stands still and `cancelled` waits for the end, but the
    artist gets charts wherever there are any to be had. If that fails too, the error has a note of what the child wrote
    to stderr. Where the child is killed, crashes or lacks memory, so might this process: that raises NoUnwrapper.
    """
    arguments = (name, vertices, triangles, polygons, size, padding)
    if cancelled():
        raise Cancelled
    try:
        return _asked(arguments, cancelled)
    except (OSError, _NoAnswer) as error:
        if isinstance(error, OSError) and error.errno == errno.ENOMEM:
            raise NoUnwrapper(name, _TOO_LITTLE) from error
        why = f"The unwrap in a process of its own failed: {error}"
    if cancelled():  # the same Ctrl-C may have ended the child
        raise Cancelled
    try:
        return unwrap(*arguments)
    except Exception as error:
        error.add_note(why)
        raise


def answer() -> None:
    """The child's side: arguments of `unwrap` on stdin; on stdout what became of it, and the fields of its Charts, the
    InputError's line, or why xatlas makes none.

    Both are pickled, and hold nothing of this package: it has another name in the parent.
    """
    with os.fdopen(os.dup(1), "wb") as out:
        os.dup2(2, 1)  # a library that prints must not disturb the answer
        reply: tuple[str, str | dict[str, Any]]
        try:
            reply = _DONE, asdict(unwrap(*pickle.load(sys.stdin.buffer)))
        except NoUnwrapper as error:
            reply = _UNABLE, error.why
        except MemoryError:
            reply = _UNABLE, _TOO_LITTLE
        except InputError as error:
            reply = _REFUSED, str(error)
        pickle.dump(reply, out)


def _interpreter() -> str:
    """A Python of this process' release. Raises _NoAnswer where there is none.

    sys.executable is Blender itself in some builds and empty in others. The child checks its release.
    """
    prefix, release = Path(sys.prefix), f"python{sys.version_info[0]}.{sys.version_info[1]}"
    beside = [prefix / "bin" / release, prefix / "bin" / "python.exe", prefix / "python.exe"]
    for path in [Path(sys.executable or ""), *beside]:
        if path.is_absolute() and path.name.lower().startswith("python") and shutil.which(str(path)):
            return str(path)
    raise _NoAnswer(f"no {release} at {prefix}")


def _asked(arguments: tuple[Any, ...], cancelled: Callable[[], bool]) -> Charts:
    """Ask a child. Raises InputError, NoUnwrapper, Cancelled, _NoAnswer, and OSError where none can be started."""
    package = Path(__file__).absolute().parents[2]
    head = (sys.version_info[:2], str(package.parent), package.name, sys.path)
    request = pickle.dumps(head) + pickle.dumps(arguments)
    # -I: as in Blender, no PYTHON… variable and no user site; -B: nothing written beside the code.
    command = [_interpreter(), "-I", "-B", "-X", "utf8", "-c", _BOOT]
    child = subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
    )
    # communicate() with a timeout would forget what it has not sent by then, so it waits in a thread. The thread is
    # left before the child, whose end ends it.
    with child, ThreadPoolExecutor(1) as executor:
        try:
            talk = executor.submit(child.communicate, request)
            _wait_for(talk, cancelled)
        finally:
            child.kill()  # does nothing to one that has ended
    reply, complaint = talk.result()
    if (end := _violent_end(child.returncode)) is not None:
        time.sleep(PERIOD)  # a Ctrl-C goes to both, and need not have been heard here
        if cancelled():
            raise Cancelled
        raise NoUnwrapper(arguments[0], f"xatlas, which makes them, {end}")
    if child.returncode != 0:
        raise _NoAnswer(f"status {child.returncode}\n{complaint.decode(errors='replace')}".strip())
    return _read(arguments[0], reply)


def _violent_end(status: int) -> str | None:
    """How a process was ended that did not end by itself."""
    if status < 0:
        why = ", as systems do that run out of memory" if status == -signal.SIGKILL else ""
        return f"was ended ({signal.strsignal(-status)}{why})"
    return f"crashed (0x{status:X})" if status >= _CRASHED else None


def _wait_for(talk: Future[Any], cancelled: Callable[[], bool]) -> None:
    while not wait([talk], PERIOD).done:
        if cancelled():
            raise Cancelled


def _read(name: str, reply: bytes) -> Charts:
    became, content = pickle.loads(reply)
    if became == _REFUSED:
        raise InputError(content)
    if became == _UNABLE:
        raise NoUnwrapper(name, content)
    return Charts(**{**content, "stretch": Stretch(**content["stretch"])})
