"""Files that appear whole or not at all: written beside their place, then renamed."""

from __future__ import annotations

import contextlib
import errno
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .errors import InputError

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


def beside(path: Path) -> Path:
    """A new, short, hidden name in the same folder, of the same format."""
    return path.parent / f".{secrets.token_hex(8)}{path.suffix}"


def remove(file: Path) -> None:
    with contextlib.suppress(OSError):  # it may be gone, or never have been
        file.unlink()


def refusal(path: Path, error: OSError) -> InputError:
    cure = _CURES.get(error.errno or 0, "choose another folder")
    return InputError(f"{path}: {one_line(error.strerror or str(error))}; {cure}")


def one_line(text: str) -> str:
    return text.strip().split("\n")[0].strip()


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A new file beside `path` to write into, which takes its place where nothing is raised; else it is removed."""
    temporary = beside(path)
    try:
        yield temporary
        temporary.replace(path)
    finally:
        remove(temporary)
