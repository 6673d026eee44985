"""Operators whose work goes on while the window lives: one at a time, with progress, cancelled by Escape."""

from __future__ import annotations

from typing import Any, ClassVar

import bpy

from ..core.errors import Cancelled, InputError
from ..core.progress import Progress
from .runner import Runner, Steps, run

_TICK = 0.05  # seconds between two looks at the work


class LongOperator:
    """Mixed into an operator: `start` gives its steps. `execute` does them at once, `invoke` while the window lives."""

    _active: ClassVar[LongOperator | None] = None

    def start(self, context: bpy.types.Context, progress: Progress) -> Steps:
        """The work to do. Raises InputError where it cannot begin."""
        raise NotImplementedError

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if LongOperator._active is not None:
            cls.poll_message_set("A bake is running")  # type: ignore[attr-defined]
            return False
        if not any(obj.type == "MESH" for obj in chosen_objects(context)):
            cls.poll_message_set("Select a mesh object")  # type: ignore[attr-defined]
            return False
        return True

    def execute(self: Any, context: bpy.types.Context) -> set[str]:
        """At once: in the background, from scripts."""
        progress = Progress()
        try:
            run(self.start(context, progress), progress)
        except (InputError, Cancelled, MemoryError, RuntimeError) as error:
            return self._failed(context, error)
        return {"FINISHED"}

    def invoke(self: Any, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """In the window: the work goes on between events."""
        if bpy.app.background:
            return self.execute(context)
        self._progress = Progress()
        try:
            self._runner = Runner(self.start(context, self._progress), self._progress)
        except InputError as error:
            return self._failed(context, error)
        LongOperator._active = self
        self._timer = context.window_manager.event_timer_add(_TICK, window=context.window)
        context.window_manager.modal_handler_add(self)
        context.window_manager.occlusion_bake.running = True
        return {"RUNNING_MODAL"}

    def modal(self: Any, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Everything but our timer and Escape goes on to Blender."""
        if event.type == "ESC" and event.value == "PRESS":
            self._progress.cancel()
            return {"RUNNING_MODAL"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        try:
            finished = self._runner.poll()
        except (InputError, Cancelled, MemoryError, RuntimeError) as error:
            self._end(context)
            return self._failed(context, error)
        except BaseException:
            self._end(context)
            raise
        if finished:
            self._end(context)
            return {"FINISHED"}
        self._show(context)
        return {"PASS_THROUGH"}

    def cancel(self: Any, context: bpy.types.Context) -> None:
        """Blender ends the operator: another file is loaded, the window closes."""
        self._end(context)

    def _show(self: Any, context: bpy.types.Context) -> None:
        shown = context.window_manager.occlusion_bake
        shown.fraction, shown.stage = self._progress.fraction, self._progress.stage
        percent = 100.0 * self._progress.fraction
        context.workspace.status_text_set(f"Occlusion Bake  {percent:.0f} %  {self._progress.stage}   Esc: cancel")
        redraw(context)

    def _end(self: Any, context: bpy.types.Context) -> None:
        if LongOperator._active is not self:
            return
        LongOperator._active = None
        self._runner.close()
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.occlusion_bake.running = False
        if context.workspace is not None:
            context.workspace.status_text_set(None)
        redraw(context)

    def _failed(self: Any, context: bpy.types.Context, error: BaseException) -> set[str]:
        if isinstance(error, Cancelled):
            self.report({"INFO"}, "Cancelled; nothing was changed")
        else:
            self.report({"ERROR"}, str(error) or "not enough memory; bake a smaller image")
        return {"CANCELLED"}


def stop_all() -> None:
    """End what is running; for unregistering."""
    if LongOperator._active is not None:
        LongOperator._active._end(bpy.context)


def chosen_objects(context: bpy.types.Context) -> list[bpy.types.Object]:
    """The selected objects, or the active one where none is."""
    selected = list(context.selected_objects)
    active = context.view_layer.objects.active
    return selected or ([active] if active is not None else [])


def redraw(context: bpy.types.Context) -> None:
    """Let the panels show what is new."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in {"VIEW_3D", "IMAGE_EDITOR", "PROPERTIES"}:
                area.tag_redraw()
