"""A scene as files: what a machine reads that bakes some of it, and no more of that than it needs.

Arrays lie one after the other in a file for each dtype, in numpy's own format, and are mapped into memory, so that only
the pages are read that are asked for. A tree of JSON tells what is made of them. What objects share is stored once.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..base.arrays import Flags
from ..base.atomic_file import check_writable, refusal, replacing
from ..rays.boxes import Boxes
from ..scene.cutout import Alpha, Cutout
from ..scene.image_texture import ImageTexture, Wrap
from ..scene.normal_map import NormalMap, NormalMapLayer
from ..scene.scene import Camera, HighPoly, Instance, Mesh, Scene
from ..scene.world_mesh import boxes_of
from ..spherical.environment import Environment
from .files import PLAN_AGAIN, broken_told, write_json

_WIDER = 1.001  # than rays go: a bake may look from boxes that were rounded otherwise
_BROKEN = "what was planned cannot be read ({})"
_TREE = "scene.json"
_DTYPES = ("float32", "float64", "int32")
_KINDS: dict[str, type[Any]] = {
    kind.__name__: kind
    for kind in (Alpha, Camera, Cutout, Environment, HighPoly, ImageTexture, Instance, Mesh, NormalMap, NormalMapLayer)
}
_FIELDS = {name: [each.name for each in fields(kind)] for name, kind in _KINDS.items()}  # in the order they are kept
_ARRAY, _OBJECT, _WRAP = "array", "object", "wrap"  # what a reference in the tree is to


def write_scene(folder: Path, scene: Scene) -> None:
    """Write a scene into a folder, which is made where it is not there. Raises InputError."""
    check_writable(folder)
    writer = _Writer()
    tree = {
        "targets": [writer.of(each) for each in scene.targets],
        "occluders": [writer.of(each) for each in scene.occluders],
        "boxes": writer.of(boxes_of(scene.occluders)),
        "camera": writer.of(scene.camera),
        "private": sorted(scene.private),
        "highs": {name: writer.of(each) for name, each in scene.highs.items()},
        "environment": writer.of(scene.environment),
        "fields": _FIELDS,
        "objects": writer.objects,
    }
    try:
        for dtype in _DTYPES:
            with replacing(_array_file(folder, dtype)) as temporary:
                _write_arrays(temporary, dtype, writer.arrays[dtype])
    except OSError as error:
        raise refusal(folder, error) from error
    write_json(folder / _TREE, tree)


class StoredScene:
    """A scene that `write_scene` wrote. Raises InputError where it is not there, or not whole."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        with broken_told(folder, _BROKEN, PLAN_AGAIN):
            self._tree = json.loads((folder / _TREE).read_text(encoding="utf-8"))
            if self._tree["fields"] != _FIELDS:
                raise ValueError("another version wrote it")
            mapped = {dtype: np.load(_array_file(folder, dtype), mmap_mode="r") for dtype in _DTYPES}
            arrays = {dtype: each.view(np.ndarray) for dtype, each in mapped.items()}  # parts of these are made faster
            self._reader = _Reader(self._tree["objects"], arrays)
            self._boxes = Boxes(self._reader.value(self._tree["boxes"]))

    def with_targets(self, places: Sequence[int], reach: float) -> Scene:
        """The scene with some of its targets, by their places in it, and of what occludes, in its order, all that comes
        as near one of them as `reach` (scene units). Raises InputError."""
        tree, read = self._tree, self._reader.value
        with broken_told(self._folder, _BROKEN, PLAN_AGAIN):
            targets = [read(tree["targets"][place]) for place in places]
            near = self._near(targets, reach)
            return Scene(
                targets,
                [read(reference) for reference, here in zip(tree["occluders"], near, strict=True) if here],
                read(tree["camera"]),
                tree["private"],
                {each.name: read(tree["highs"][each.name]) for each in targets if each.name in tree["highs"]},
                read(tree["environment"]),
            )

    def _near(self, targets: Sequence[Instance], reach: float) -> Flags:
        near: Flags = np.zeros(len(self._tree["occluders"]), dtype=np.bool_)
        for low, high in boxes_of(targets):
            near |= self._boxes.within_reach(low, high, reach * _WIDER)
            if near.all():
                break
        return near | ~self._boxes.finite  # which are mended, or told of, when they are read


class _Writer:
    """Makes references of values. objects: kinds and fields of what they refer to. arrays: by dtype."""

    def __init__(self) -> None:
        self.objects: list[Any] = []
        self.arrays: dict[str, list[Any]] = {dtype: [] for dtype in _DTYPES}
        self._ends = dict.fromkeys(_DTYPES, 0)
        self._known: dict[int, tuple[Any, Any]] = {}  # by id; what is known is kept, so that no other gets its id

    def of(self, value: Any) -> Any:
        """What stands in the tree for a value."""
        if isinstance(value, Wrap):
            return {_WRAP: value.name}
        if value is None or isinstance(value, (str, bool, int, float)):
            return value
        if isinstance(value, (list, tuple)):
            return [self.of(each) for each in value]
        if id(value) not in self._known:
            self._known[id(value)] = value, self._array(value) if isinstance(value, np.ndarray) else self._object(value)
        return self._known[id(value)][1]

    def _array(self, value: Any) -> Any:
        dtype = value.dtype.name
        start = self._ends[dtype]
        self.arrays[dtype].append(value)
        self._ends[dtype] += value.size
        return {_ARRAY: [dtype, start, *value.shape]}

    def _object(self, value: Any) -> Any:
        assert is_dataclass(value) and type(value).__name__ in _KINDS
        content = [self.of(getattr(value, name)) for name in _FIELDS[type(value).__name__]]
        self.objects.append([type(value).__name__, content])
        return {_OBJECT: len(self.objects) - 1}


class _Reader:
    """Makes values of references, each object once. Raises KeyError, TypeError, ValueError where one is broken."""

    def __init__(self, objects: Sequence[Any], arrays: Mapping[str, Any]) -> None:
        self._objects, self._arrays = objects, arrays
        self._made: dict[int, Any] = {}

    def value(self, reference: Any) -> Any:
        """What a reference stands for."""
        if not isinstance(reference, dict):
            return tuple(map(self.value, reference)) if isinstance(reference, list) else reference
        ((kind, what),) = reference.items()
        if kind == _WRAP:
            return Wrap[what]
        if kind == _ARRAY:
            dtype, start, *shape = what
            return self._arrays[dtype][start : start + math.prod(shape)].reshape(shape)
        if what not in self._made:
            name, content = self._objects[what]
            self._made[what] = _KINDS[name](*[self.value(each) for each in content])
        return self._made[what]


def _write_arrays(file: Path, dtype: str, arrays: Sequence[Any]) -> None:
    """One after the other, none of them copied; not mapped, or a full disk would end the process."""
    header: Any = np.lib.format.write_array_header_1_0  # which is not typed
    count = sum(each.size for each in arrays)
    with file.open("wb") as stream:
        header(stream, {"descr": np.dtype(dtype).str, "fortran_order": False, "shape": (count,)})
        for each in arrays:
            stream.write(np.ascontiguousarray(each).reshape(-1).view(np.uint8).data)


def _array_file(folder: Path, dtype: str) -> Path:
    return folder / f"{dtype}.npy"
