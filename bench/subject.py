"""What all bakers of a scene bake: one object, its texels, who owns them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from ..core.base.arrays import Flags, Ints
from ..core.rays.map_spec import AO, MapSpec
from ..core.scene.checks import zero_area
from ..core.scene.scene import Scene
from ..core.texels.rasterize import owners_by_centre, rasterize
from ..samples.bench_scenes import build
from ..tests.oracles.blender import read
from ..tests.oracles.settings import flat_settings
from .bake_here import OwnBake, bake_here


@dataclass(frozen=True, eq=False)
class Subject:
    """The object of the open file that is baked, `size` texels a side. owner: (H, W) int32 triangles, ours. embree:
    which ours found, where it was asked."""

    name: str
    size: int
    scene: Scene
    owner: Ints
    embree: str = ""

    @property
    def triangles(self) -> int:
        """Of all that occludes, instances counted each."""
        return sum(len(each.mesh.triangles) for each in self.scene.occluders)

    @property
    def covered(self) -> Flags:
        """(H, W) bool: the texels that are baked."""
        mask: Flags = self.owner >= 0
        return mask

    @cached_property
    def same(self) -> Flags:
        """(H, W) bool: those that Cycles, by its rule, gives to the same triangle."""
        uv = self.scene.targets[0].mesh.uv
        assert uv is not None
        mask: Flags = self.covered & (owners_by_centre(uv, self.size, self.size) == self.owner)
        return mask

    def bake(self, spec: MapSpec = AO, *, with_files: bool = False, **goal: Any) -> OwnBake:
        """Ours, without a margin. goal: rays or error, filtered, seed."""
        settings = flat_settings((spec,), width=self.size, height=self.size, margin=0, **goal)
        return bake_here([self.name], settings, with_files=with_files)


def prepare(scene: str, size: int, models: Path) -> Subject:
    """Open a scene and bake it once with a ray: charts are then made where there were no UVs, and libraries loaded."""
    name = build(scene, models).targets[0]
    made = bake_here([name], flat_settings(width=size, height=size, rays=1, filtered=False, margin=0))
    return replace(subject_of(name, size), embree=made.embree.rpartition(", ")[0])


def subject_of(name: str, size: int) -> Subject:
    """An object of the open file that has UVs."""
    scene, _ = read([name])
    mesh = scene.targets[0].mesh
    assert mesh.uv is not None
    return Subject(name, size, scene, rasterize(name, mesh.uv, size, size, skip=zero_area(mesh)).owner)
