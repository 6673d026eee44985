"""How many objects are baked again once a few have moved, by how far rays go. The section `reach`."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from ..pages import filled
from ..sweep import in_child
from . import level
from .level import command, manifest_of

OBJECTS, MOVED = 2_500, 25
DISTANCES = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0)  # metres
_CASES: dict[str, tuple[object, ...]] = {
    "`--occluders self`": ("--occluders", "self"),
    **{f"`--distance {each:g}`": ("--distance", each) for each in DISTANCES},
    "neither": (),
}


def measure(_: argparse.Namespace) -> dict[str, Any]:
    """Planned before and after, and the hashes of inputs compared."""
    with TemporaryDirectory() as place:
        before, after = Path(place) / "before.blend", Path(place) / "after.blend"
        in_child(level.build, str(before), OBJECTS)
        in_child(level.move_some, str(before), str(after), MOVED)
        return {"rows": [{"case": name, "changed": _changed(before, after, case)} for name, case in _CASES.items()]}


def page(result: dict[str, Any]) -> list[str]:
    """The section of the page."""
    rows = [{**each, "share": 100.0 * each["changed"] / OBJECTS} for each in result["rows"]]
    return filled(__file__, rows=rows, objects=OBJECTS, moved=MOVED, step=level.STEP)


def _changed(before: Path, after: Path, options: Sequence[object]) -> int:
    """Of how many items the inputs are others."""
    return sum(old != new for old, new in zip(_inputs(before, options), _inputs(after, options), strict=True))


def _inputs(file: Path, options: Sequence[object]) -> list[str]:
    with TemporaryDirectory() as folder:
        command("plan", file, *options, "--output", folder)
        return [item["inputs"] for item in manifest_of(Path(folder))["items"]]
