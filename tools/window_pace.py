"""How far what runs in the window is, and how fast, for window_session.py: bakes that are long enough to be looked at,
cancelled and disturbed on any machine are of as many rays as this one traces meanwhile."""

from __future__ import annotations

import importlib
import time
from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from window_hand import Waits, check, in_view, until

MODULE = "bl_ext.user_default.occlusion_bake"
ENDLESS = 1 << 20  # rays a texel, the most there are: a bake that does not end before it is cancelled
ops: Any = bpy.ops  # with the extension installed there is more than the stubs of Blender know
FEWEST = 64  # rays a texel: the mean of 256 texels is off by 0.003 then
_HELD = 0.2  # of the time: a single drawing in software takes less of it, on a machine however loaded


@dataclass(frozen=True)
class Pace:
    """How many rays a second this machine traces while its window lives."""

    rays_per_second: float

    def rays(self, seconds: float, texels: int) -> int:
        """A texel's, of a map that is traced in about so long."""
        return min(max(round(seconds * self.rays_per_second / texels), FEWEST), ENDLESS)


Floats = np.ndarray[Any, np.dtype[np.float64]]
Pacing = Generator[float, None, Pace]
Beating = Generator[float, None, Floats]


def modal_operator() -> Any:
    """The extension's own module of operators that run while the window lives."""
    return importlib.import_module(f"{MODULE}.addon.ui.modal_operator")


def running() -> bool:
    return modal_operator().running() is not None


def stage() -> str:
    """Empty where nothing runs."""
    progress = modal_operator().running()
    return progress.stage if progress is not None else ""


def share() -> float:
    """How much of it is done, 0 to 1; 1 where nothing runs."""
    progress = modal_operator().running()
    return progress.fraction if progress is not None else 1.0


def started() -> Waits:
    """A bake of the selected object, as its button starts it."""
    with in_view():
        ops.occlusion_bake.bake("INVOKE_DEFAULT")
    yield from until(running, 5.0, "a bake")
    yield from until(lambda: "tracing" in stage() or not running(), 60.0, "its tracing")


def ended(after: str) -> Waits:
    yield from until(lambda: not running(), 90.0, f"the end of the bake after {after}")


def under_way(reached: Callable[[], bool], what: str) -> Waits:
    """Wait until what runs has come so far. Raises AssertionError where it ends before."""
    yield from until(lambda: reached() or not running(), 60.0, what)
    check(running(), f"all was over before {what}")


def measured() -> Pacing:
    """Of a bake that traces, once the window has drawn its panel."""
    control = modal_operator().running().control
    yield 2.5  # in which the panel grows
    done, start = control.done, time.monotonic()
    yield 1.0
    pace = Pace((control.done - done) / (time.monotonic() - start))
    check(running() and pace.rays_per_second > 0.0, f"no rays were traced within a second: {stage()}")
    return pace


def beating() -> Beating:
    """Let a timer of 0.03 s beat until nothing runs. Returns how long the window kept it waiting, each time."""
    beats = [time.monotonic()]
    while running():
        yield 0.03
        beats.append(time.monotonic())
    return np.diff(beats)


def check_alive(gaps: Floats, when: str) -> None:
    """Most of the time passed in gaps that are a small part of it."""
    whole = gaps.sum()
    held = gaps[gaps > _HELD * whole].sum()
    check(len(gaps) > 1 and held <= 0.5 * whole, f"{when}: the window was held up for {held:.1f} of {whole:.1f} s")
    during = gaps[:-1]  # in the last, what was made is written
    most, longest, long = np.quantile(during, 0.99), during.max(), np.count_nonzero(during > 0.1)
    print(
        f"{when}: 99 of 100 gaps within {most:.3f} s, the longest {longest:.3f} s, {long} of {len(during)} over 0.1 s",
        flush=True,
    )
