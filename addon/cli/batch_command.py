"""The command's part that needs no Blender: items of a manifest, and the merge of what came of them.

`python -m occlusion_bake --manifest M --items 0-99` and `python -m occlusion_bake merge M`, or the same after
`blender -b -c occlusion_bake`.
"""

from __future__ import annotations

from argparse import BooleanOptionalAction
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from ...core.base.errors import InputError
from ...core.batch.bake_items import ItemBaker
from ...core.batch.manifest import Item, Manifest, Places, check_claim, check_sources, output_folder, read_manifest
from ...core.batch.merge import complaint, merge
from ...core.batch.records import Record, Records
from ...core.batch.selection import chosen_items
from ...core.finish.map_files import Folder
from ...core.finish.report import first_of, summary
from ...core.progress import Progress
from ...core.settings import MAX_THREADS
from ..job.runner import Steps, run
from ..job.stop_signals import STOPPING
from .engine_lines import ENGINES, EngineLines
from .options import StrictParser
from .terminal import NAME, ProgressLine, Status, complain, guarded, say

PLAN, MERGE, _MANIFEST = "plan", "merge", "--manifest"
_NAMED = 3  # refused items in the last line


def is_meant(argv: Sequence[str]) -> bool:
    """Whether these words are for this part of the command."""
    first = next(iter(argv), "")
    return first == MERGE or (first != PLAN and any(word.partition("=")[0] == _MANIFEST for word in argv))


def main(argv: Sequence[str]) -> int:
    """Its exit status."""
    return guarded(partial(_merge, argv[1:]) if list(argv[:1]) == [MERGE] else partial(_bake, argv))


def _bake(argv: Sequence[str]) -> int:
    parser = StrictParser(prog=NAME, description="Bake items of a manifest.", allow_abbrev=False)
    parser.add_argument(_MANIFEST, type=Path, required=True, metavar="FILE.json", help="what plan has written")
    parser.add_argument(
        "--items", metavar="0-99,120|K/N", help="which, by number, or the K-th of N equal shares (all of them)"
    )
    parser.add_argument(
        "--resume",
        action=BooleanOptionalAction,
        default=True,
        help="leave items whose files are there and were made of the same inputs (yes)",
    )
    parser.add_argument("--threads", type=int, default=0, metavar="N", help="for tracing (all)")
    parser.add_argument("--progress", choices=ENGINES, help="also print the lines by which an engine follows a task")
    options = parser.parse_args(argv)
    if not 0 <= options.threads <= MAX_THREADS:
        raise InputError(f"--threads {options.threads}: give 1 to {MAX_THREADS}, or 0 for all")
    places, manifest = Places(options.manifest), read_manifest(options.manifest)
    numbers = range(len(manifest.items)) if options.items is None else chosen_items(options.items, len(manifest.items))
    folder = output_folder(places, manifest)
    check_claim(places, manifest.id, folder.path)
    check_sources(places, manifest)
    task = _Task(places, manifest, folder, [manifest.items[number] for number in numbers], options)
    return task.run()


class _Task:
    """Items that are baked in one process."""

    def __init__(self, places: Places, manifest: Manifest, folder: Folder, items: Sequence[Item], options: Any) -> None:
        self._places, self._manifest, self._folder, self._options = places, manifest, folder, options
        self._items, self._lines = items, EngineLines(options.progress)
        self._refused: list[str] = []

    def run(self) -> Status:
        """What is refused stands in its record, and is told; it is no fault of the task's."""
        progress = Progress(len(self._items))
        run(self._steps(progress), progress, partial(self._lines.show, ProgressLine()), STOPPING)
        progress.raise_if_cancelled()
        if self._refused:
            complain(f"{len(self._refused)} items cannot be baked; {first_of(self._refused, _NAMED)}")
        self._lines.end()
        return Status.DONE

    def _left(self, progress: Progress) -> list[Item]:
        """Those that are not there yet."""
        if not self._options.resume:
            return list(self._items)
        records, left = Records(self._places, self._manifest, self._folder), []
        for item in self._items:
            progress.raise_if_cancelled()
            if not records.is_baked(item):
                left.append(item)
        return left

    def _steps(self, progress: Progress) -> Steps:
        progress.enter("looking at what is there")
        left: list[Item] = yield partial(self._left, progress)
        if len(left) < len(self._items):
            say(f"{NAME}: {len(self._items) - len(left)} items have not changed and were left as they are")
        if not left:
            return
        progress.enter("reading what was planned")
        baker = yield partial(
            ItemBaker, self._places, self._manifest, self._folder, left, self._options.threads, progress
        )
        for item in left:
            record: Record = yield partial(baker.bake, item)
            if record.entry is None:
                self._refused.append(record.refused)
                say(f"{NAME}: {record.refused}")
                continue
            for line in record.entry["warnings"]:
                say(f"{NAME}: {line}")
            say(summary(record.entry))
            self._lines.saved(self._folder.path / file for file in item.files.values())


def _merge(argv: Sequence[str]) -> int:
    parser = StrictParser(prog=f"{NAME} {MERGE}", description="Put together what was baked.", allow_abbrev=False)
    parser.add_argument("manifest", type=Path, metavar="FILE.json", help="what plan has written")
    options = parser.parse_args(argv)
    places, manifest = Places(options.manifest), read_manifest(options.manifest)
    folder = output_folder(places, manifest)
    check_claim(places, manifest.id, folder.path)
    merged = merge(places, manifest, folder)
    report = places.whole(manifest.report)
    say(f"{NAME}: {merged.baked} of {len(manifest.items)} items are baked; the report is {report}")
    if merged.complete:
        return Status.DONE
    complain(complaint(manifest, merged))
    return Status.IN_PART
