"""A low mesh baked from high ones: each texel takes its point, and its normal, from what it sees of them.

A ray a texel starts above the low surface, goes in through the texel's middle and ends as far below: it is blind to
the backs of faces, and what it meets first is the texel's point. It is one point, as in Blender's own baking from
selected to active, where a texel of the mesh itself is a piece of surface.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..base.arrays import Doubles, Flags, Floats, Ints, Longs
from ..base.elementary import arccos
from ..base.errors import InputError
from ..base.kernel_api import Control
from ..base.triangles import area_of, texels_of, unit_normals
from ..rays.embree import Device
from ..rays.flat_mesh import flat_surface
from ..rays.texel_surface import TexelSurface
from ..rays.trace_scene import TraceScene
from ..scene.parts import Part, parts_of
from ..scene.scene import HighPoly, Instance, Mesh
from ..scene.world_mesh import WorldMesh, world_mesh, world_surface

AUTOMATIC = 0.02  # of the diagonal of the low mesh's first part: how far above and below it is looked for high ones
TOLD = 0.01  # of the texels: where fewer find nothing, that is no matter for a warning
_AT_A_TIME = 1 << 18  # texels: each takes some 600 bytes on the way
_LAYERS = 8  # backs of faces that a ray passes before it is given up
_PAST = 2.0**-18  # how far behind one it goes on, of the numbers that the point is made of
# What points are lifted off triangles by, of their largest coordinate, and the lifts that they keep off the edges, but
# for a part of the triangle's height: as kernel/src/texel_groups.cpp has them.
_LIFT, _EDGE_MARGIN, _WIDEST_EDGE_MARGIN = 2.0**-20, 8.0, 0.25


@dataclass(frozen=True, eq=False)
class _Points:
    """Points of the high meshes, a row a texel. found: (N,) bool; the others are (N, 3) float32, sound where found."""

    found: Flags
    positions: Floats
    normals: Floats
    faces: Floats


def onto_high_poly(
    target: Instance,
    highs: HighPoly,
    low: TexelSurface,
    part: Part,
    device: Device,
    *,
    control: Control | None = None,
) -> TexelSurface:
    """The surface to bake in the place of a target's own.

    low: the part of the target, about its origin. Each texel becomes a triangle of no size, at the point that it sees,
    and those that see none lose their owner. Raises InputError where the cage is no cage of the target's; Cancelled,
    MemoryError.
    """
    surfaces = [flat_surface(each, part) for each in highs.meshes]
    scene = TraceScene(device)
    numbers = [scene.add(each.vertices, each.triangles) for each in surfaces]
    if max(numbers, default=-1) < 0:
        raise InputError(f"{target.name}: what it is baked from has no faces; choose high meshes that have")
    scene.commit(control)
    owned = np.flatnonzero(low.covered)
    starts, ways = _rays(target, highs, low, owned, part.origin)
    present = [each for each, number in zip(surfaces, numbers, strict=True) if number >= 0]
    batches = [slice(first, first + _AT_A_TIME) for first in range(0, len(owned), _AT_A_TIME)]
    seen = [_seen(scene, present, starts[batch], ways[batch], low.threads, control) for batch in batches]
    del starts, ways
    return _patches(low, owned, seen)


def _rays(
    target: Instance,
    highs: HighPoly,
    low: TexelSurface,
    owned: Longs,
    origin: Doubles,
) -> tuple[Floats, Floats]:
    """Where the rays of the owned texels start, and the way to the low surface: (N, 3) float32 each."""
    flowing = replace(low, mesh=replace(low.mesh, normals=_flowing_normals(low.mesh)))
    places, normals = (each.reshape(-1, 3)[owned] for each in (flowing.positions, flowing.normals))
    if highs.cage is not None:
        cage = replace(low, mesh=replace(flowing.mesh, vertices=_cage_of(target, highs.cage, origin)))
        starts = cage.positions.reshape(-1, 3)[owned]
    else:
        normals *= np.float32(highs.extrusion or extrusion_of(target))
        starts = normals
        starts += places
    places -= starts
    return starts, places


def corner_starts(target: Instance, highs: HighPoly, origin: Doubles) -> tuple[Floats, Floats]:
    """The corners of a target's triangles about `origin`, and where rays would start above them: on its cage, or so far
    off as highs are looked for; (T, 3, 3) float32 each. Raises InputError for a cage that is none."""
    low = world_surface(target, origin)
    corners = low.vertices[low.triangles]
    if highs.cage is not None:
        return corners, _cage_of(target, highs.cage, origin)[low.triangles]
    return corners, corners + np.float32(highs.extrusion or extrusion_of(target)) * _flowing_normals(low)


def extrusion_of(target: Instance) -> float:
    """How far highs are looked for, where nobody says: by the size of the mesh, but for what strays from it."""
    return AUTOMATIC * 2.0 * parts_of(target)[0].radius


def _cage_of(target: Instance, cage: Instance, origin: Doubles) -> Floats:
    if not _have_same_faces(cage.mesh, target.mesh):
        raise InputError(
            f"{target.name}: {cage.name} has other faces, so it cannot be its cage; make one from a copy of it"
        )
    return world_mesh(cage, origin).vertices


def _have_same_faces(a: Mesh, b: Mesh) -> bool:
    """Whether a vertex of one is that of the other. Faces that are not flat may be cut into triangles along another
    diagonal; what vertices they have is told by their corners, where these are known."""
    if len(a.vertices) != len(b.vertices) or a.triangles.shape != b.triangles.shape:
        return False
    return np.array_equal(a.triangles, b.triangles) or (
        a.corners is not None and b.corners is not None and _vertices_by_corner(a) == _vertices_by_corner(b)
    )


def _vertices_by_corner(mesh: Mesh) -> dict[int, int]:
    assert mesh.corners is not None
    return dict(zip(mesh.corners.reshape(-1).tolist(), mesh.triangles.reshape(-1).tolist(), strict=True))


def _flowing_normals(low: WorldMesh) -> Floats:
    """(T, 3, 3) normals that flow over all edges, hard ones too, where rays would part or cross: of each place of the
    mesh the mean of its faces', by their angles there."""
    corners = low.vertices[low.triangles].astype(np.float64)
    edges = np.roll(corners, -1, axis=1) - corners
    sides = edges / np.maximum(np.linalg.norm(edges, axis=2, keepdims=True), 1e-300)
    faces = unit_normals(corners)
    angles = arccos(np.clip(-(sides * np.roll(sides, 1, axis=1)).sum(axis=2), -1.0, 1.0))
    place = np.unique(low.vertices, axis=0, return_inverse=True)[1].ravel()[low.triangles]
    sums = np.zeros((int(place.max()) + 1, 3))
    for corner in range(3):
        np.add.at(sums, place[:, corner], angles[:, corner, None] * faces)
    normals = sums[place]
    length = np.linalg.norm(normals, axis=2, keepdims=True)
    flowing = np.where(length > 1e-9, normals / np.maximum(length, 1e-300), faces[:, None])
    return np.ascontiguousarray(flowing, dtype=np.float32)


