"""What all bakers of a scene bake: one object, its texels, who owns them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ...addon.read.scene_reader import SceneRequest, read_scene
from ...core.base.arrays import Ints
from ...core.scene.checks import zero_area
from ...core.texels.rasterize import owners_by_centre, rasterize
from ...tests.oracles.settings import flat_settings
from ..ours import bake_here
from .scenes import build


@dataclass(frozen=True, eq=False)
class Subject:
    """The object of the open file that is baked. size: texels a side. owner: (H, W) int32 triangles, ours; by_centre:
    the same by Cycles' rule. triangles: of all that occludes, instances counted each."""

    scene: str
    name: str
    size: int
    owner: Ints
    by_centre: Ints
    triangles: int
    embree: str

    @property
    def covered(self) -> NDArray[np.bool_]:
        """(H, W) bool: the texels that are baked."""
        mask: NDArray[np.bool_] = self.owner >= 0
        return mask

    @property
    def same(self) -> NDArray[np.bool_]:
        """(H, W) bool: those that Cycles gives to the same triangle."""
        mask: NDArray[np.bool_] = self.covered & (self.by_centre == self.owner)
        return mask


def prepare(scene: str, size: int, models: Path) -> Subject:
    """Open a scene and bake it once with a ray: charts are then made where there were no UVs, and libraries loaded."""
    name = build(scene, models).targets[0]
    settings = flat_settings(width=size, height=size, rays=1, filtered=False, margin=0)
    embree = bake_here([name], settings)[2]
    read, _ = read_scene(bpy.context, bpy.context.view_layer, SceneRequest([name]))
    mesh = read.targets[0].mesh
    assert mesh.uv is not None
    return Subject(
        scene,
        name,
        size,
        rasterize(name, mesh.uv, size, size, skip=zero_area(mesh)).owner,
        owners_by_centre(mesh.uv, size, size),
        sum(len(each.mesh.triangles) for each in read.occluders),
        embree.rpartition(", ")[0],
    )
