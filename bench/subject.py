"""What all bakers of a scene bake: its objects, their texels, who owns them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ..addon.read.occluder_filter import OccluderFilter
from ..core.base.arrays import Flags, Floats, Ints
from ..core.rays.map_spec import AO, MapSpec
from ..core.scene.checks import zero_area
from ..core.scene.scene import Instance, Scene
from ..core.texels.rasterize import Texels, owners_by_centre, rasterize
from ..samples.bench_scenes import MANY, build
from ..tests.oracles.blender import read
from ..tests.oracles.settings import flat_settings
from .bake_here import OwnBake, bake_here, pairing_of
from .seen_surface import sees_one_surface

_WHOLE = 1.0 - 1e-4  # of a texel


@dataclass(frozen=True, eq=False)
class Subject:
    """The N objects of the open file that are baked, each into a texture of `size` texels a side. Textures stand one
    below the other here. owner: (N * size, size) int32 triangles, ours, each of its own object. highs: the meshes that
    the one object is baked from. embree: which ours found, where it was asked."""

    names: tuple[str, ...]
    size: int
    scene: Scene
    owner: Ints
    highs: tuple[str, ...] = ()
    embree: str = ""

    @property
    def label(self) -> str:
        """What pages call it."""
        return self.names[0] if len(self.names) == 1 else f"{len(self.names)} objects"

    @property
    def triangles(self) -> int:
        """Of all that occludes, instances counted each."""
        return sum(len(each.mesh.triangles) for each in self.scene.occluders)

    @property
    def covered(self) -> Flags:
        """(N * size, size) bool: the texels that are baked."""
        mask: Flags = self.owner >= 0
        return mask

    @cached_property
    def same(self) -> Flags:
        """(N * size, size) bool: those that Cycles, by its rule, gives to the same triangle. From high meshes those
        alone that see one surface of them (seen_surface.py), and that a chart covers wholly: of others ours looks from
        the middle of what is covered, Cycles from the texel's."""
        targets, size = self.scene.targets, self.size
        by_centre = np.concatenate([owners_by_centre(_uv(target), size, size) for target in targets])
        mask: Flags = self.covered & (by_centre == self.owner)
        if self.highs:
            (target,) = targets
            mask &= _texels(target, size).coverage >= _WHOLE
            mask &= sees_one_surface(target, self.scene.highs[target.name], self.owner)
        return mask

    def bake(self, spec: MapSpec = AO, *, with_files: bool = False, **goal: Any) -> OwnBake:
        """Ours, without a margin. goal: rays or error, filtered, seed."""
        settings = flat_settings((spec,), width=self.size, height=self.size, margin=0, **goal)
        return bake_here(self.names, settings, highs=self.highs, with_files=with_files)


@dataclass(frozen=True, eq=False)
class Textures:
    """A map of all objects, one below the other. values: (N * size, size) float32; covered: of the same shape. error:
    over all texels; p99: of a single object, else None. rays: of all."""

    values: Floats
    covered: Flags
    error: float
    p99: float | None
    rays: int


def textures_of(made: OwnBake, spec: MapSpec = AO) -> Textures:
    """What a bake of ours has made of a subject."""
    bakes = [baked for _, baked in made.results]
    maps = [baked.maps[spec.name] for baked in bakes]
    texels = [baked.texels for baked in bakes]
    squares = sum(count * each.error**2 for count, each in zip(texels, maps, strict=True))
    return Textures(
        np.concatenate([each.values for each in maps]),
        np.concatenate([each.covered for each in maps]),
        math.sqrt(squares / max(sum(texels), 1)),
        maps[0].p99 if len(maps) == 1 else None,
        sum(baked.rays for baked in bakes),
    )


def prepare(scene: str, size: int, models: Path) -> Subject:
    """Open a scene and bake it once with a ray: charts are then made where there were no UVs, and libraries loaded."""
    sample = build(scene, models)
    names = sample.targets[:: MANY[scene]] if scene in MANY else sample.targets[:1]
    settings = flat_settings(width=size, height=size, rays=1, filtered=False, margin=0)
    made = bake_here(names, settings, highs=sample.highs)
    return replace(subject_of(names, size, sample.highs), embree=made.embree.rpartition(", ")[0])


def subject_of(names: Sequence[str], size: int, highs: Sequence[str] = ()) -> Subject:
    """Objects of the open file that have UVs."""
    chosen = pairing_of(names, highs)
    scene, _ = read(names, highs=chosen.highs, occluding=OccluderFilter(excluded=chosen.excluded))
    owner = np.concatenate([_texels(target, size).owner for target in scene.targets])
    return Subject(tuple(names), size, scene, owner, tuple(highs))


def _texels(target: Instance, size: int) -> Texels:
    return rasterize(target.name, _uv(target), size, size, skip=zero_area(target.mesh))


def _uv(target: Instance) -> Floats:
    assert target.mesh.uv is not None
    return target.mesh.uv
