"""Work in a process of its own: what it is asked goes over a pipe, how far it is and what became of it come back.

Much of what is done for charts is numpy, which keeps Python's global lock while it works, seconds with a dense mesh: in
a thread it would make Blender's window stutter all the same. A process of its own does not, and can be killed.
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
import traceback
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import ExitStack, suppress
from pathlib import Path
from threading import Thread
from typing import IO, Any

from ..base.errors import InputError, NoUnwrapper
from ..base.foreign_text import one_line
from .stages import Tell

PERIOD = 0.05  # seconds between two looks at whether to go on, and the least between two words of the child
BEGINNING = "making UV charts"  # the stage until the child says more

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

# What the child says, each in a pair with what belongs to it: a share and a stage; what it was asked for; the
# InputError's line; why it makes none, and a traceback.
_REACHED, _DONE, _REFUSED, _UNABLE = "reached", "done", "refused", "unable"
_WELL = (_DONE, _REFUSED)  # after which it may be asked again
TOO_LITTLE = "there is too little memory to make them"
# On Windows: the status of a process that the C library's abort has ended, and the first of those that crashed.
_ABORTED, _CRASHED = 3, 0x80000000
_COMPLAINT = 1 << 16  # bytes that are kept of what it writes to stderr, from the end


class NoAnswer(Exception):
    """No child could be asked, or it gave up without an answer; the message says why, with the child's stderr."""


