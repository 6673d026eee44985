"""link_bpy.py FOLDER: link bpy and the packages it requires into a folder.

A Python started with that folder alone (-S, PYTHONPATH) has Blender and nothing else of its environment, so that what
an extension brings along is truly its own.
"""

from __future__ import annotations

import re
import sys
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from pathlib import Path


def required(name: str, found: dict[str, Distribution]) -> dict[str, Distribution]:
    """`found` with a distribution and all it requires, by name; left out is what only extras or other Pythons want."""
    if name in found:
        return found
    try:
        found[name] = distribution(name)
    except PackageNotFoundError:
        return found
    for line in found[name].requires or []:
        wanted = re.match(r"[\w.-]+", line)
        if wanted and "extra ==" not in line:
            required(wanted[0], found)
    return found


def link(folder: Path) -> None:
    for package in required("bpy", {}).values():
        for top in {path.parts[0] for path in package.files or []} - {"..", "__pycache__"}:
            if not (folder / top).is_symlink():
                (folder / top).symlink_to(Path(str(package.locate_file(top))))


if __name__ == "__main__":
    link(Path(sys.argv[1]))
