"""What many machines baked, put together: the atlas of its parts, one report, and what is missing."""

from __future__ import annotations

from dataclasses import dataclass, field

from ..finish.atlas import Atlas
from ..finish.map_files import Folder, bear, inputs_told
from ..finish.report import Json, first_of, object_entry, whole_report, write_report
from ..options.values import told_by_images
from .atlas_parts import read_part
from .files import json_of
from .manifest import Item, Manifest, Places
from .records import Records
from .selection import told_items

_NAMED = 5  # items in the line on what is missing


@dataclass
class Merged:
    """baked: how many items are there. entries: of these, as in a report of one run. missing: numbers of items that are
    not baked. refused: a line for each that cannot be, those from planning first."""

    baked: int = 0
    entries: list[Json] = field(default_factory=list)
    missing: list[int] = field(default_factory=list)
    refused: list[str] = field(default_factory=list)
    embree: set[str] = field(default_factory=set)

    @property
    def complete(self) -> bool:
        """Whether all that was planned is there."""
        return not self.missing and not self.refused


def merge(places: Places, manifest: Manifest, folder: Folder) -> Merged:
    """Look at all items, make the atlas where all of its parts are there, and write the report; a second time nothing
    changes. Raises InputError where that cannot be written."""
    merged, parts = Merged(refused=list(manifest.refused)), list[tuple[Item, Json]]()
    records = Records(places, manifest, folder)
    for number, item in enumerate(manifest.items):
        record = records.of(item)
        if record is not None and record.refused:
            merged.refused.append(record.refused)
        elif record is None or record.entry is None or not records.are_there(item, thoroughly=False):
            merged.missing.append(number)
        else:
            merged.baked += 1
            merged.embree.add(record.embree)
            parts.append((item, _entry(item, record.entry, folder)))
    if manifest.atlas is None:
        merged.entries = _once_told(parts)
    elif not merged.missing and parts:
        merged.entries = [_atlas(places, manifest, folder, [item for item, _ in parts])]
    _write_report(places, manifest, merged)
    return merged


def complaint(manifest: Manifest, merged: Merged) -> str:
    """What is not there, and how to get it, in a line."""
    lines = []
    if merged.missing:
        names = first_of([manifest.items[number].key for number in merged.missing], _NAMED)
        lines.append(
            f"{len(merged.missing)} of {len(manifest.items)} items are not baked ({names}); bake "
            f"--items {told_items(merged.missing)}"
        )
    if merged.refused:
        lines.append(f"{len(merged.refused)} cannot be baked; {merged.refused[0]}")
    return "; ".join(lines)


def _entry(item: Item, entry: Json, folder: Folder) -> Json:
    """An item's entry as in a report of one run."""
    files = {name: str(folder.path / file) for name, file in item.files.items()}
    return {**entry, "files": files, **({"charts": item.charts} if item.charts else {})}


def _once_told(parts: list[tuple[Item, Json]]) -> list[Json]:
    """The entries, each line with the first that has it: those on occluders come from every machine, those on a mesh
    with each of its tiles."""
    known: set[str] = set()
    entries = []
    for _, entry in parts:
        entries.append({**entry, "warnings": [line for line in entry["warnings"] if line not in known]})
        known.update(entry["warnings"])
    return entries


def _atlas(places: Places, manifest: Manifest, folder: Folder, items: list[Item]) -> Json:
    """Make it of its parts, where it is not there yet; its entry."""
    plan, settings = manifest.atlas, manifest.bake_settings
    assert plan is not None
    atlas = Atlas(plan.name)
    for item in items:
        atlas.add(read_part(places.part(item), settings.maps))
    baked = atlas.finish(settings.image.margin)
    files = {name: folder.path / file for name, file in plan.files.items()}
    told = inputs_told(baked.inputs, folder.depth, dither=folder.dither)
    if not bear(files.values(), told):
        folder.write(baked, told_by_images(settings), plan.stem)
    charts = items[0].charts
    more: Json = {"objects": [item.name for item in items]} if len(items) > 1 else {}
    more |= {"charts": charts} if charts else {}
    return {**object_entry(baked, files), **more}


def _write_report(places: Places, manifest: Manifest, merged: Merged) -> None:
    """As that of one run, and what is missing; where it says so already it is left as it is."""
    seconds = {"total": sum(entry["seconds"]["total"] for entry in merged.entries)}
    report = {
        **whole_report(manifest.settings, ", ".join(sorted(merged.embree)), seconds, merged.entries),
        "notes": list(manifest.notes),
        "refused": merged.refused,
        "missing": [manifest.items[number].key for number in merged.missing],
    }
    path = places.whole(manifest.report)
    if json_of(path) != report:
        write_report(path, report)
