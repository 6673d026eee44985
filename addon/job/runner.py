"""Long work in steps: those that need Blender on the main thread, the others in a thread of their own.

The work is a generator. What it does itself runs on the main thread; what it yields, a function without arguments, runs
in the thread and its result comes back as the value of the yield. Who drives it decides how to wait: a timer in the
window, a loop in the background.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import suppress
from signal import Signals
from typing import Any

from ...core.progress import Progress
from .stop_signals import CTRL_C, handled

Steps = Generator[Callable[[], Any], Any, None]

_NICE = 10  # of 19: the window is drawn first, even in software, and the bake gets nearly all else


class Runner:
    """Drives the steps. `poll` from the main thread until it is True; then everything is done or has been raised."""

    def __init__(self, steps: Steps, progress: Progress, *, give_way: bool = False) -> None:
        """give_way: the thread, and those it starts, get the processor when nobody else wants it; Linux alone can."""
        self.progress = progress
        self._steps = steps
        initializer = _give_way if give_way and sys.platform == "linux" else None
        self._pool = ThreadPoolExecutor(1, "occlusion-bake", initializer)
        self._running: Future[Any] | None = None

    def poll(self) -> bool:
        """Go on with the work where nothing is running. Raises what the work raises, and is closed then."""
        if self._running is not None and not self._running.done():
            return False
        try:
            self._running = self._pool.submit(self._next())
        except StopIteration:
            self.close()
            return True
        except BaseException:
            self.close()
            raise
        return False

    def wait(self, seconds: float) -> None:
        """Sleep until the running function is done, or so long."""
        if self._running is not None:
            wait([self._running], seconds)

    def close(self) -> None:
        """Stop whatever runs and wait for it; may be called at any time, and twice."""
        if self._running is not None and not self._running.done():
            self.progress.cancel()
        self._pool.shutdown(wait=True)
        self._steps.close()

    def _next(self) -> Callable[[], Any]:
        """The next function to run, after handing over the last one's result or exception."""
        last, self._running = self._running, None
        if last is None:
            return next(self._steps)
        error = last.exception()
        return self._steps.throw(error) if error is not None else self._steps.send(last.result())


def _give_way() -> None:
    """Lower the calling thread's priority; on Linux 0 is that thread, and those it starts are born with the same."""
    with suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, 0, _NICE)


def run(
    steps: Steps,
    progress: Progress,
    show: Callable[[Progress], None] | None = None,
    signals: Sequence[Signals] = CTRL_C,
) -> None:
    """Do all the work before returning. The signals cancel it. `show` is called a few times a second."""
    runner = Runner(steps, progress)
    with handled(signals, lambda *_: progress.cancel()):
        while not runner.poll():
            if show is not None:
                show(progress)
            runner.wait(0.05)
