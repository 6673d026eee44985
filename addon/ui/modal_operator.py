"""Operators whose work goes on while the window lives: one at a time, with progress, cancelled by Escape."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar, Literal

import bpy

from ...core.base.errors import Cancelled, InputError
from ...core.progress import Progress
from ..job.runner import Runner, Steps, run
from ..operator_errors import cause_of, is_refusal
from ..read.block_ref import BlockRef
from ..typed import Ended, OperatorMixin, window_manager_in
from .properties import redraw, result_in, show_lines
from .request import chosen_objects
from .translate import say

_TICK = 0.05  # seconds between two looks at the work
_STOPS = 0.15  # within which what is cancelled has ended, mostly
_SHOWN = 0.3  # and between two drawings of how far it is, at least
_LOOKED = 1.0  # and between two of the work itself: they redraw the whole view
_HELD = 0.04  # of the time, at most, may the window be held up by either: drawn in software they take long

_FORESEEN = (InputError, Cancelled, MemoryError, ReferenceError)


class LongOperator(OperatorMixin):
    """Mixed into an operator: `start` gives its steps. `execute` does them at once, `invoke` while the window lives."""

    _active: ClassVar[Any] = None
    states: Any = MappingProxyType({})  # by object (BlockRef): how far each is, where there are several

    def start(self, context: bpy.types.Context, progress: Progress) -> Steps:
        """The work to do. Raises InputError where it cannot begin."""
        raise NotImplementedError

    def preview(self, context: bpy.types.Context, progress: Progress) -> bool:
        """Show the work as far as it is; called now and then while it goes on. Returns whether there was anything."""
        return False

    @classmethod
    def is_idle(cls) -> bool:
        """For `poll`: whether nothing runs; what does is told."""
        if running() is not None:
            cls.poll_message_set("A bake is running")
            return False
        return True

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not cls.is_idle():
            return False
        if not any(obj.type == "MESH" for obj in chosen_objects(context)):
            cls.poll_message_set("Select a mesh object")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> Ended:
        """At once: in the background, from scripts."""
        progress = Progress()
        try:
            run(self.start(context, progress), progress)
        except Exception as error:
            if not _is_foreseen(error):
                raise
            return self._failed(context, error)
        return {"FINISHED"}

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Ended:
        """In the window: the work goes on between events."""
        if bpy.app.background:
            return self.execute(context)
        self._progress = Progress()
        self._runner = Runner(self.start(context, self._progress), self._progress, give_way=True)
        self._due, self._look, self._looked, self._said = 0.0, 0.0, 0.0, ""
        self._asked: list[str] = []  # what was asked to be drawn at the last event
        self._timer = window_manager_in(context).event_timer_add(_TICK, window=context.window)
        window_manager_in(context).modal_handler_add(self)
        LongOperator._active = self
        self._show(context)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> Ended:
        """Everything but our timer and Escape goes on to Blender."""
        escaped = event.type == "ESC" and event.value == "PRESS"
        if escaped:  # the end is at hand, and the next event may have to wait until all views are drawn
            self._progress.cancel()
            self._runner.wait(_STOPS)
        elif event.type != "TIMER":
            return {"PASS_THROUGH"}
        try:
            finished = self._runner.poll()
        except BaseException as error:
            self._end(context)
            if not _is_foreseen(error):
                raise
            # Where the cure is to press once more, no pop-up may lie over the button.
            asked = result_in(context).asked
            return self._failed(context, error, "WARNING" if asked else "ERROR")
        if finished:
            self._end(context)
            return {"FINISHED"}
        self._show(context)
        return {"RUNNING_MODAL"} if escaped else {"PASS_THROUGH"}

    def cancel(self, context: bpy.types.Context) -> None:
        """Blender ends the operator: another file is loaded, the window closes."""
        self._end(context)

    def _show(self, context: bpy.types.Context) -> None:
        """Let the work, and how far it is, be drawn where they are due. How long the last drawing held up the window,
        until this event, tells when the next one may be: a window that waits for its drawing answers nobody."""
        now = time.monotonic()
        if self._asked:
            pause = (now - self._looked) / _HELD
            if "words" in self._asked:
                self._due = now + max(_SHOWN, pause)
            if "work" in self._asked:
                self._look = now + max(_LOOKED, pause)
        self._asked, self._looked = [], now
        if now >= self._look and self.preview(context, self._progress):
            self._asked.append("work")
        text = ", ".join([percent(self._progress), *progress_words(self._progress)])
        if text != self._said and now >= self._due:
            self._said = text
            self._asked.append("words")
            if context.workspace is not None:
                context.workspace.status_text_set(say("Occlusion Bake   {}   Esc: Cancel", text))
            redraw(context, "VIEW_3D")

    def _end(self, context: bpy.types.Context) -> None:
        if LongOperator._active is not self:
            return
        LongOperator._active = None
        self._runner.close()
        window_manager_in(context).event_timer_remove(self._timer)
        for workspace in bpy.data.workspaces:  # the artist may have gone to another in the meantime
            workspace.status_text_set(None)
        redraw(context, "VIEW_3D", "IMAGE_EDITOR")

    def _failed(
        self, context: bpy.types.Context, error: BaseException, level: Literal["WARNING", "ERROR"] = "ERROR"
    ) -> Ended:
        if isinstance(error, Cancelled):
            self.report({"INFO"}, "Cancelled; nothing was changed")
            return {"CANCELLED"}
        line = str(error) or "not enough memory; bake a smaller image"
        if isinstance(error, RuntimeError):
            line = f"Blender refused ({cause_of(error)})"
        if isinstance(error, ReferenceError):
            line = "What was being baked was removed, perhaps by an undo; bake again"
        show_lines(context, [line])
        self.report({level}, line)
        return {"CANCELLED"}


def _is_foreseen(error: BaseException) -> bool:
    """Whether it says for itself what happened; what does not is shown with its traceback."""
    return isinstance(error, _FORESEEN) or is_refusal(error)


def running() -> Progress | None:
    """How far the running operator is, None where none runs."""
    return LongOperator._active._progress if LongOperator._active is not None else None


def queue() -> Mapping[BlockRef, str]:
    """The objects of the running operator, in turn, and how far each is (job/bake_job.py)."""
    active = LongOperator._active
    return dict(active.states) if active is not None else {}


def percent(progress: Progress) -> str:
    """As "42 %"."""
    return f"{100.0 * progress.fraction:.0f} %"


def progress_words(progress: Progress) -> list[str]:
    """For the artist: "Suzanne: tracing", "3 s left", "12.3 million rays a second", as far as is known."""
    name, parted, stage = progress.stage.rpartition(": ")
    words = [f"{name}{parted}{say(stage)}"]
    if (left := progress.seconds_left) is not None:
        words.append(say("{} left", _duration(left)))
    if (rate := progress.rays_per_second) is not None:
        words.append(say("{:.1f} million rays a second", rate / 1e6))
    return words


def _duration(seconds: float) -> str:
    """ "7 s", "3 min", "2 h"."""
    if seconds < 100.0:
        return f"{math.ceil(seconds)} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.0f} h"


def stop_all() -> None:
    """End what is running; for unregistering."""
    if LongOperator._active is not None:
        LongOperator._active._end(bpy.context)
