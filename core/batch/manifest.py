"""The plan of a bake: what is to be made, of what inputs, and where to; a file that every machine reads."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from ..base.atomic_file import leads_to
from ..base.errors import InputError
from ..base.foreign_text import one_line
from ..base.version import ALGORITHM, version
from ..finish.image_file import check_format
from ..finish.map_files import Folder, tile_suffix
from ..finish.report import Json
from ..options.values import settings_of_command
from ..settings import Settings
from .files import PLAN_AGAIN, json_of, unreadable, write_json

FORMAT = 2  # of the file, and of the scene's
_CLAIM = ".occlusion_bake_plan.json"  # in a folder of images: whose it is
_VERSIONS = ("version", "algorithm", "format")


@dataclass(frozen=True)
class Item:
    """One object, or one tile of it: what a machine bakes at a time. target: its place among the scene's. stem: its
    files' name. inputs: the hash of what its texture depends on, which its files tell with their depth and dither
    (inputs_told). files: by map, relative to the output folder; none for a part of an atlas. tile: of a UDIM layout.
    uv_map: onto which it is baked. charts: those made for it. warnings: on its UVs, from planning."""

    name: str
    target: int
    stem: str
    inputs: str
    files: Mapping[str, str]
    tile: int | None = None
    uv_map: str = ""
    charts: Json | None = None
    warnings: Sequence[str] = ()

    @property
    def key(self) -> str:
        """What its own files beside the manifest are called."""
        return f"{self.stem}{tile_suffix(self.tile)}"


@dataclass(frozen=True)
class AtlasItem:
    """The one image of all items, which are its parts."""

    name: str
    stem: str
    files: Mapping[str, str]


@dataclass(frozen=True)
class SourceFile:
    """A file that the plan is of. sha256: of its bytes, in hexadecimal digits."""

    path: str
    sha256: str


@dataclass(frozen=True)
class Manifest:
    """id: the same where it is planned again. options: the command's, but for files and objects. settings: what they
    come to, and who occludes, for those who read it. folder: of the images. source: the scene that was planned, None
    where it was never saved; prepared: the copy of it that the charts are in. scene: the folder of its arrays. notes,
    refused: lines from planning."""

    id: str
    options: Json
    settings: Json
    folder: str
    report: str
    source: SourceFile | None
    prepared: SourceFile
    scene: str
    items: Sequence[Item]
    atlas: AtlasItem | None = None
    notes: Sequence[str] = ()
    refused: Sequence[str] = ()
    version: str = field(default_factory=version)
    algorithm: int = ALGORITHM
    format: int = FORMAT

    @cached_property
    def bake_settings(self) -> Settings:
        """Raises InputError where they are not of this version."""
        return settings_of_command(self.options)


class Places:
    """Where a manifest's files are. Those of the manifest's own folder move with it."""

    def __init__(self, manifest: Path) -> None:
        self.manifest = leads_to(manifest)
        stem = self.manifest.with_suffix("")
        self.scenes, self.prepared = stem / "scenes", self.manifest.with_suffix(".blend")
        self.items = stem / "items"

    def record(self, item: Item) -> Path:
        """What became of an item."""
        return self.items / f"{item.key}.json"

    def part(self, item: Item) -> Path:
        """An item's part of an atlas."""
        return self.items / f"{item.key}.npz"

    def told(self, path: Path) -> str:
        """A path as the manifest has it."""
        home = self.manifest.parent
        return path.relative_to(home).as_posix() if path.is_relative_to(home) else str(path)

    def whole(self, told: str) -> Path:
        """The path that is told so."""
        return leads_to(self.manifest.parent / told)


def write_manifest(path: Path, manifest: Manifest) -> None:
    """Write it whole. Raises InputError."""
    content = {key: value for key, value in asdict(manifest).items() if value is not None}
    empty: tuple[Any, ...] = (None, (), [], "")
    content["items"] = [{key: value for key, value in item.items() if value not in empty} for item in content["items"]]
    write_json(path, content, indent=1)