def _seen(
    scene: TraceScene,
    surfaces: Sequence[WorldMesh],
    starts: Floats,
    ways: Floats,
    threads: int,
    control: Control | None,
) -> _Points:
    """What each ray meets first that faces it, as far behind the low surface as it starts before it."""
    points = _Points(np.zeros(len(starts), np.bool_), *(np.zeros_like(starts) for _ in range(3)))
    begun = np.zeros(len(starts), dtype=np.float32)  # how far along its way each ray starts
    left = np.flatnonzero(np.isfinite(starts).all(axis=1) & (np.abs(ways).max(axis=1, initial=0.0) > 0.0))
    for _ in range(_LAYERS):
        if not len(left):
            break
        along = ways[left]
        hits = scene.first_hits(starts[left] + begun[left, None] * along, along, 2.0 - begun[left], threads, control)
        met = np.flatnonzero(hits.met)
        place, shading, face = _at(surfaces, hits.geometry[met], hits.triangle[met], hits.weights[met])
        facing = (face * along[met]).sum(axis=1) < 0.0
        rows = left[met[facing]]
        points.found[rows] = True
        points.positions[rows], points.normals[rows], points.faces[rows] = (
            each[facing] for each in (place, shading, face)
        )
        behind = met[~facing]
        numbers = np.abs(starts[left[behind]]).max(axis=1) / np.abs(along[behind]).max(axis=1)
        begun[left[behind]] += hits.distance[behind] + np.float32(_PAST) * (numbers + 1.0)
        left = left[behind]
        left = left[begun[left] < 2.0]
    return points


