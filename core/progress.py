"""How far a bake is and the wish to stop it: written by the bake's thread, read and cancelled from any other."""

from __future__ import annotations

import time
from collections.abc import Callable
from copy import copy
from dataclasses import dataclass

from .base.arrays import Floats
from .base.errors import Cancelled
from .base.kernel_api import Control
from .scene.scene import Instance

_STEPS = 1000  # that a share is counted in
_EARLY = 0.03  # of a bake: before that what it took says little about what is left


@dataclass(frozen=True, eq=False)
class Preview:
    """The map that is being made of a target. values: (H, W) float32, 0 to 1, as far as it is now; below 0 where
    nothing has been traced yet, None while there is nothing new to see. May be asked for from another thread."""

    target: Instance
    values: Callable[[], Floats | None]


class Progress:
    """One bake of several objects. `control` is what the running kernel call looks at."""

    def __init__(self, objects: int = 1) -> None:
        self.control = Control()
        self.stage = "starting"
        self.preview: Preview | None = None
        self._objects = max(objects, 1)
        self._finished = 0
        self._part = (0, 1)  # which of how many parts of an object is being made
        self._span = (0.0, 0.0)  # of the whole, what the running stage goes through; one object, so read at once
        self._reached = 0.0
        self._start = self._entered = time.perf_counter()
        self._counts_rays = False

    def expect(self, objects: int) -> None:
        """How many objects are left, where that was not known at first."""
        self._objects = max(self._finished + objects, 1)

    def enter(self, stage: str, share: tuple[float, float] = (0.0, 0.0), *, rays: bool = False) -> Control:
        """Begin a stage, as the artist reads it ("Suzanne: tracing"). Returns the control for its kernel call.

        share: from where to where in the work on one object the stage leads, 0 to 1. rays: whether the kernel counts
        rays in it.
        """
        self.raise_if_cancelled()
        self._counts_rays = False
        self._measure(share)
        self.stage, self._entered, self._counts_rays = stage, time.perf_counter(), rays
        return self.control

    def reach(self, share: float, stage: str) -> None:
        """Within the stage that was entered: how much of it is done, 0 to 1, and what is being done. Raises Cancelled
        after `cancel`. May be called from another thread."""
        self.raise_if_cancelled()
        self.stage = stage
        self.control.total, self.control.done = _STEPS, round(share * _STEPS)

    def begin_part(self, number: int, count: int) -> None:
        """The shares of stages are those of one of so many parts of the object, from here on."""
        self._part = (number, count)

    def finish_object(self) -> None:
        """One object is done."""
        self._finished += 1
        self._part = (0, 1)
        self._measure((0.0, 0.0))

    def cancel(self) -> None:
        """Ask the bake to stop; the kernel does within 0.1 s."""
        self.control.cancel = 1

    def raise_if_cancelled(self) -> None:
        """Raises Cancelled after `cancel`."""
        if self.control.cancel:
            raise Cancelled

    @property
    def fraction(self) -> float:
        """Done so far, 0 to 1, never falling: whole objects plus the running stage's share of one."""
        start, end = self._span  # before done and total: those of a later stage then count as no more than this one's
        done, total = self.control.done, self.control.total
        running = min(done / total, 1.0) if total > 0 else 0.0
        self._reached = min(max(self._reached, start + (end - start) * running), 1.0)
        return self._reached

    @property
    def rays_per_second(self) -> float | None:
        """Of the running stage; None where it traces none, or has not yet."""
        done, seconds = self.control.done, time.perf_counter() - self._entered
        return done / seconds if self._counts_rays and done > 0 and seconds > 0.0 else None

    @property
    def seconds_left(self) -> float | None:
        """As the bake went so far; None while that says little."""
        fraction = self.fraction
        return (time.perf_counter() - self._start) * (1.0 - fraction) / fraction if fraction > _EARLY else None

    def _measure(self, share: tuple[float, float]) -> None:
        self.control.done = self.control.total = 0
        number, count = self._part
        start, end = ((number + part) / count for part in share)
        self._span = ((self._finished + start) / self._objects, (self._finished + end) / self._objects)


class Stages:
    """The stages in which the maps of one object are made, as parts of the bar.

    How many there will be nobody knows: each gets half of what is left, a bake of a given number of rays all of it.
    """

    def __init__(
        self, progress: Progress, target: Instance, span: tuple[float, float], *, plain: bool, own: float = 0.0
    ) -> None:
        """target: as it lies in the texture. span: of the object's work. plain: whether all is done after one round of
        rays. own: the share of the span that maps with rays of their own take, at its end."""
        self._progress, self._target, self._plain = progress, target, plain
        self._left, self._last = span
        self._end = self._last - own * (self._last - self._left)

    @property
    def control(self) -> Control:
        """What the running kernel call looks at."""
        return self._progress.control

    def before(self, share: float) -> Stages:
        """Stages that take a share of what is left, and come before all others of these."""
        first = copy(self)
        first._end = self._left = self._left + share * (self._end - self._left)
        return first

    def enter(self, stage: str, *, rays: bool = False) -> Control:
        """The next stage. rays: whether the kernel counts rays in it."""
        start, end = self._left, self._end if self._plain else 0.5 * (self._left + self._end)
        self._left = end
        return self._progress.enter(f"{self._target.name}: {stage}", (start, end), rays=rays)

    def enter_own(self, before: float, after: float) -> Control:
        """The stage of a map with rays of its own, from one share of it to another."""
        start, end = (self._end + share * (self._last - self._end) for share in (before, after))
        return self._progress.enter(f"{self._target.name}: tracing the directional code", (start, end), rays=True)

    def preview(self, values: Callable[[], Floats | None] | None) -> None:
        """Show a map as it is being made; None: nothing more."""
        self._progress.preview = None if values is None else Preview(self._target, values)
