"""How far the making of charts is, told while it goes on, and whether it shall stop."""

from __future__ import annotations

from collections.abc import Callable
from threading import Event, Thread
from types import TracebackType

from ..base.kernel_api import Control

Tell = Callable[[float, str], None]  # a share between 0 and 1, and what is being done; raises Cancelled to stop it

_PERIOD = 0.05  # seconds between two words


class Stages:
    """The stages of one piece of work; a context in which a thread tells how far it is.

    Kernel calls inside take `control`: their counts are told as shares of the running stage, and they stop once whoever
    is told raises. That exception is raised again where the context ends, and at the next stage.
    """

    def __init__(self, tell: Tell | None) -> None:
        """tell: called from the thread, about every 0.05 s, and at the start of every stage."""
        self.control = Control()
        self._tell = tell
        self._stage, self._start, self._end = "", 0.0, 0.0
        self._reached = 0.0
        self._refusal: BaseException | None = None
        self._done = Event()
        self._watcher = Thread(target=self._watch, name="occlusion-bake-stages", daemon=True)

    def __enter__(self) -> Stages:
        if self._tell is not None:
            self._watcher.start()
        return self

    def __exit__(self, _: type[BaseException] | None, error: BaseException | None, __: TracebackType | None) -> None:
        self._done.set()
        if self._watcher.is_alive():
            self._watcher.join()
        if self._refusal is not None and error is not self._refusal:
            raise self._refusal

    def enter(self, stage: str, start: float, end: float) -> Control:
        """Begin a stage, which leads from one share of the whole work to another. Raises what whoever is told has
        raised. Returns the control for its kernel calls."""
        self.control.done = self.control.total = 0
        self._stage, self._start, self._end = stage, start, end
        self._say()
        if self._refusal is not None:
            raise self._refusal
        return self.control

    def _watch(self) -> None:
        while not self._done.wait(_PERIOD):
            self._say()

    def _say(self) -> None:
        if self._tell is None or not self._stage or self._refusal is not None:
            return
        done, total = self.control.done, self.control.total
        share = min(done / total, 1.0) if total > 0 else 0.0
        try:
            # A stage may be many calls, each of which counts from 0.
            self._reached = max(self._reached, self._start + (self._end - self._start) * share)
            self._tell(self._reached, self._stage)
        except BaseException as refusal:
            self._refusal = refusal
            self.control.cancel = 1
