"""What blocks light, as trees of Embree's: which objects are within reach of a target, and how each is stored.

A target, or a part of it, is traced in float32 about an origin of its own. Its surface stands in a flat tree about that
origin, with all that rounding could move against it: what is large and near. So does what is worth building for this
one target, by the rays that it takes. All else is instanced, each piece of a mesh stored once for all targets, under a
top level that is made anew for each in a few microseconds an instance. How a target is traced follows from the scene
and from it alone, never from which others are baked: one baked alone and one baked among many are the same to the last
bit.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np

from ..base.arrays import Doubles, Flags, Longs
from ..base.kernel_api import Control
from ..base.singular_values import singular_values
from ..base.vectors import dot, length_of
from ..scene.parts import Part, parts_of
from ..scene.scene import Instance, Mesh
from ..scene.world_mesh import boxes_of
from .boxes import FARTHEST, Boxes, gaps
from .embree import Device
from .flat_mesh import flat_cutout, flat_mesh
from .pieces import Piece, pieces_of
from .ray_options import ALL_OCCLUDERS, RayOptions
from .trace_scene import RayFilter, TraceScene

# What is instanced is rounded by 2^-24 of its size and distance. Where these are below so many times the target's
# radius, or the gap between the two, that is less than what rays start off the surface by, or 2^-20 of the gap.
PRECISE = 16.0
# Rays through instances take up to a third longer, but what is flat has to be built for the one target: that takes as
# long as a few rays for each of its triangles save.
RAYS_A_TRIANGLE = 8
LEAST_COPIED, MOST_COPIED = 1 << 10, 1 << 20  # triangles, but for those that must be flat
_LEAST_SCALE = 1e-9  # of a matrix: its inverse, and the determinant, stay within float32's range


@dataclass(frozen=True, eq=False)
class TraceFrame:
    """A built scene and the world-space point that is its origin ((3,) float64).

    flat, instanced: places, in the list of occluders, of those in the flat tree and of those with instanced pieces.
    numbers: of what is flat and whole, as the scene counts them. triangles: of all.
    """

    scene: TraceScene
    origin: Doubles
    flat: frozenset[int]
    instanced: frozenset[int]
    numbers: Mapping[int, int]
    triangles: int

    def holds_others(self, own: int) -> bool:
        """Whether there is more in it than the one geometry of this number."""
        return len(self.flat | self.instanced) > (own >= 0)


_Key = tuple[int, int]  # a mesh and what of it is cut out


@dataclass(frozen=True, eq=False)
class _Rows:
    """Pieces of instances, a row each. place: (N,) int64, the instance's in the list of occluders. middle: (N, 3)
    float64, of the piece's box in world space, and half: half of that box's sides. stretch: (N,) float64, how much more
    than lengths its roundings are, in the piece's own space and back."""

    pieces: Sequence[Piece]
    place: Longs
    middle: Doubles
    half: Doubles
    stretch: Doubles
    triangles: Longs


