"""What became of each item, in a small file of its own: whatever machine baked it, nobody waits for another."""

from __future__ import annotations

from dataclasses import dataclass

from ..finish.map_files import Folder, bear, inputs_told
from ..finish.report import Json
from .atlas_parts import is_part
from .files import json_of, write_json
from .manifest import Item, Manifest, Places


@dataclass(frozen=True)
class Record:
    """inputs: the item's, as it was baked. entry: its part of the report, None where it was refused. refused: why.
    embree: what traced it."""

    inputs: str
    entry: Json | None = None
    refused: str = ""
    embree: str = ""


class Records:
    """Those of a manifest's items."""

    def __init__(self, places: Places, manifest: Manifest, folder: Folder) -> None:
        self._places, self._manifest, self._folder = places, manifest, folder

    def keep(self, item: Item, record: Record) -> None:
        """Write it whole. Raises InputError."""
        write_json(self._places.record(item), vars(record))

    def of(self, item: Item) -> Record | None:
        """What became of an item as it is planned now; None where nothing has yet, or that is broken."""
        try:
            record = Record(**json_of(self._places.record(item)))
        except TypeError:
            return None
        return record if record.inputs == item.inputs else None

    def is_baked(self, item: Item) -> bool:
        """Whether an item is as it would be baked now: its files are there, can be read and are of the same inputs."""
        record = self.of(item)
        return record is not None and record.entry is not None and self.are_there(item)

    def are_there(self, item: Item, *, thoroughly: bool = True) -> bool:
        """Whether an item's files are, and of its inputs. thoroughly: as `bear` has it."""
        if self._manifest.atlas is not None:
            return is_part(self._places.part(item), item.inputs, thoroughly=thoroughly)
        told = inputs_told(item.inputs, self._folder.depth, dither=self._folder.dither)
        files = [self._folder.path / name for name in item.files.values()]
        return bear(files, told, thoroughly=thoroughly)
