"""What an object's texture depends on, as one hash: what has the same one need not be baked again.

It is of what the bake reads, not of where that came from: the target's arrays and place, what blocks light within reach
and in which order, light and camera where a map asks for them, and all settings that change a value. Names do not
count, nor does what lies out of reach.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from .base.arrays import Bytes
from .base.digest import SIZE, digest
from .base.version import ALGORITHM
from .rays.map_spec import Axis
from .rays.occluders import Occluders
from .scene.scene import Instance, Mesh, Scene
from .scene.world_mesh import bounds_of
from .settings import Settings


class InputHashes:
    """Of the targets of one bake. What several of them share is looked at once, and not before it is asked for."""

    def __init__(self, scene: Scene, settings: Settings, occluders: Occluders) -> None:
        self._scene, self._settings, self._occluders = scene, settings, occluders
        self._known: dict[int, tuple[Any, bytes]] = {}  # by id; what is known is kept, so that no other gets its id

    def of(self, target: Instance, tile: int | None = None) -> str:
        """Of a target's texture, or of one tile of it: 64 hexadecimal digits."""
        highs = self._scene.highs.get(target.name)
        surfaces = [target] if highs is None else highs.meshes
        sources = None
        if highs is not None:
            cage = None if highs.cage is None else self._surface(highs.cage)
            sources = [self._surface(each) for each in highs.meshes], cage, highs.extrusion
        of_its_own = self._surface(target), self._once(target.normal_map), sources, tile
        return digest(self._common, *of_its_own, self._blockers(target, surfaces)).hex()

    @cached_property
    def _common(self) -> bytes:
        """What counts for all targets."""
        scene, settings = self._scene, self._settings
        camera = scene.camera if any(each.axis is Axis.REFLECTED for each in settings.specs) else None
        light = scene.environment if settings.needs_light else None
        return digest(ALGORITHM, replace(settings, threads=0), camera, light)

    @cached_property
    def _rows(self) -> Bytes:
        """(N, SIZE) uint8: a digest of each occluder."""
        rows = [digest(self._shape(each.mesh), each.matrix, self._once(each.cutout)) for each in self._scene.occluders]
        return np.frombuffer(b"".join(rows), dtype=np.uint8).reshape(-1, SIZE)

    @cached_property
    def _all_rows(self) -> bytes:
        return digest(self._rows)

    def _blockers(self, target: Instance, surfaces: Sequence[Instance]) -> bytes:
        """Of what is within reach of a box about the target, and which of it are the surfaces that rays start from."""
        reached = self._occluders.within_reach(target, *bounds_of(target))
        rows = self._all_rows if reached.all() else digest(self._rows[reached])
        places = [self._occluders.place_of(each) for each in surfaces]
        return digest(rows, [int(np.count_nonzero(reached[:place])) if place >= 0 else -1 for place in places])

    def _shape(self, mesh: Mesh) -> bytes:
        return self._once(mesh.vertices) + self._once(mesh.triangles)

    def _surface(self, instance: Instance) -> bytes:
        mesh = instance.mesh
        return digest(self._shape(mesh), *map(self._once, (mesh.uv, mesh.normals, mesh.tangents)), instance.matrix)

    def _once(self, value: Any) -> bytes:
        if id(value) not in self._known:
            self._known[id(value)] = value, digest(value)
        return self._known[id(value)][1]
