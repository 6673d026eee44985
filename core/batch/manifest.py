"""The plan of a bake: what is to be made, of what inputs, and where to; a file that every machine reads."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from ..base.atomic_file import leads_to, refusal, replacing
from ..base.errors import InputError
from ..base.foreign_text import json_object
from ..base.version import ALGORITHM, version
from ..finish.map_files import Folder, tile_suffix
from ..options.values import settings_of_command
from ..settings import Settings

FORMAT = 1  # of the file
_CLAIM = ".occlusion_bake_plan.json"  # in a folder of images: whose it is
_PLAN_AGAIN = "plan again"
Json = dict[str, Any]


@dataclass(frozen=True)
class Item:
    """One object, or one tile of it: what a machine bakes at a time. target: its place among the scene's. stem: its
    files' name. inputs: the hash of what its texture depends on. files: by map, relative to the output folder; none for
    a part of an atlas. tile: of a UDIM layout. uv_map: onto which it is baked. charts: those made for it. warnings: on
    its UVs, from planning."""

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
    where it was never saved; prepared: the copy of it that the charts are in. notes, refused: lines from planning."""

    id: str
    options: Json
    settings: Json
    folder: str
    report: str
    source: SourceFile | None
    prepared: SourceFile
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
        self.scene, self.prepared = stem / "scene", self.manifest.with_suffix(".blend")
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
    content["items"] = [
        {key: value for key, value in item.items() if value not in (None, ())} for item in content["items"]
    ]
    try:
        with replacing(path) as temporary:
            temporary.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    except OSError as error:
        raise refusal(path, error) from error


def read_manifest(path: Path) -> Manifest:
    """Raises InputError where it is missing, no manifest, or of another version."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise refusal(path, error) from error
    except ValueError as error:
        raise InputError(f"{path}: it is no manifest, or not whole ({error}); {_PLAN_AGAIN}") from error
    if not isinstance(content, dict) or "items" not in content or "format" not in content:
        raise InputError(f"{path}: it is no manifest of Occlusion Bake; give one that plan has written")
    made = tuple(content.get(key) for key in ("format", "version", "algorithm"))
    if made != (FORMAT, version(), ALGORITHM):
        raise InputError(
            f"{path}: it was planned by Occlusion Bake {made[1]} (algorithm {made[2]}), and this is {version()} "
            f"(algorithm {ALGORITHM}); {_PLAN_AGAIN}, or install that version here"
        )
    try:
        return _read(content)
    except (KeyError, TypeError) as error:
        raise InputError(f"{path}: it is not as plan has written it ({error}); {_PLAN_AGAIN}") from error


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
        raise refusal(path, error) from error


def check_sources(places: Places, manifest: Manifest) -> None:
    """That what was planned is what is there. The scene itself need not be: on many machines it is not. Raises
    InputError."""
    for each in (manifest.prepared, manifest.source):
        if each is None:
            continue
        path = places.whole(each.path)
        if each is manifest.source and not path.exists():
            continue
        if hashed(path, each.path) != each:
            raise InputError(f"{path}: it was changed after it was planned; {_PLAN_AGAIN}")


def planned_id(places: Places) -> str | None:
    """The id of what was planned there before; None where nothing was."""
    found = json_object(_text(places.manifest)).get("id")
    return found if isinstance(found, str) else None


def check_place_of(manifest: Path) -> None:
    """Refuse, before planning, a place where no manifest may be. Raises InputError."""
    if manifest.suffix.lower() != ".json":
        raise InputError(f"--manifest {manifest}: end its name in .json")
    if (text := _text(manifest)) and "items" not in json_object(text):
        raise InputError(f"--manifest {manifest}: there is a file that is no manifest; choose another name")


def _text(path: Path) -> str:
    """Of a file; empty where there is none that can be read."""
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, ValueError):
        return ""


def claim(places: Places, plan: str, folder: Path) -> None:
    """Take a folder of images for the manifest of this id. Raises InputError where it is that of another one that is
    still there."""
    mine = {"id": plan, "manifest": str(places.manifest)}
    path = folder / _CLAIM
    try:
        theirs = json.loads(path.read_text(encoding="utf-8"))
        other = Path(theirs["manifest"])
        taken = theirs["id"] != plan and leads_to(other) != places.manifest and other.exists()
    except (OSError, ValueError, KeyError, TypeError):
        theirs, taken = None, False
    if taken:
        raise InputError(f"{folder}: it holds the images of another manifest, {other}; choose another folder")
    if theirs != mine:
        _write_claim(path, mine)


def _write_claim(path: Path, content: Json) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as temporary:
            temporary.write_text(json.dumps(content), encoding="utf-8")
    except OSError as error:
        raise refusal(path.parent, error) from error


def output_folder(places: Places, manifest: Manifest) -> Folder:
    """Where the images go. Raises InputError where they cannot."""
    options = manifest.options
    return Folder(places.whole(manifest.folder), options["format"], options["depth"], options["use_dither"])