class Occluders:
    """The occluders of a scene. Trees of pieces are built when first needed and kept, and so is the last frame."""

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
        boxes = boxes_of(self._instances)
        self.warnings += _leave_out_the_largest(instances, boxes)
        self._boxes = Boxes(boxes)
        self._linear = np.array([instance.matrix[:3, :3] for instance in instances]).reshape(-1, 3, 3)
        self._triangles = np.array([len(instance.mesh.triangles) for instance in self._instances], dtype=np.int64)
        self._named = _places_by(instance.name for instance in instances)
        self._owned = _places_by(instance.belongs_to for instance in instances)
        self._pieces: dict[_Key, list[Piece]] = {}
        self._rows, self._without_rows = _no_rows(), frozenset(range(len(instances)))
        self._latest: tuple[tuple[object, ...], TraceFrame] | None = None

    def frame_for(
        self,
        target: Instance,
        part: Part | None = None,
        surface: Sequence[Instance] = (),
        *,
        rays: float = 0.0,
        control: Control | None = None,
    ) -> TraceFrame:
        """The scene to trace a target in. part: which part of it, by default the first. surface: what rays start from,
        where that is not the target itself. rays: about how many there will be; for speed alone.

        Raises Cancelled, MemoryError.
        """
        part = part or parts_of(target)[0]
        own = frozenset(self.place_of(each) for each in surface or [target]) - {-1}
        box = part.low.tobytes(), part.high.tobytes()
        key = (target.name, id(target.mesh), target.matrix.tobytes(), *box, own, rays)
        if self._latest is None or self._latest[0] != key:
            self._latest = None  # free the old tree before the new one grows
            self._latest = key, self._build(self.within_reach(target, part.low, part.high), part, own, rays, control)
        return self._latest[1]

    def number_of(self, target: Instance, frame: TraceFrame) -> int:
        """The target's own geometry in a frame's scene, as `TraceScene.add` numbered it; -1: it does not occlude."""
        return frame.numbers.get(self.place_of(target), -1)

    def place_of(self, target: Instance) -> int:
        """The target's own geometry in the list of occluders; -1: it does not occlude."""
        named = self._named.get(target.name, ())
        return next((place for place in named if _is_same(self._instances[place], target)), -1)

    def within_reach(self, target: Instance, low: Doubles, high: Doubles) -> Flags:
        """(N,) bool: those that a box about the target, or a part of it, can be blocked by.

        low, high: (3,) float64, world space."""
        near = self._boxes.within_reach(low, high, self._options.reach)
        for owner, served in self._reserved.items():
            if target.name not in served:
                near[self._owned.get(owner, [])] = False
        return near

    def _build(
        self, reached: Flags, part: Part, own: frozenset[int], rays: float, control: Control | None
    ) -> TraceFrame:
        scene, numbers = TraceScene(self._device), dict[int, int]()
        for place in sorted(own):
            if reached[place]:
                numbers[place] = self._add_flat(scene, self._instances[place], part)
                reached[place] = False
        budget = min(max(rays / RAYS_A_TRIANGLE, LEAST_COPIED), MOST_COPIED)
        if int(self._triangles[reached].sum()) <= budget:  # nothing need be cut up
            for place in np.flatnonzero(reached).tolist():
                numbers[place] = self._add_flat(scene, self._instances[place], part)
                reached[place] = False
        rows = self._rows_but(own) if reached.any() else _no_rows()
        used = np.flatnonzero(reached[rows.place])
        flat = _stands_flat(rows, used, part, budget)
        for row in used[flat].tolist():
            piece, instance = rows.pieces[row], self._instances[rows.place[row]]
            self._add_flat(scene, replace(instance, mesh=piece.mesh, cutout=piece.cutout), part)
        self._add_instances(scene, rows, used[~flat], part.origin, control)
        scene.commit(control)
        triangles = int(self._triangles[list(numbers)].sum())
        return TraceFrame(
            scene,
            part.origin,
            frozenset(numbers) | frozenset(rows.place[used[flat]].tolist()),
            frozenset(rows.place[used[~flat]].tolist()),
            numbers,
            triangles + int(rows.triangles[used].sum()),
        )

    def _rows_but(self, own: frozenset[int]) -> _Rows:
        """Those of all occluders, but perhaps for these: what is never instanced need not be cut up."""
        if not self._without_rows <= own:
            first = len(self._without_rows) == len(self._instances)
            self._without_rows = own if first else frozenset()
            self._rows = self._cut_up([i for i in range(len(self._instances)) if i not in self._without_rows])
        return self._rows

    def _cut_up(self, places: Sequence[int]) -> _Rows:
        for place in places:
            instance = self._instances[place]
            if _key(instance) not in self._pieces:
                self._pieces[_key(instance)] = pieces_of(instance.mesh, instance.cutout)
        pieces = [self._pieces[_key(self._instances[place])] for place in places]
        every = list(chain.from_iterable(pieces))
        if not every:
            return _no_rows()
        of = np.repeat(np.array(places, dtype=np.int64), [len(each) for each in pieces])
        linear, shift = self._linear[of], np.array([self._instances[i].matrix[:3, 3] for i in of])
        with np.errstate(all="ignore"):  # a transform that is not finite has no reach
            middle = dot(linear, np.array([each.middle for each in every])[:, np.newaxis]) + shift
            half = dot(np.abs(linear), np.array([each.half for each in every])[:, np.newaxis])
        triangles = np.array([len(each.mesh.triangles) for each in every], dtype=np.int64)
        return _Rows(every, of, middle, half, _stretch(self._linear)[of], triangles)

    def _add_flat(self, scene: TraceScene, instance: Instance, part: Part) -> int:
        """Returns its number."""
        flat = flat_mesh(instance, part)
        ray_filter = RayFilter(flat_cutout(instance, flat), self._options.front_only)
        return scene.add(flat.vertices, flat.triangles, ray_filter, flat.whole)

    def _add_instances(
        self, scene: TraceScene, rows: _Rows, which: Longs, origin: Doubles, control: Control | None
    ) -> None:
        front_only = self._options.front_only
        geometries = [rows.pieces[row].geometry(self._device, front_only, control) for row in which.tolist()]
        matrices = np.empty((len(which), 3, 4))
        matrices[:, :, :3], matrices[:, :, 3] = self._linear[rows.place[which]], rows.middle[which] - origin
        scene.add_instances(geometries, matrices)


def _stands_flat(rows: _Rows, used: Longs, part: Part, budget: float) -> Flags:
    """(N,) bool, of the rows that are used: those that would be rounded too much, and the nearest of the others that
    have no more triangles than the budget together."""
    middle, half = rows.middle[used], rows.half[used]
    gap = gaps(middle - half, middle + half, part.low, part.high)
    away = length_of(middle - part.origin) + part.radius + length_of(half)
    flat: Flags = ~(away * rows.stretch[used] <= PRECISE * np.maximum(part.radius, gap))
    others = np.flatnonzero(~flat)
    nearest = others[np.argsort(gap[others], kind="stable")]
    flat[nearest[np.cumsum(rows.triangles[used][nearest]) <= budget]] = True
    return flat


def _stretch(linear: Doubles) -> Doubles:
    """(N,): the ratio of the singular values of (N, 3, 3) matrices; inf where Embree could not invert one."""
    finite = np.isfinite(linear).all(axis=(1, 2))
    values = np.zeros((len(linear), 3))
    values[finite] = singular_values(linear[finite])
    sound = (values[:, 2] > _LEAST_SCALE) & (values[:, 0] < 1.0 / _LEAST_SCALE)
    return np.divide(values[:, 0], values[:, 2], out=np.full(len(linear), np.inf), where=sound)


def _no_rows() -> _Rows:
    none, points = np.zeros(0, dtype=np.int64), np.zeros((0, 3))
    return _Rows([], none, points, points, np.zeros(0), none)


def _places_by(names: Iterable[str]) -> dict[str, list[int]]:
    places: dict[str, list[int]] = {}
    for place, name in enumerate(names):
        places.setdefault(name, []).append(place)
    return places


def _key(instance: Instance) -> _Key:
    """Equal for instances that can share a tree."""
    return id(instance.mesh), id(instance.cutout)


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
