"""UDIM layouts among the hard cases: their tiles put together are one image, and what is right is known of that."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....core.bake import Baker
from ....core.charts.udim import FIRST, corner_of, tiles_of
from ....core.finish.baked import Baked, BakedMap
from ....core.scene.scene import Instance, Scene
from ....core.settings import Settings

Tiles = tuple[int, int]  # across and up


def in_one_image(scene: Scene, tiles: Tiles) -> Scene:
    """A scene with all tiles of its first target in the unit square."""
    first = scene.targets[0]
    assert first.mesh.uv is not None
    whole = replace(first, mesh=replace(first.mesh, uv=first.mesh.uv / np.array(tiles, dtype=np.float32)))

    def exchanged(instances: Sequence[Instance]) -> list[Instance]:
        return [whole if each is first else each for each in instances]

    return replace(scene, targets=exchanged(scene.targets), occluders=exchanged(scene.occluders))


def bake_tiles(scene: Scene, settings: Settings, tiles: Tiles) -> Baked:
    """The only target, each tile as large as the settings say, put together."""
    (target,) = scene.targets
    baker = Baker(scene, settings)
    numbers = tiles_of(target.mesh).numbers or (None,)
    return together([baker.bake(target, number) for number in numbers], tiles)


def together(parts: Sequence[Baked], tiles: Tiles) -> Baked:
    """Bakes of tiles as one of all. Of one that is missing no texel is covered."""
    if tiles == (1, 1):
        (whole,) = parts
        return whole
    numbers = [part.tile or FIRST for part in parts]

    def put(arrays: Sequence[NDArray[Any]]) -> NDArray[Any]:
        height, width = arrays[0].shape
        whole: NDArray[Any] = np.zeros((tiles[1] * height, tiles[0] * width), dtype=arrays[0].dtype)
        for number, array in zip(numbers, arrays, strict=True):
            column, row = corner_of(number)
            top = (tiles[1] - 1 - row) * height
            whole[top : top + height, column * width : (column + 1) * width] = array
        return whole

    def of_map(name: str) -> BakedMap:
        maps = [part.maps[name] for part in parts]
        values, covered, coverage = (
            put([getattr(each, what) for each in maps]) for what in ("values", "covered", "coverage")
        )
        return replace(maps[0], values=values, covered=covered, coverage=coverage)

    return replace(parts[0], maps={name: of_map(name) for name in parts[0].maps})
