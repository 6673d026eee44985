"""Where baked images go: names, folders, and writing them whole."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..base.atomic_file import check_place, check_writable, leads_to
from ..base.digest import digest
from ..base.errors import InputError
from ..base.foreign_text import check_utf8
from .baked import Baked, MapKind, Metadata
from .image_file import SUFFIXES, check_format, read_image, read_metadata, suffix, write_image
from .map_images import code_files, write_code
from .report import image_metadata

_INPUTS = "inputs"  # in a file's description


@dataclass
class Folder:
    """A folder for one run's images. Raises InputError, before anything is baked, where it cannot be written or the
    format does not have the depth."""

    path: Path
    format: str = "png"
    depth: int = 16
    dither: bool = False

    def __post_init__(self) -> None:
        check_format(self.format, self.depth)
        check_writable(self.path)
        self.path = leads_to(self.path)

    def files(self, kinds: Iterable[MapKind], stem: str, tile: int | None) -> dict[str, Path]:
        """The files of an object's maps by map, of a code that takes several numbered. stem: the object's file name
        (FileNames)."""
        found: dict[str, Path] = {}
        for kind in kinds:
            files = files_of(self._place(kind.name, stem, tile), kind, tile, self.depth)
            found |= dict(zip(_numbered(kind.name, len(files)), files, strict=True))
        return found

    def write(self, baked: Baked, asked: Metadata, stem: str) -> dict[str, Path]:
        """Write every map of an object; returns the paths by map, as `files` does. asked: what was, for their
        description.

        Raises InputError, the old file untouched."""
        for name in baked.maps:
            path = self._place(name, stem, baked.tile)
            write_map(path, baked, name, asked, depth=self.depth, dither=self.dither)
        return self.files((each.kind for each in baked.maps.values()), stem, baked.tile)

    def _place(self, name: str, stem: str, tile: int | None) -> Path:
        return self.path / f"{stem}_{name}{tile_suffix(tile)}{suffix(self.format)}"


def _numbered(name: str, count: int) -> list[str]:
    return [f"{name}_{number}" for number in range(count)] if count > 1 else [name]


def write_map(path: Path, baked: Baked, name: str, asked: Metadata, *, depth: int, dither: bool) -> list[Path]:
    """Write one map of an object, with what it says of itself; of a directional code there may be several files, which
    are returned. Raises InputError, the old file untouched."""
    each = baked.maps[name]
    metadata = {**image_metadata(baked, name, asked), **inputs_told(baked.inputs, depth, dither=dither)}
    if (code := each.kind.directional) is not None:
        return write_code(path, each, code, tile=tile_suffix(baked.tile), depth=depth, metadata=metadata)
    write_image(path, each.values, depth=depth, coverage=each.coverage, metadata=metadata, dither=dither)
    return [path]


def files_of(path: Path, kind: MapKind, tile: int | None, depth: int) -> list[Path]:
    """The files that `write_map` writes of a map."""
    code = kind.directional
    return [path] if code is None else code_files(path, code, tile=tile_suffix(tile), depth=depth)


def inputs_told(inputs: str, depth: int, *, dither: bool) -> Metadata:
    """What a file says of all that it depends on: of what was baked, and of how it was written; nothing where that is
    not known. What says the same need not be baked again."""
    return {_INPUTS: digest(inputs, depth, dither).hex()} if inputs else {}


def bear(files: Iterable[Path], told: Metadata, *, thoroughly: bool = True) -> bool:
    """Whether all these files are there, to their ends, and say this of their inputs. thoroughly: and can be read."""
    try:
        for file in files:
            if read_metadata(file).get(_INPUTS) != told[_INPUTS]:
                return False
            if thoroughly:
                read_image(file)
    except InputError:
        return False
    return True


def tile_suffix(tile: int | None) -> str:
    """What the name of a tile's file has before its ending, where Blender and other programs look for it."""
    return "" if tile is None else f".{tile}"


def whole_path(text: str, scene_file: str | Path) -> Path:
    """The absolute path; at its beginning `//` is the folder of the scene's file, as everywhere in Blender, and `~` the
    user's own, as everywhere else.

    text: as it was given, for a Path takes `//` for a network's share on Windows. scene_file: empty where the scene was
    never saved; then `//` raises InputError, as do `~` where there is none, and names that are not UTF-8.
    """
    path = Path(text)
    if text.startswith("~"):
        try:
            path = path.expanduser()
        except RuntimeError:
            raise InputError(f"{text}: there is no such user here; give a full path") from None
    if text.startswith("//") and not text.startswith("///"):  # which is the root
        if not str(scene_file):
            raise InputError(
                f"{text}: // is the folder of the .blend file, which is not saved; save it or give a full path"
            )
        path = leads_to(Path(scene_file)).parent.joinpath(text.lstrip("/"))
    whole = leads_to(path)
    check_utf8(whole)
    return whole


def check_file(path: Path) -> None:
    """Refuse, before a bake, a file that could not be written after it. Raises InputError."""
    check_place(path)
    check_writable(leads_to(path).parent)


def check_image(path: Path) -> None:
    """`check_file` for an image, whose name tells its format."""
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(f"{path}: images are written as {', '.join(SUFFIXES)}; end the name in one of these")
    check_file(path)


def write_coverage(path: Path, baked: Baked, stem: str, *, several: bool) -> Path:
    """Write the share of each texel that any map covers; with several objects the name gets the object's.

    path: absolute. Returns where it is. Raises InputError, the old file untouched.
    """
    name = f"{path.stem}_{stem}" if several else path.stem
    target = path.with_name(f"{name}{tile_suffix(baked.tile)}{path.suffix}")
    coverage = np.maximum.reduce([each.coverage for each in baked.maps.values()])
    write_image(target, coverage, depth=16, metadata={"object": baked.name, "map": "coverage"})
    return target
