"""The lines by which render farms' engines follow a task, on request.

Open Job Description reads `openjd_progress:` (percent) and `openjd_status:` at the beginning of a line of stdout;
Flamenco's workers read `Saved: 'FILE'`, as Blender prints when it renders.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from ...core.progress import Progress
from .terminal import ProgressLine, say

OPENJD, FLAMENCO = ENGINES = ("openjd", "flamenco")


class EngineLines:
    """For one engine, or for none."""

    def __init__(self, engine: str | None) -> None:
        self._engine = engine
        self._percent = -1
        self._stage = ""

    def show(self, line: ProgressLine, progress: Progress) -> None:
        """The usual line, and the engine's."""
        line.show(progress)
        if self._engine == OPENJD:
            self._reach(int(100.0 * progress.fraction))
            if progress.stage != self._stage:
                self._stage = progress.stage
                say(f"openjd_status: {progress.stage}")

    def saved(self, files: Iterable[Path]) -> None:
        """Files that are written."""
        if self._engine == FLAMENCO:
            for file in files:
                say(f"Saved: '{file}'")

    def end(self) -> None:
        """All is done."""
        if self._engine == OPENJD:
            self._reach(100)

    def _reach(self, percent: int) -> None:
        if percent > self._percent:
            self._percent = percent
            say(f"openjd_progress: {percent}")
