"""Files that appear whole or not at all: written beside their place, then renamed."""

from __future__ import annotations

import contextlib
import errno
import os
import secrets
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .errors import InputError
from .foreign_text import one_line

_LONGEST_NAME = 255  # on every disk; bytes on some, units of UTF-16 on others
_CURES = {
    errno.ENOENT: "create the folder or choose another",
    errno.ENOTDIR: "choose a folder, not a file, to write into",
    errno.EACCES: "choose a folder that you may write to, or close the program that holds the file",
    errno.EPERM: "choose a folder that you may write to",
    errno.EROFS: "choose a disk that can be written to",
    errno.ENOSPC: "free some space or choose another disk",
    errno.ENAMETOOLONG: "choose a shorter name",
}


def check_writable(folder: Path | str) -> None:
    """Create `folder` where it is missing and prove that a file can be written in it. Raises InputError if not."""
    folder = Path(folder)
    probe = beside(folder / "probe")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        probe.write_bytes(bytes(4096))
    except OSError as error:
        raise refusal(folder, error) from error
    finally:
        remove(probe)


def check_place(path: Path) -> None:
    """Refuse a place that no file may take: of a folder, a device, a pipe, or of a name that cannot be. Raises
    InputError."""
    if len(path.name) > _LONGEST_NAME:  # of which Windows says no more than that it is not there
        raise InputError(f"{path}: this name is too long; choose a shorter name")
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        return
    except OSError as error:
        raise refusal(path, error) from error
    if not stat.S_ISREG(mode):
        what = "a folder" if stat.S_ISDIR(mode) else "a device or pipe"
        raise InputError(f"{path}: {what} of that name is in the way; move it or choose another name")


def leads_to(path: Path) -> Path:
    """The file that a symbolic link leads to, be it there or not; of another path itself. Absolute."""
    try:
        return Path(os.path.realpath(path))  # unlike Path.resolve, it takes links that lead in a circle
    except OSError:  # Windows does not follow paths of any length
        return path.absolute()


def beside(path: Path) -> Path:
    """A new, short, hidden name in the same folder, of the same format."""
    return path.parent / f".{secrets.token_hex(8)}{path.suffix}"


def remove(file: Path) -> None:
    with contextlib.suppress(OSError):  # it may be gone, or never have been
        file.unlink()


def refusal(path: Path, error: OSError) -> InputError:
    cure = _CURES.get(error.errno or 0, "choose another folder")
    return InputError(f"{path}: {one_line(error.strerror or str(error))}; {cure}")


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A new file to write into, which takes the place of `path` where nothing is raised; else it is removed.

    A symbolic link stays one: the file that it leads to is replaced. Mode and owner stay those of the file that was
    there. Raises InputError as `check_place`.
    """
    check_place(path)
    place = leads_to(path)
    temporary = beside(place.with_name(path.name))  # the suffix tells the format
    try:
        yield temporary
        _belong_as(temporary, place)
        temporary.replace(place)
    finally:
        remove(temporary)


def _belong_as(file: Path, other: Path) -> None:
    """Give a file another's owner and mode, as far as the system lets us."""
    with contextlib.suppress(OSError):
        belongs = other.stat()
        if hasattr(os, "chown"):
            with contextlib.suppress(OSError):  # root alone may give files away
                os.chown(file, belongs.st_uid, belongs.st_gid)
        file.chmod(stat.S_IMODE(belongs.st_mode))