class Child:
    """A process that is asked one thing after the other, by one thread at a time. It is started for the first of them,
    and anew after one that it did not survive; where the `with` ends, it does."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._complaint: _Complaint
        self._end = ExitStack()

    def __enter__(self) -> Child:
        return self

    def __exit__(self, *_: object) -> None:
        self.end()

    def end(self) -> None:
        """Kill it, if it is there."""
        self._process = None
        self._end.close()

    def ask(self, name: str, question: Any, progress: Tell) -> Any:
        """What it answers. question: what `answer` hands on there.

        Other threads run meanwhile. `progress` is called every 0.05 s in the calling thread with the share and stage
        that the child has told last; once it raises (Cancelled), the child is killed. Raises InputError as the child
        does; NoUnwrapper, naming `name`, where it is killed, crashes, lacks memory or has a fault of ours, as this
        process might, with its traceback in a note; NoAnswer where none can be asked: no Python of this release is
        found, a sandbox forbids it, that Python cannot load numpy.
        """
        try:
            return self._asked(name, question, progress)
        except OSError as error:
            if error.errno == errno.ENOMEM:
                raise NoUnwrapper(name, TOO_LITTLE) from error
            raise NoAnswer(str(error)) from error

    def _asked(self, name: str, question: Any, progress: Tell) -> Any:
        """As `ask`; raises OSError where no child can be started."""
        messages = [question] if self._is_there() else [self._start(), question]
        process, talk = self._process, _Talk(progress)
        assert process and process.stdin and process.stdout
        try:
            # Each pipe has a thread, so that none is ever full. What the child has not answered, its end ends.
            with ThreadPoolExecutor(2) as executor:
                is_well = False
                try:
                    sent = executor.submit(_send, process.stdin, *messages)
                    heard = executor.submit(talk.listen, process.stdout)
                    talk.wait_for(heard)
                    if talk.reply is None and heard.exception() is None:  # nothing more will be said
                        talk.wait_for_end(process)
                    is_well = talk.is_well
                finally:
                    if not is_well:
                        process.kill()  # does nothing to one that has ended
        finally:
            if not is_well:
                self.end()
        faults = [error for error in (sent.exception(), heard.exception()) if error is not None]
        if any(isinstance(error, MemoryError) for error in faults):
            raise NoUnwrapper(name, TOO_LITTLE) from faults[0]
        if faults:
            raise NoAnswer(f"what was said could not be understood ({one_line(repr(faults[0]))})")
        if talk.reply is not None:
            return _read(name, talk.reply)
        if (end := _violent_end(process.returncode)) is not None:
            time.sleep(PERIOD)  # a Ctrl-C goes to both, and need not have been heard here
            talk.pass_on()
            raise NoUnwrapper(name, f"the process that makes them {end}")
        raise NoAnswer(f"status {process.returncode}\n{self._complaint.text()}".strip())

    def _is_there(self) -> bool:
        return self._process is not None and self._process.poll() is None

    def _start(self) -> Any:
        """What it is to be sent first."""
        self.end()
        package = Path(__file__).absolute().parents[2]
        # -I: as in Blender, no PYTHON… variable and no user site; -B: nothing written beside the code.
        command = [_interpreter(), "-I", "-B", "-X", "utf8", "-c", _BOOT]
        # Without a console on Windows, and so without a window and the process that serves it, which inherits the pipes
        # where a child is killed as it starts (under Wine), and keeps them open.
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            creationflags=getattr(subprocess, "DETACHED_PROCESS", 0),
        )
        assert self._process.stderr
        self._end.enter_context(self._process)
        self._complaint = _Complaint(self._process.stderr)
        self._end.callback(self._complaint.text)
        self._end.callback(self._process.kill)  # the first of these to be done
        return sys.version_info[:2], str(package.parent), package.name, sys.path


def answer(do: Callable[[Any, Tell], Any]) -> None:
    """The child's side: questions on stdin; on stdout how far it is with one, and at last what became of it.

    All is pickled, and holds nothing of this package: it has another name in the parent. Once the parent is gone, there
    is no further question, and the next word to it ends this process. So does a fault.
    """
    with os.fdopen(os.dup(1), "wb") as out:
        os.dup2(2, 1)  # a library that prints must not disturb the answer
        became = _DONE
        while became in _WELL:
            try:
                question = pickle.load(sys.stdin.buffer)
            except EOFError:
                return
            except Exception as error:
                became, content = _unable(error)
            else:
                became, content = _became(do, question, _Word(out))
            pickle.dump((became, content), out, protocol=5)
            out.flush()
            del question, content  # which may be large, and nothing may be asked for long


def _became(do: Callable[[Any, Tell], Any], question: Any, word: _Word) -> tuple[str, Any]:
    """What becomes of a question."""
    try:
        return _DONE, do(question, word)
    except InputError as error:
        return _REFUSED, str(error)
    except Exception as error:
        return _unable(error)


def _unable(error: Exception) -> tuple[str, Any]:
    fault = one_line(f"{type(error).__name__}: {error}")
    why = TOO_LITTLE if isinstance(error, MemoryError) else f"the making of them broke down ({fault})"
    return _UNABLE, (why, traceback.format_exc())


class _Word:
    """Tells the parent how far the child is, each stage at once and shares now and then."""

    def __init__(self, out: IO[bytes]) -> None:
        self._out = out
        self._stage, self._due = "", 0.0

    def __call__(self, share: float, stage: str) -> None:
        now = time.monotonic()
        if stage == self._stage and now < self._due:
            return
        self._stage, self._due = stage, now + PERIOD
        self._out.write(pickle.dumps((_REACHED, (share, stage))))  # in one piece, from whichever thread
        self._out.flush()


def _interpreter() -> str:
    """A Python of this process' release. Raises NoAnswer where there is none.

    sys.executable is Blender itself in some builds and empty in others. The child checks its release.
    """
    prefix, release = Path(sys.prefix), f"python{sys.version_info[0]}.{sys.version_info[1]}"
    beside = [prefix / "bin" / release, prefix / "bin" / "python.exe", prefix / "python.exe"]
    for path in [Path(sys.executable or ""), *beside]:
        if path.is_absolute() and path.name.lower().startswith("python") and shutil.which(str(path)):
            return str(path)
    raise NoAnswer(f"no {release} at {prefix}")


class _Talk:
    """What a child says, heard in one thread and passed on in another. reply: the last of it, once it is there."""

    def __init__(self, progress: Tell) -> None:
        self.reply: tuple[str, Any] | None = None
        self._progress = progress
        self._reached = (0.0, BEGINNING)

    @property
    def is_well(self) -> bool:
        """Whether it can be asked again."""
        return self.reply is not None and self.reply[0] in _WELL

    def listen(self, pipe: IO[bytes]) -> None:
        """Until there is a reply, or none will come."""
        with suppress(EOFError, OSError):
            while self.reply is None:
                kind, content = pickle.load(pipe)
                if kind == _REACHED:
                    self._reached = content
                else:
                    self.reply = kind, content

    def pass_on(self) -> None:
        """How far the child is. Raises what whoever is told does."""
        self._progress(*self._reached)

    def wait_for(self, future: Future[Any]) -> None:
        """Passing on meanwhile. Raises what whoever is told does."""
        while not wait([future], PERIOD).done:
            self.pass_on()

    def wait_for_end(self, child: subprocess.Popen[bytes]) -> None:
        """As `wait_for`, of a process that need do no more than end."""
        while child.poll() is None:
            self.pass_on()
            with suppress(subprocess.TimeoutExpired):
                child.wait(PERIOD)


def _send(pipe: IO[bytes], *messages: Any) -> None:
    """Where that fails the pipe is closed, and the child, if it is there, ends."""
    try:
        for message in messages:
            pickle.dump(message, pipe, protocol=5)  # which writes arrays as they lie, without a copy
        pipe.flush()
    except OSError:  # a child that has ended reads nothing
        _close(pipe)
    except BaseException:
        _close(pipe)
        raise


def _close(pipe: IO[bytes]) -> None:
    with suppress(OSError):  # it may hold what nobody will read
        pipe.close()


class _Complaint:
    """The end of what is written to a pipe. It is read in a thread, which keeps no Blender from quitting."""

    def __init__(self, pipe: IO[bytes]) -> None:
        self._pieces: deque[bytes] = deque(maxlen=16)
        self._thread = Thread(target=self._read, args=[pipe], daemon=True)
        self._thread.start()

    def text(self) -> str:
        """Once nobody writes there any more."""
        self._thread.join()
        return b"".join(self._pieces).decode(errors="replace")

    def _read(self, pipe: IO[bytes]) -> None:
        while piece := pipe.read1(_COMPLAINT // 16):  # type: ignore[attr-defined]
            self._pieces.append(piece)


def _violent_end(status: int) -> str | None:
    """How a process was ended that did not end by itself."""
    if sys.platform == "win32" and status == _ABORTED:
        return "was ended (abort)"
    if status < 0:
        why = ", as systems do that run out of memory" if status == -signal.SIGKILL else ""
        return f"was ended ({signal.strsignal(-status)}{why})"
    return f"crashed (0x{status:X})" if status >= _CRASHED else None


def _read(name: str, reply: tuple[str, Any]) -> Any:
    became, content = reply
    if became == _REFUSED:
        raise InputError(content)
    if became == _UNABLE:
        why, trace = content
        error = NoUnwrapper(name, why)
        error.add_note(trace)
        raise error
    return content
