"""The making of charts, and their laying out, in a process of its own."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import asdict
from functools import partial
from typing import Any, TypeVar

from ..base.arrays import Flags, Floats, Ints
from ..base.errors import NoUnwrapper
from . import child_process
from .child_process import BEGINNING, TOO_LITTLE, Child, NoAnswer
from .existing import ExistingCharts, SideBySide, side_by_side
from .stages import Tell
from .stretch import Stretch
from .udim import Udim
from .unwrap import Charts, unwrap

_Made = TypeVar("_Made")


def unwrap_in_process(
    name: str,
    vertices: Floats,
    triangles: Ints,
    polygons: Ints | None,
    size: int | tuple[int, int],
    padding: int,
    *,
    seams: Flags | None = None,
    progress: Tell,
    child: Child | None = None,
) -> Charts:
    """`unwrap` in a process of its own: the same arguments, the same bits, the same InputError.

    child: which is asked; without it one is, which is started for it and ended. `progress` is called as by
    `Child.ask`, which tells what else is raised. Where no child can be asked, the
    unwrap runs in this process: the window then stutters while it works, but the artist gets charts wherever there are
    any to be had. If that fails too, the error has a note of what the child wrote to stderr.
    """
    question = ("unwrap", (name, vertices, triangles, polygons, size, padding), {"seams": seams})
    here = partial(unwrap, *question[1], seams=seams)
    return _apart(name, question, here, _charts, progress, child)


def side_by_side_in_process(
    name: str,
    maps: Sequence[ExistingCharts],
    size: tuple[int, int],
    padding: int,
    *,
    progress: Tell,
    child: Child | None = None,
) -> SideBySide:
    """`side_by_side` in a process of its own, as `unwrap_in_process`."""
    plain = [(each.vertices, each.triangles, each.uv, each.udim.value) for each in maps]
    question: Any = ("side_by_side", (name, plain, size, padding), {})
    return _apart(name, question, partial(side_by_side, name, maps, size, padding), _side_by_side, progress, child)


def answer() -> None:
    """The child's side of both."""
    child_process.answer(_do)


def _do(question: Any, progress: Tell) -> dict[str, Any]:
    """What is asked for, in nothing of this package."""
    what, arguments, options = question
    if what == "unwrap":
        return asdict(unwrap(*arguments, **options, progress=progress))
    name, plain, *rest = arguments
    maps = [ExistingCharts(vertices, triangles, uv, Udim(udim)) for vertices, triangles, uv, udim in plain]
    return asdict(side_by_side(name, maps, *rest, progress=progress))


def _charts(content: dict[str, Any]) -> Charts:
    return Charts(**{**content, "stretch": Stretch(**content["stretch"])})


def _side_by_side(content: dict[str, Any]) -> SideBySide:
    return SideBySide(**{**content, "stretch": Stretch(**content["stretch"])})


def _apart(
    name: str,
    question: Any,
    here: Callable[..., _Made],
    read: Callable[[dict[str, Any]], _Made],
    progress: Tell,
    child: Child | None,
) -> _Made:
    """The child's answer, as `read` makes it of what is said; where none can be asked, what `here` gives."""
    progress(0.0, BEGINNING)
    try:
        with Child() if child is None else nullcontext(child) as asked:
            return read(asked.ask(name, question, progress))
    except NoAnswer as error:
        why = f"The making of charts in a process of its own failed: {error}"
    progress(0.0, BEGINNING)  # the same Ctrl-C may have ended the child
    try:
        return here(progress=progress)
    except MemoryError as error:
        raise NoUnwrapper(name, TOO_LITTLE) from error
    except Exception as error:
        error.add_note(why)
        raise
