"""An object's part of an atlas, until all parts are there: its maps as they were baked, to the last bit.

Of each map the box about what it covers is kept, as numpy's own files, compressed.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from ..base.arrays import Flags
from ..base.atomic_file import refusal, replacing
from ..base.errors import InputError
from ..finish.baked import Baked, BakedMap, SurfaceReport
from ..maps.map import Map
from ..texels.flipped_faces import Sight
from .files import broken_told

_TOLD = "told"  # all that is no array
_BROKEN, _AGAIN = "it is no part of an atlas, or not whole", "bake its item again"


def write_part(path: Path, baked: Baked) -> None:
    """Write it whole. Raises InputError."""
    arrays, maps = {}, {}
    for name, each in baked.maps.items():
        rows, columns = _box(each.covered | (each.coverage > 0.0))
        for kind, values in (("values", each.values), ("covered", each.covered), ("coverage", each.coverage)):
            arrays[f"{name}/{kind}"] = values[rows, columns]
        box = [rows.start, rows.stop, columns.start, columns.stop]
        maps[name] = {"box": box, "error": each.error, "p99": each.p99, "mean": each.mean, "rays": each.rays}
    surface = {**vars(baked.surface), "sights": {sight.name: share for sight, share in baked.surface.sights.items()}}
    told = {
        "name": baked.name,
        "size": baked.size,
        "surface": surface,
        "rays": baked.rays,
        "seconds": baked.seconds,
        "warnings": baked.warnings,
        "inputs": baked.inputs,
        "maps": maps,
    }
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as temporary, temporary.open("wb") as stream:
            np.savez_compressed(stream, **arrays, **{_TOLD: np.array(json.dumps(told))})
    except OSError as error:
        raise refusal(path, error) from error


def read_part(path: Path, maps: tuple[Map, ...]) -> Baked:
    """What `write_part` wrote. maps: those that were baked. Raises InputError where it is not there, or broken."""
    kinds = {each.name: each for each in maps}
    with broken_told(path, _BROKEN, _AGAIN):
        told, arrays = _loaded(path)
        width, height = told["size"]
        surface = told["surface"]
        sights = {Sight[name]: share for name, share in surface["sights"].items()}
        return Baked(
            told["name"],
            (width, height),
            SurfaceReport(**{**surface, "sights": sights}),
            told["rays"],
            {name: _whole(arrays, name, each, (height, width), kinds[name]) for name, each in told["maps"].items()},
            told["seconds"],
            told["warnings"],
            inputs=told["inputs"],
        )


def is_part(path: Path, inputs: str, *, thoroughly: bool = True) -> bool:
    """Whether a part is there, and of these inputs. thoroughly: and all of it can be read."""
    try:
        with broken_told(path, _BROKEN, _AGAIN):
            told, _ = _loaded(path, arrays=thoroughly)
            return bool(told["inputs"] == inputs)
    except InputError:
        return False


def _loaded(path: Path, *, arrays: bool = True) -> tuple[Any, dict[str, Any]]:
    """What is told, and all arrays."""
    with np.load(path, allow_pickle=False) as stored:
        read = {name: stored[name] for name in stored if arrays and name != _TOLD}
        return json.loads(str(stored[_TOLD])), read


def _whole(arrays: dict[str, Any], name: str, told: Any, size: tuple[int, int], kind: Map) -> BakedMap:
    """A map in the image that it is a part of."""
    top, bottom, left, right = told["box"]

    def placed(what: str) -> Any:
        part = arrays[f"{name}/{what}"]
        whole = np.zeros((*size, *part.shape[2:]), dtype=part.dtype)
        whole[top:bottom, left:right] = part
        return whole

    return BakedMap(
        values=placed("values"),
        covered=placed("covered"),
        coverage=placed("coverage"),
        error=told["error"],
        p99=told["p99"],
        mean=told["mean"],
        rays=told["rays"],
        kind=kind,
    )


def _box(there: Flags) -> tuple[slice, slice]:
    """The rows and columns that hold all that is there."""
    rows, columns = (np.flatnonzero(there.any(axis=axis)) for axis in (1, 0))
    if not len(rows):
        return slice(0, 0), slice(0, 0)
    return slice(int(rows[0]), int(rows[-1]) + 1), slice(int(columns[0]), int(columns[-1]) + 1)
