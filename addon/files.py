"""Where baked images go: names, folders, and writing them whole."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..core.bake import Baked, Settings
from ..core.images import check_format, check_writable, suffix, write_image
from ..core.report import image_metadata


@dataclass
class Folder:
    """A folder for one run's images. Two objects never get one name. Raises InputError before anything is baked where
    the folder cannot be written or the format does not have the depth."""

    path: Path
    format: str = "png"
    depth: int = 16
    _taken: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        check_format(self.format, self.depth)
        check_writable(self.path)
        self.path = self.path.resolve()

    def stem(self, name: str) -> str:
        """A file name for an object: what file systems refuse becomes _, a name that is taken gets a number."""
        clean = re.sub(r'[\x00-\x1f<>:"/\\|?*]', "_", name).strip(" .") or "object"
        stem, number = clean, 1
        while stem.casefold() in self._taken:
            number += 1
            stem = f"{clean}_{number}"
        self._taken.add(stem.casefold())
        return stem

    def write(self, baked: Baked, settings: Settings, stem: str) -> dict[str, Path]:
        """Write every map of an object; returns the paths by map. Raises InputError, the old file untouched."""
        files = {}
        for name, each in baked.maps.items():
            files[name] = self.path / f"{stem}_{name}{suffix(self.format)}"
            write_image(
                files[name],
                each.values,
                depth=self.depth,
                coverage=each.coverage,
                metadata=image_metadata(baked, name, settings),
            )
        return files


def write_coverage(path: Path, baked: Baked, stem: str, *, several: bool) -> Path:
    """Write the share of each texel that any map covers; with several objects the name gets the object's."""
    target = path.with_name(f"{path.stem}_{stem}{path.suffix}") if several else path
    coverage = np.maximum.reduce([each.coverage for each in baked.maps.values()])
    write_image(target, coverage, depth=16, metadata={"object": baked.name, "map": "coverage"})
    return target.resolve()
