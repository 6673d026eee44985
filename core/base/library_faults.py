"""Why a library cannot be loaded, from what the system's loader says of it, and the cure: one line."""

from __future__ import annotations

import platform
import re
import sys
from dataclasses import dataclass
from pathlib import Path

from .errors import InputError
from .foreign_text import one_line

REINSTALL = "reinstall the extension"


@dataclass(frozen=True)
class _Fault:
    """said: a pattern of the loader's words. cause and cure: what they have in braces is filled in by `explained`, by
    number what the pattern's groups found."""

    said: str
    cause: str
    cure: str


_NOT_INSTALLED = _Fault(r"No module named|^no kernel library in", "it is not installed", "{reinstall}")
_OTHER_MACHINE = _Fault(
    r"wrong ELF class|invalid ELF header|incompatible architecture|wrong architecture|not a mach-o file"
    r"|no suitable image|Win(?:dows |)[Ee]rror 193\b",
    "it is made for another system or processor",
    "install the extension's zip for {here}",
)

# The loaders' own words: glibc's dlopen, dyld's since macOS 11, and Windows' numbers, whose words are in its language.
_FAULTS = (
    _NOT_INSTALLED,
    _Fault(
        r"GLIBC_([\d.]+)['\u2019]? not found",
        "this system's C library is older than the {0} it asks for",
        "bake on a newer system",
    ),
    _Fault(
        r"disallowed by system policy",
        "macOS holds it back, as a download",
        "in Terminal: xattr -dr com.apple.quarantine '{folder}', and start Blender anew",
    ),
    _OTHER_MACHINE,
    _Fault(
        r"Win(?:dows |)[Ee]rror 206\b",
        "its path is longer than Windows takes",
        "have Windows take long paths, or Blender keep its files in a folder with a shorter path "
        "(BLENDER_USER_RESOURCES)",
    ),
    _Fault(
        r"Win(?:dows |)[Ee]rror (?:126|1114)\b|Could not find module",
        "it, or a library that it needs, is not there or does not start",
        "install Microsoft's Visual C++ Redistributable, and reinstall the extension",
    ),
    _Fault(
        r"Win(?:dows |)[Ee]rror (?:5|225|1260|4551)\b",
        "Windows, or a virus scanner, keeps it from running",
        "allow what lies in {folder}",
    ),
    _Fault(
        r"failed to map segment|Operation not permitted",
        "programs are not let run from where it lies",
        "allow it for {folder}, or keep Blender's files elsewhere (BLENDER_USER_RESOURCES)",
    ),
    _Fault(r"Library not loaded: (\S+)", "it needs {0}, which is not there", "{reinstall}"),
    _Fault(r"file too short|file truncated", "its file is cut off", "{reinstall}"),
    # Wheels bring along what they need under a name with a hash in it.
    _Fault(r"^([^/\\:]+-[0-9a-f]{8}\.so[\d.]*): cannot open", "it needs {0}, which is not there", "{reinstall}"),
    _Fault(
        r"^([^/\\:]+): cannot open shared object file",
        "it needs {0}, which this system has not",
        "install the package that brings {0}",
    ),
)


def cannot_be_loaded(what: str, path: Path | None, said: object, reinstall: str = REINSTALL) -> InputError:
    """The refusal of a library: what it is called, why it cannot be loaded, and the cure.

    path: where it lies, None where that is not known. said: the loader's words, or its exception. reinstall: the cure
    where it is missing or broken.
    """
    line = one_line(str(said))
    if known := explained(path, str(said), reinstall):
        cause, cure = known
        return InputError(f"{what} cannot be loaded: {cause}; {cure} [{line}]")
    return InputError(f"{what} cannot be loaded ({line}); {reinstall}")


def explained(path: Path | None, said: str, reinstall: str = REINSTALL) -> tuple[str, str] | None:
    """The cause and the cure, as in `cannot_be_loaded`; None where the loader's words are not known."""
    folder = "FOLDER" if path is None else str(path.parent)
    facts = {"folder": folder, "here": _here(), "reinstall": reinstall}
    for fault in _FAULTS:
        if found := re.search(fault.said, said, re.MULTILINE):
            return fault.cause.format(*found.groups(), **facts), fault.cure.format(*found.groups(), **facts)
    if path is None or "cannot open shared object file" not in said:
        return None
    fault = _OTHER_MACHINE if path.exists() else _NOT_INSTALLED  # glibc has these words for another processor's, too
    return fault.cause, fault.cure.format(**facts)


def _here() -> str:
    """This system, as people have it."""
    system = {"darwin": "macOS", "win32": "Windows"}.get(sys.platform, platform.system())
    return f"{system} on {platform.machine() or 'this processor'}"
