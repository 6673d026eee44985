"""What objects' files are called: without what file systems refuse, and no two of one folder alike."""

from __future__ import annotations

import re
import secrets
import unicodedata
from collections.abc import Iterable
from pathlib import Path

_LONGEST_STEM = 180  # bytes; file systems take 255 for the whole name
_REFUSED = re.compile(r'[\x00-\x1f\x7f<>:"/\\|?*]')
_TILE = re.compile(r"\.(?=[12]\d{3}$)")  # a number after it is taken for that of a UDIM tile
_DEVICE = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\.|$)", re.IGNORECASE)  # of Windows, whatever the ending


class FileNames:
    """The file names of objects. Of several that would be one file those that are called so keep their name, the others
    get a number: by the names of all, not by their order, so that who is baked alone is called as among others."""

    def __init__(self, folder: Path, names: Iterable[str] = ()) -> None:
        """folder: for the files; it need not be there yet. names: of all objects, whether they are baked or not."""
        self._case, self._accents = _folded_in(folder)
        self._taken: set[str] = set()
        self._found: dict[str, str] = {}
        for name in sorted(set(names), key=lambda name: (clean_name(name) != name, name)):
            self.of(name)

    def of(self, name: str) -> str:
        """The file name of an object, the same whenever it is asked for."""
        if name not in self._found:
            clean = stem = clean_name(name)
            number = 1
            while self.same(stem) in self._taken:
                number += 1
                stem = f"{clean}_{number}"
            self._taken.add(self.same(stem))
            self._found[name] = stem
        return self._found[name]

    def same(self, name: str) -> str:
        """Equal for names that the folder's file system takes for one."""
        name = unicodedata.normalize("NFC", name) if self._accents else name
        return name.casefold() if self._case else name


def clean_name(name: str) -> str:
    """A name without what file systems refuse."""
    safe = _REFUSED.sub("_", name.encode(errors="replace").decode())
    safe = safe.encode()[:_LONGEST_STEM].decode(errors="ignore").strip(" .") or "object"
    safe = _TILE.sub("_", safe)
    return f"_{safe}" if _DEVICE.match(safe) else safe


def _folded_in(folder: Path) -> tuple[bool, bool]:
    """Whether a folder overlooks case, and how accents are put together. Where that cannot be tried, it does."""
    there = next(place for place in (folder, *folder.parents) if place.is_dir() or place == place.parent)
    name = f".{secrets.token_hex(8)}é"
    try:
        (there / name).touch(exist_ok=False)
        try:
            return (there / name.upper()).exists(), (there / unicodedata.normalize("NFD", name)).exists()
        finally:
            (there / name).unlink()
    except (OSError, ValueError):
        return True, True
