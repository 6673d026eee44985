"""What blocks light, as trees of Embree's: which objects are within reach, which are instanced, in whose frame.

A bake is traced in float32 about the middle of its object. Meshes that stand in the scene once become part of one flat
tree; those that stand in it often, and are large, are stored once and instanced.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..base.arrays import Doubles, Floats
from ..scene.scene import Instance, Mesh
from ..scene.world_mesh import bounds_of, centre_of, mirrors, world_mesh
from .embree import Device
from .kernel_api import Control
from .ray_options import ALL_OCCLUDERS, RayOptions
from .trace_scene import Geometry, RayFilter, TraceScene

# A copy costs memory, an instance tracing time: below so many extra triangles a repeated mesh is copied.
COPIED_TRIANGLES = 1 << 18
# An object may be baked in a frame whose origin is off its middle by so many of its radii: two bits of a float32's 24.
FRAME_RADII = 4.0
# Occluders larger than this, or farther off, are left out: lengths cubed would leave float32's range (scene.py).
FARTHEST = 1e12


_Key = tuple[int, int]  # a mesh and what of it is cut out


@dataclass(frozen=True, eq=False)
class TraceFrame:
    """A built scene and the world-space point that is its origin ((3,) float64)."""

    scene: TraceScene
    origin: Doubles
    flat: frozenset[int]  # places, in the list of occluders, of those in the flat tree
    instanced: frozenset[int]
    numbers: Mapping[int, int]  # of those in the flat tree, as the scene counts them
    triangles: int  # of all, instances counted each

    def serves(self, target: Instance, own: int, wanted: frozenset[int]) -> bool:
        """Whether the target may be traced in it: near enough, not itself an instance, nothing wanted missing."""
        low, high = bounds_of(target)
        radius = 0.5 * float(np.linalg.norm(high - low))
        near = float(np.linalg.norm(centre_of(target) - self.origin)) <= FRAME_RADII * radius
        return near and own not in self.instanced and wanted == self.flat | self.instanced

    def holds_others(self, own: int) -> bool:
        """Whether there is more in it than the one geometry of this number."""
        return len(self.flat) + len(self.instanced) > (own >= 0)


class Occluders:
    """The occluders of a scene, built when first needed and kept for the next object where that costs no precision."""

    def __init__(
        self,
        device: Device,
        instances: Sequence[Instance],
        options: RayOptions = ALL_OCCLUDERS,
        reserved: Mapping[str, Collection[str]] | None = None,
    ) -> None:
        """options: how far occluders count, and whether from behind. reserved: by name, objects that block light for
        these targets alone."""
        self._device = device
        self._options = options
        self._reserved = reserved or {}
        distinct = {_key(instance): instance for instance in instances}
        sound = {key: _without_broken(each) for key, each in distinct.items()}  # once a mesh, or none would be shared
        self._instances = [
            replace(instance, mesh=sound[_key(instance)].mesh, cutout=sound[_key(instance)].cutout)
            for instance in instances
        ]
        self.warnings = _warnings(instances, self._instances)
        self._boxes = np.array([bounds_of(instance) for instance in self._instances]).reshape(-1, 2, 3)
        self.warnings += _leave_out_the_largest(instances, self._boxes)
        self._geometries: dict[_Key, tuple[Geometry, Doubles]] = {}
        self._frame: TraceFrame | None = None

    def frame_for(self, target: Instance, control: Control | None = None) -> TraceFrame:
        """The scene to trace the target in. Raises Cancelled, MemoryError."""
        wanted = self._within_reach(target)
        own = self._place_of(target)
        if self._frame is None or not self._frame.serves(target, own, wanted):
            self._frame = None  # free the old tree before the new one grows
            self._frame = self._build(target, own, wanted, control)
        return self._frame

    def number_of(self, target: Instance, frame: TraceFrame) -> int:
        """The target's own geometry in a frame's scene, as `TraceScene.add` numbered it; -1: it does not occlude."""
        return frame.numbers.get(self._place_of(target), -1)

    def _place_of(self, target: Instance) -> int:
        return next((i for i, instance in enumerate(self._instances) if _is_same(instance, target)), -1)

    def _within_reach(self, target: Instance) -> frozenset[int]:
        """Places of the occluders whose boxes come as near the target's as rays go."""
        own_low, own_high = bounds_of(target)
        low, high = self._boxes[:, 0], self._boxes[:, 1]
        gap = np.maximum(np.maximum(low - own_high, own_low - high), 0.0)
        near = np.isfinite(self._boxes).all(axis=(1, 2))
        near[near] = np.linalg.norm(gap[near], axis=1) <= min(self._options.reach * (1.0 + 1e-6), FARTHEST)
        places: list[int] = np.flatnonzero(near).tolist()
        return frozenset(i for i in places if self._may_occlude(self._instances[i], target))

    def _may_occlude(self, occluder: Instance, target: Instance) -> bool:
        return target.name in self._reserved.get(occluder.belongs_to, (target.name,))

    def _build(self, target: Instance, own: int, wanted: frozenset[int], control: Control | None) -> TraceFrame:
        origin = centre_of(target)
        scene = TraceScene(self._device)
        instanced: set[int] = set()
        numbers: dict[int, int] = {}
        for uses in self._by_mesh(wanted):
            first = self._instances[uses[0]]
            many = (len(uses) - 1) * len(first.mesh.triangles) > COPIED_TRIANGLES
            apart = {i for i in uses if i != own} if many else set()
            for i in uses:
                if i not in apart:
                    numbers[i] = self._add_copy(scene, self._instances[i], origin)
            if apart:
                self._add_instances(scene, first, sorted(apart), origin, control)
                instanced |= apart
        scene.commit(control)
        triangles = sum(len(self._instances[i].mesh.triangles) for i in wanted)
        return TraceFrame(scene, origin, wanted - instanced, frozenset(instanced), numbers, triangles)

    def _by_mesh(self, wanted: frozenset[int]) -> list[list[int]]:
        groups: dict[_Key, list[int]] = {}
        for i in sorted(wanted):
            groups.setdefault(_key(self._instances[i]), []).append(i)
        return list(groups.values())

    def _add_copy(self, scene: TraceScene, instance: Instance, origin: Doubles) -> int:
        """In the flat tree; returns its number."""
        copy, ray_filter = world_mesh(instance, origin), RayFilter(instance.cutout, self._options.front_only)
        if instance.cutout is not None and mirrors(instance):  # corners have changed places
            swapped = np.ascontiguousarray(instance.cutout.uv[:, [0, 2, 1]])
            ray_filter = replace(ray_filter, cutout=replace(instance.cutout, uv=swapped))
        return scene.add(copy.vertices, copy.triangles, ray_filter)

    def _add_instances(
        self, scene: TraceScene, first: Instance, uses: list[int], origin: Doubles, control: Control | None
    ) -> None:
        if _key(first) not in self._geometries:
            ray_filter = RayFilter(first.cutout, self._options.front_only)
            self._geometries[_key(first)] = _centred(self._device, first.mesh, ray_filter, control)
        geometry, centre = self._geometries[_key(first)]
        matrices = np.array([self._instances[i].matrix for i in uses])
        matrices[:, :3, 3] += matrices[:, :3, :3] @ centre - origin
        scene.add_instances(geometry, matrices[:, :3])