def _at(surfaces: Sequence[WorldMesh], number: Ints, triangle: Ints, weights: Floats) -> tuple[Floats, Floats, Floats]:
    """Points, shading normals and faces' normals, (N, 3) float32 each, of triangles at barycentric weights."""
    places, shadings, normals = (np.zeros((len(number), 3), dtype=np.float32) for _ in range(3))
    for i, surface in enumerate(surfaces):
        rows = np.flatnonzero(number == i)
        which = triangle[rows]
        corners = surface.vertices[surface.triangles[which]].astype(np.float64)
        # The triangle may be larger than the point is far from the origin, and so are its roundings.
        lift = _LIFT * np.abs(corners).max(axis=(1, 2))[:, None]
        part = _off_the_edges(weights[rows].astype(np.float64), corners, lift)[:, :, None]
        face = _faces(surface, which, corners)
        shading = face if surface.normals is None else (part * surface.normals[which]).sum(axis=1)
        length = np.linalg.norm(shading, axis=1, keepdims=True)
        places[rows] = (part * corners).sum(axis=1) + lift * face
        shadings[rows] = np.where(length > 0.0, shading / np.maximum(length, 1e-300), face)
        normals[rows] = face
    return places, shadings, normals


def _off_the_edges(weights: Doubles, corners: Doubles, lift: Doubles) -> Doubles:
    """Weights, (N, 3), of points so many lifts off the edges of their triangles: on the edge itself a point would stand
    in the face beside it, and see what lies behind that."""
    edges = np.roll(corners, -1, axis=1) - corners
    opposite = np.linalg.norm(np.roll(edges, -1, axis=1), axis=2)  # to each corner
    doubled = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1, keepdims=True)
    margin = np.minimum(_EDGE_MARGIN * lift * opposite, _WIDEST_EDGE_MARGIN * doubled) / np.maximum(doubled, 1e-300)
    off = np.maximum(weights, margin)
    moved: Doubles = off / off.sum(axis=1, keepdims=True)
    return moved


def _faces(surface: WorldMesh, which: Ints, corners: Doubles) -> Doubles:
    across = unit_normals(corners)
    if surface.faces is None:
        return across
    known = surface.faces[which].astype(np.float64)
    faces: Doubles = np.where((known * known).sum(axis=1, keepdims=True) > 0.5, known, across)
    return faces


def _patches(low: TexelSurface, owned: Longs, seen: Sequence[_Points]) -> TexelSurface:
    """A triangle for each texel that sees a point: all three corners there, in the texture over the whole texel."""
    points = [*seen, _Points(np.zeros(0, np.bool_), *(np.zeros((0, 3), np.float32) for _ in range(3)))]
    rows = owned[np.concatenate([each.found for each in points])]
    height, width = low.owner.shape
    number = np.arange(len(rows), dtype=np.int32)
    owner = np.full(height * width, -1, dtype=np.int32)
    owner[rows] = number
    patches = WorldMesh(
        np.concatenate([each.positions[each.found] for each in points]),
        np.repeat(number[:, None], 3, axis=1),
        _cells(rows, width, height),
        np.concatenate([each.normals[each.found] for each in points])[:, None].repeat(3, axis=1),
        np.concatenate([each.faces[each.found] for each in points]),
        _spacing(low.mesh, width, height)[low.owner.reshape(-1)[rows]],
    )
    return replace(low, mesh=patches, owner=owner.reshape(height, width))


def missed_warning(name: str, found: int, texels: int) -> list[str]:
    """The line for a target of whose texels too few found a high mesh, or none. Raises InputError where none has."""
    if not found:
        raise InputError(f"{name}: none of its texels sees a high mesh; move them together, or raise the extrusion")
    share = 1.0 - found / texels
    if share < TOLD:
        return []
    return [
        f"{name}: {100.0 * share:.0f} % of its texels see no high mesh and are filled from those around; raise the "
        "extrusion, or close the gaps"
    ]


def _cells(texels: Longs, width: int, height: int) -> Floats:
    """(N, 3, 2) UVs of triangles that cover a texel each, and reach as far again beyond it."""
    y, x = np.divmod(texels, width)
    cells = np.empty((len(texels), 3, 2), dtype=np.float32)
    left, bottom = (x / width).astype(np.float32), ((height - 1 - y) / height).astype(np.float32)
    cells[:, :, 0], cells[:, :, 1] = left[:, None], bottom[:, None]
    cells[:, 1, 0] = ((x + 2) / width).astype(np.float32)
    cells[:, 2, 1] = ((height + 1 - y) / height).astype(np.float32)
    return cells


def _spacing(low: WorldMesh, width: int, height: int) -> Floats:
    """(T,) float32: the side of a square as large as a texel is on each triangle of the low mesh."""
    assert low.uv is not None
    area = area_of(low.vertices[low.triangles].astype(np.float64))
    texels = texels_of(low.uv, width, height)
    spacing: Floats = np.sqrt(np.divide(area, texels, out=np.zeros_like(area), where=texels > 0.0)).astype(np.float32)
    return spacing
