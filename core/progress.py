"""How far a bake is and the wish to stop it: written by the bake's thread, read and cancelled from any other."""

from __future__ import annotations

from .errors import Cancelled
from .kernel_api import Control


class Progress:
    """One bake of several objects. `control` is what the running kernel call looks at."""

    def __init__(self, objects: int = 1) -> None:
        self.control = Control()
        self.stage = "starting"
        self._objects = max(objects, 1)
        self._finished = 0

    def enter(self, stage: str) -> Control:
        """Begin a stage, as the artist reads it ("Suzanne: tracing"). Returns the control for its kernel call."""
        self.raise_if_cancelled()
        self.control.done = self.control.total = 0
        self.stage = stage
        return self.control

    def finish_object(self) -> None:
        """One object is done."""
        self._finished += 1
        self.control.done = self.control.total = 0

    def cancel(self) -> None:
        """Ask the bake to stop; the kernel does within 0.1 s."""
        self.control.cancel = 1

    def raise_if_cancelled(self) -> None:
        """Raises Cancelled after `cancel`."""
        if self.control.cancel:
            raise Cancelled

    @property
    def fraction(self) -> float:
        """Done so far, 0 to 1: whole objects plus the running stage's share of one."""
        total = self.control.total
        running = min(self.control.done / total, 1.0) if total > 0 else 0.0
        return min((self._finished + running) / self._objects, 1.0)
