"""Meshes and scenes from a few numbers. A cell is a place in the texture: (u0, v0, u1, v1)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from ...core.base.arrays import Doubles, Ints
from ...core.scene.scene import Camera, Instance, Mesh, Scene
from ...core.scene.world_mesh import WorldMesh

Cell = tuple[float, float, float, float]
WHOLE: Cell = (0.0, 0.0, 1.0, 1.0)
UNIT_SQUARE = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], dtype=np.float64)
PATCH = 2.0**-10  # a side so small that occlusion is linear over it
FAR = 4096.0  # stands for endless beside lengths of about 1
_BOX_FACES = np.array([(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)])


def in_cell(place: Doubles, cell: Cell, inset: float = 0.0) -> Doubles:
    """Points of the unit square, (..., 2), moved into a cell less `inset` of its sides all around."""
    low, high = np.array(cell[:2]), np.array(cell[2:])
    moved: Doubles = low + (inset + (1.0 - 2.0 * inset) * place) * (high - low)
    return moved


def grid_cells(columns: int, rows: int, cell: Cell = WHOLE) -> list[Cell]:
    """A cell cut into columns × rows, row by row from below."""
    u, v = np.linspace(cell[0], cell[2], columns + 1), np.linspace(cell[1], cell[3], rows + 1)
    return [(u[i], v[j], u[i + 1], v[j + 1]) for j in range(rows) for i in range(columns)]


def quads(corners: Doubles, uv: Doubles, name: str, faces: Ints | None = None) -> Mesh:
    """Two triangles a quad. corners: (Q, 4, 3), or (V, 3) with faces (Q, 4); uv: (Q, 4, 2)."""
    if faces is None:
        faces = np.arange(corners.size // 3, dtype=np.int32).reshape(-1, 4)
    halves = np.array([(0, 1, 2), (0, 2, 3)])
    return Mesh(
        name,
        corners.reshape(-1, 3).astype(np.float32),
        faces[:, halves].reshape(-1, 3).astype(np.int32),
        uv[:, halves].reshape(-1, 3, 2).astype(np.float32),
    )


def quad(
    corner: ArrayLike, along: ArrayLike, up: ArrayLike, cell: Cell = WHOLE, inset: float = 0.0, name: str = "quad"
) -> Mesh:
    """A parallelogram that faces along × up."""
    corners = np.asarray(corner, dtype=np.float64) + UNIT_SQUARE @ np.array([along, up], dtype=np.float64)
    return quads(corners[None], in_cell(UNIT_SQUARE, cell, inset)[None], name)


def plane(half: float = 1.0, height: float = 0.0, name: str = "plane", up: float = 1.0) -> Mesh:
    """A square of half-width `half` about the z axis that faces up, or down with up = -1."""
    return quad((-half, -half * up, height), (2 * half, 0, 0), (0, 2 * half * up, 0), name=name)


def patch(side: float = PATCH, x: float = 0.0, y: float = 0.0) -> Mesh:
    """A small piece of floor."""
    return quad((x - 0.5 * side, y - 0.5 * side, 0), (side, 0, 0), (0, side, 0), name="patch")


def tall_wall(x: float = -0.01) -> Mesh:
    """A wall without end that faces +x, on a floor and a little below: beside it all of x < 0 is hidden."""
    return quad((x, -FAR, -1), (0, 2 * FAR, 0), (0, 0, FAR), name="wall")


def grid(half: float, steps: int, turn: float = 0.0, name: str = "grid") -> Mesh:
    """A floor of steps × steps quads, turned about z by an angle in radians."""
    place = (
        np.stack(
            np.meshgrid(np.arange(steps + 1, dtype=np.int64), np.arange(steps + 1, dtype=np.int64)), axis=-1
        ).reshape(-1, 2)
        / steps
    )
    cos, sin = np.cos(turn), np.sin(turn)
    flat = half * (2.0 * place - 1.0) @ np.array([(cos, sin), (-sin, cos)])
    first = (np.arange(steps, dtype=np.int64)[:, None] * (steps + 1) + np.arange(steps, dtype=np.int64)).reshape(-1)
    faces = np.stack([first, first + 1, first + steps + 2, first + steps + 1], axis=1)
    return quads(np.column_stack([flat, np.zeros(len(flat))]), place[faces], name, faces.astype(np.int32))


def box(
    low: ArrayLike = (-1, -1, -1),
    high: ArrayLike = (1, 1, 1),
    cell: Cell = WHOLE,
    inset: float = 0.06,
    inward: bool = False,
    name: str = "box",
) -> Mesh:
    """Six charts, three beside two. Neighbours share their corners to the bit. inward: seen from inside."""
    bits = np.array(list(np.ndindex(2, 2, 2)))
    corners = np.where(bits == 1, np.asarray(high, dtype=np.float64), np.asarray(low, dtype=np.float64))
    uv = np.stack([in_cell(UNIT_SQUARE, each, inset) for each in grid_cells(3, 2, cell)])
    made = quads(corners, uv, name, _BOX_FACES.astype(np.int32))
    return turned_over(made) if inward else made


def block(half: ArrayLike = 1.0, name: str = "block") -> Mesh:
    """A closed box about the origin that faces outwards; its sides take equal parts of the texture."""
    made = turned_over(room(name=name))
    return replace(made, vertices=(made.vertices * np.asarray(half)).astype(np.float32))


def room(sides: Sequence[str] = ("-x", "+x", "-y", "+y", "-z", "+z"), name: str = "room") -> Mesh:
    """The inside of the cube of half-width 1, a chart a side; with fewer sides it is open."""
    walls = []
    for i, side in enumerate(sides):
        axis, sign = "xyz".index(side[1]), (-1.0 if side[0] == "-" else 1.0)
        outward, along, up = np.roll(np.eye(3), -axis, axis=0)  # a right-handed frame
        if sign > 0:  # the inside looks back
            along, up = up, along
        outward = sign * outward
        column, row = i % 3, i // 3
        cell = ((column + 0.04) / 3, (row + 0.03) / 2, (column + 0.96) / 3, (row + 0.97) / 2)
        walls.append(quad(outward - along - up, 2 * along, 2 * up, cell))
    return joined(walls, name)


def sphere(
    centre: ArrayLike = (0, 0, 0), radius: float = 1.0, segments: int = 64, smooth: bool = True, name: str = "sphere"
) -> Mesh:
    """Longitude along u, latitude along v; closed to the bit at the seam and the poles."""
    rings = segments // 2
    row, column = np.mgrid[: rings + 1, : segments + 1]
    polar, turn = np.pi * row / rings, 2 * np.pi * (column % segments) / segments
    unit = np.stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)], axis=-1)
    unit[0], unit[-1] = (0, 0, 1), (0, 0, -1)
    triangles = _band_triangles(rings, segments)
    uv = np.stack([column / segments, 1 - row / rings], axis=-1).reshape(-1, 2)
    normals = unit.reshape(-1, 3)
    return Mesh(
        name,
        (np.asarray(centre) + radius * normals).astype(np.float32),
        triangles,
        uv[triangles].astype(np.float32),
        normals[triangles].astype(np.float32) if smooth else None,
    )


def _band_triangles(rings: int, segments: int) -> Ints:
    at = np.arange((rings + 1) * (segments + 1), dtype=np.int64).reshape(rings + 1, -1)
    a, b, c, d = at[:-1, :-1].ravel(), at[1:, :-1].ravel(), at[1:, 1:].ravel(), at[:-1, 1:].ravel()
    halves = np.stack([a, b, c], 1)[:-segments], np.stack([a, c, d], 1)[segments:]
    triangles: Ints = np.concatenate(halves).astype(np.int32)
    return triangles


def cylinder(radius: float = 1.0, height: float = 2.0, segments: int = 64, smooth: bool = True) -> Mesh:
    """The side alone, open at both ends, seen from outside; once around along u."""
    turn = 2 * np.pi * (np.arange(segments + 1, dtype=np.int64) % segments) / segments
    round_ = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(segments + 1)])
    i = np.arange(segments, dtype=np.int64)
    corners = np.concatenate([radius * round_, radius * round_ + (0, 0, height)])
    faces = np.stack([i, i + 1, i + segments + 2, i + segments + 1], axis=1).astype(np.int32)
    uv = (UNIT_SQUARE + i[:, None, None] * np.array([1.0, 0.0])) / np.array([segments, 1])
    made = quads(corners, uv, "cylinder", faces)
    normals = round_[np.arange(len(corners), dtype=np.int64) % (segments + 1)][made.triangles].astype(np.float32)
    return replace(made, normals=normals) if smooth else made


def bowl(opening: float, segments: int = 96, smooth: bool = True) -> Mesh:
    """The inside of a unit sphere without the cap of half-angle `opening` (radians, from its centre) at the top."""
    rings = segments // 2
    row, column = np.mgrid[: rings + 1, : segments + 1]
    polar = opening + (np.pi - opening) * row / rings
    turn = 2 * np.pi * (column % segments) / segments
    unit = np.stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)], axis=-1)
    unit[-1] = (0, 0, -1)
    triangles = np.concatenate([_band_triangles(rings, segments)])
    extra = np.stack(
        [
            np.arange(segments, dtype=np.int64),
            np.arange(segments, dtype=np.int64) + segments + 2,
            np.arange(segments, dtype=np.int64) + 1,
        ],
        1,
    )
    triangles = np.concatenate([extra.astype(np.int32), triangles])
    uv = np.stack([column / segments, 1 - row / rings], axis=-1).reshape(-1, 2)
    flat = unit.reshape(-1, 3)
    made = Mesh("bowl", flat.astype(np.float32), triangles, uv[triangles].astype(np.float32))
    if smooth:
        made = replace(made, normals=flat[triangles].astype(np.float32))
    return turned_over(made)


def turned_over(mesh: Mesh) -> Mesh:
    """The mesh seen from its other side: winding and normals."""
    order = [0, 2, 1]
    return replace(
        mesh,
        triangles=np.ascontiguousarray(mesh.triangles[:, order]),
        uv=None if mesh.uv is None else np.ascontiguousarray(mesh.uv[:, order]),
        normals=None if mesh.normals is None else np.ascontiguousarray(-mesh.normals[:, order]),
    )


def joined(meshes: Sequence[Mesh], name: str = "joined") -> Mesh:
    """One mesh of several with UVs. Normals are kept where all have them."""
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes[:-1])])
    triangles = [mesh.triangles + start for mesh, start in zip(meshes, starts, strict=True)]
    normals = [mesh.normals for mesh in meshes if mesh.normals is not None]
    return Mesh(
        name,
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate(triangles).astype(np.int32),
        np.concatenate([mesh.uv for mesh in meshes if mesh.uv is not None]),
        np.concatenate(normals) if len(normals) == len(meshes) else None,
    )


def moved(mesh: Mesh, by: ArrayLike) -> Mesh:
    """The mesh with its vertices elsewhere, rounded to float32."""
    return replace(mesh, vertices=(mesh.vertices.astype(np.float64) + np.asarray(by)).astype(np.float32))


def with_tangents(mesh: Mesh, tangent: ArrayLike = (1, 0, 0), sign: float = 1.0) -> Mesh:
    """The mesh with this tangent, and sign of the bitangent, at every corner."""
    tangents = np.empty((*mesh.triangles.shape, 4), dtype=np.float32)
    tangents[..., :3], tangents[..., 3] = tangent, sign
    return replace(mesh, tangents=tangents)


def matrix(offset: ArrayLike = (0, 0, 0), scale: ArrayLike = 1.0, turned: bool = False) -> Doubles:
    """Scale, then turn about a skew axis, which spoils every coordinate, then move."""
    made = np.eye(4)
    made[:3, :3] = (skew_rotation() if turned else np.eye(3)) * np.asarray(scale, dtype=np.float64)
    made[:3, 3] = offset
    return made


def skewed(offset: ArrayLike = (0, 0, 0), scale: ArrayLike = 1.0) -> Doubles:
    """The same, turned."""
    return matrix(offset, scale, turned=True)


def skew_rotation() -> Doubles:
    """(3, 3): by 1.1 about (0.36, -0.48, 0.8)."""
    x, y, z = 0.36, -0.48, 0.8
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    turn: Doubles = np.eye(3) + np.sin(1.1) * cross + (1 - np.cos(1.1)) * cross @ cross
    return turn


def instance(mesh: Mesh, under: Doubles | None = None, name: str | None = None) -> Instance:
    """The mesh under a matrix, by default where it is; named like the mesh."""
    return Instance(name or mesh.name, mesh, np.eye(4) if under is None else under)


def scene(target: Mesh, *others: Mesh, under: Doubles | None = None, camera: Camera | None = None) -> Scene:
    """One target among others, itself an occluder, all under one matrix."""
    instances = [instance(mesh, under) for mesh in (target, *others)]
    return Scene(instances[:1], instances, camera)


def beside_a_wall(foot: Mesh | None = None, under: Doubles | None = None) -> Scene:
    """A patch of floor, or another, at the foot of a wall that hides all directions of x < 0: AO 0.5."""
    return scene(foot or patch(), tall_wall(), under=under)


def face_normals(mesh: Mesh | WorldMesh) -> Doubles:
    """(T, 3) float64 unit normals by winding; zero where there is no area."""
    a, b, c = (mesh.vertices[mesh.triangles[:, corner]].astype(np.float64) for corner in range(3))
    across = np.cross(b - a, c - a)
    normals: Doubles = across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-300)
    return normals


SKEW = skewed((3.0, -2.0, 1.0), 1.7)


def rimmed_room(width: float) -> tuple[Mesh, Mesh]:
    """The inside of the box of half-width 1 in two meshes: the strips along its edges, a chart each, and the rest."""
    bits = np.array(list(np.ndindex(2, 2, 2)))
    outer = (2.0 * bits - 1.0)[_BOX_FACES][:, ::-1]  # turned to face in
    middle = outer.mean(axis=1, keepdims=True)
    inner = middle + (1.0 - width) * (outer - middle)
    after = np.array([1, 2, 3, 0])
    strips = np.stack([outer, outer[:, after], inner[:, after], inner], axis=2).reshape(-1, 4, 3)
    cells = np.stack([in_cell(UNIT_SQUARE, cell, 0.02) for cell in grid_cells(4, 6)])
    rest = quads(inner, cells[:6], "rest")
    return quads(strips, cells, "rims"), replace(rest, uv=None)