def read_manifest(path: Path) -> Manifest:
    """Raises InputError where it is missing, no manifest, or of another version."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise unreadable(path, error, "give a manifest that plan has written") from error
    except ValueError as error:
        raise InputError(f"{path}: it is no manifest, or not whole ({one_line(str(error))}); {PLAN_AGAIN}") from error
    if not _is_manifest(content):
        raise InputError(f"{path}: it is no manifest of Occlusion Bake; give one that plan has written")
    made, ours = tuple(content.get(key) for key in _VERSIONS), (version(), ALGORITHM, FORMAT)
    if made != ours:
        raise InputError(
            f"{path}: it was planned by Occlusion Bake {_told_version(*made)}, and this is {_told_version(*ours)}; "
            f"{PLAN_AGAIN}, or install that version here"
        )
    try:
        manifest = _read(content)
        check_format(manifest.options["format"], manifest.options["depth"])
        assert manifest.bake_settings
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputError(f"{path}: it is not as plan has written it ({error}); {PLAN_AGAIN}") from error
    return manifest


def _is_manifest(content: Any) -> bool:
    return isinstance(content, dict) and all(key in content for key in ("id", "items", "format"))


def _told_version(extension: Any, algorithm: Any, form: Any) -> str:
    return f"{extension} (algorithm {algorithm}, manifests {form})"


def _read(content: Json) -> Manifest:
    source, atlas = content.get("source"), content.get("atlas")
    made = {
        "items": [Item(**item) for item in content["items"]],
        "source": source and SourceFile(**source),
        "prepared": SourceFile(**content["prepared"]),
        "atlas": atlas and AtlasItem(**atlas),
    }
    return Manifest(**{**content, **made})


def hashed(path: Path, told: str) -> SourceFile:
    """A file as it is now. Raises InputError."""
    try:
        with path.open("rb") as stream:
            return SourceFile(told, hashlib.file_digest(stream, "sha256").hexdigest())
    except OSError as error:
        raise unreadable(path, error, PLAN_AGAIN) from error


def check_sources(places: Places, manifest: Manifest) -> None:
    """That the scene, and the copy of it, are as they were planned, as far as they are there: on many machines they are
    not, and items read neither. Raises InputError."""
    for each in (manifest.prepared, manifest.source):
        if each is not None and (path := places.whole(each.path)).exists() and hashed(path, each.path) != each:
            raise InputError(f"{path}: it was changed after it was planned; {PLAN_AGAIN}")


def planned_id(places: Places) -> str | None:
    """The id of what was planned there before; None where nothing was."""
    content = json_of(places.manifest)
    return str(content["id"]) if _is_manifest(content) else None


def check_places(places: Places, scene_file: Path | None, report: Path) -> None:
    """Refuse, before planning, places where a plan's files would take others' places. Raises InputError."""
    manifest = places.manifest
    if manifest.suffix.lower() != ".json":
        raise InputError(f"--manifest {manifest}: end its name in .json")
    own = [manifest, places.prepared, report]
    if scene_file is not None and leads_to(scene_file) in own:
        raise InputError(f"--manifest {manifest}: {scene_file.name} would be written over; choose another name")
    if len(set(own)) < len(own):
        raise InputError(f"--report {report}: it is the plan's own file; choose another name")
    if planned_id(places) is None:
        for path in own:
            if path.exists():
                raise InputError(f"{path}: it is there and no plan's; choose another name by --manifest or --report")


def claim(places: Places, plan: str, folder: Path) -> None:
    """Take a folder of images for the manifest of this id, before anything is written. Raises InputError where it is
    that of another one that is still there."""
    theirs, path = json_of(folder / _CLAIM), folder / _CLAIM
    if isinstance(theirs, dict) and theirs.get("id") not in (None, plan):
        other = Path(str(theirs.get("manifest")))
        if leads_to(other) != places.manifest and other.exists():
            raise _taken(folder, other)
    write_json(path, {"id": plan, "manifest": str(places.manifest)})


def check_claim(places: Places, plan: str, folder: Path) -> None:
    """That a folder of images is still this plan's. Raises InputError."""
    theirs = json_of(folder / _CLAIM)
    if not isinstance(theirs, dict) or "id" not in theirs:
        claim(places, plan, folder)
    elif theirs["id"] != plan:
        raise _taken(folder, theirs.get("manifest"))


def _taken(folder: Path, other: object) -> InputError:
    return InputError(
        f"{folder}: it holds the images of another manifest, {other}; choose another folder, and plan again"
    )


def output_folder(places: Places, manifest: Manifest) -> Folder:
    """Where the images go. Raises InputError where they cannot."""
    options = manifest.options
    return Folder(places.whole(manifest.folder), options["format"], options["depth"], options["use_dither"])