def _key(instance: Instance) -> _Key:
    """Equal for instances that can share a tree."""
    return id(instance.mesh), id(instance.cutout)


def _centred(device: Device, mesh: Mesh, ray_filter: RayFilter, control: Control | None) -> tuple[Geometry, Doubles]:
    """The mesh about the middle of its own box, and that middle."""
    centre: Doubles = np.mean(mesh.box, axis=0)
    vertices: Floats = (mesh.vertices - centre).astype(np.float32)
    return Geometry(device, vertices, mesh.triangles, control, ray_filter), centre


def _is_same(instance: Instance, target: Instance) -> bool:
    return (
        instance.name == target.name and instance.mesh is target.mesh and np.array_equal(instance.matrix, target.matrix)
    )


def _without_broken(instance: Instance) -> Instance:
    """Without the triangles that touch a non-finite vertex: Embree would drop them without a word."""
    mesh, cutout = instance.mesh, instance.cutout
    sound = np.isfinite(mesh.vertices).all(axis=1)
    if sound.all():
        return instance
    vertices = np.where(sound[:, None], mesh.vertices, np.float32(0.0))
    kept = sound[mesh.triangles].all(axis=1)
    if cutout is not None:
        cutout = replace(cutout, alpha=cutout.alpha[kept], uv=cutout.uv[kept])
    return replace(instance, mesh=Mesh(mesh.name, vertices, mesh.triangles[kept]), cutout=cutout)


def _leave_out_the_largest(instances: Sequence[Instance], boxes: Doubles) -> list[str]:
    """Occluders too large to trace lose their boxes; returns a warning each."""
    with np.errstate(invalid="ignore"):  # infinite ones
        large = ~((boxes[:, 1] - boxes[:, 0]).max(axis=1, initial=0.0) <= FARTHEST)
    boxes[large] = np.nan
    names = [instances[i].name for i in np.flatnonzero(large) if np.isfinite(instances[i].matrix).all()]
    return [f"{name}: it is more than {FARTHEST:g} units across; it does not occlude" for name in names]


def _warnings(given: Sequence[Instance], used: Sequence[Instance]) -> list[str]:
    lines = []
    for old, new in zip(given, used, strict=True):
        if not np.isfinite(old.matrix).all():
            lines.append(f"{old.name}: its transform is not finite; it does not occlude")
        elif old.mesh is not new.mesh:
            lines.append(f"{old.name}: triangles with non-finite vertices do not occlude")
    return lines
