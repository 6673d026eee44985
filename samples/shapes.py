"""Meshes from numbers: grids, lathed profiles, prisms, boxes, pebbles."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from math import radians

import bmesh
import bpy
import numpy as np
from mathutils import Matrix, Vector
from numpy.typing import ArrayLike, NDArray

Doubles = NDArray[np.float64]
Pair = tuple[float, float]
Triple = tuple[float, float, float]

INSET = 0.004  # of the texture's edge, kept free around a chart that would else touch its border


@contextmanager
def drawn(mesh: bpy.types.Mesh) -> Iterator[bmesh.types.BMesh]:
    """Edit a mesh as a BMesh and write it back."""
    draft = bmesh.new()
    draft.from_mesh(mesh)
    yield draft
    draft.to_mesh(mesh)
    draft.free()


@contextmanager
def solid(mesh: bpy.types.Mesh) -> Iterator[bmesh.types.BMesh]:
    """The same for flat-shaded meshes without UVs, their faces in an order that does not change from run to run.

    BMesh operators that extrude, fill and thicken hash pointers, and leave the order of faces and corners to chance;
    charts, packing and bevels then differ too.
    """
    with drawn(mesh) as draft:
        yield draft
    faces = []
    for face in mesh.polygons:
        corners = face.vertices[:]
        first = corners.index(min(corners))
        faces.append((corners[first:] + corners[:first], face.material_index))
    vertices = [vertex.co.copy() for vertex in mesh.vertices]
    mesh.clear_geometry()
    mesh.from_pydata(vertices, [], [corners for corners, _ in sorted(faces)])
    mesh.polygons.foreach_set("material_index", [slot for _, slot in sorted(faces)])


def sheet(name: str, points: ArrayLike, closed: bool = False, smooth: bool = True) -> bpy.types.Mesh:
    """Quads over a (rows, columns, 3) net of points, or (sheets, rows, columns, 3) for several in one mesh.

    UVs follow the net: columns along u, rows along v, a cell of the unit square per sheet. `closed` joins the last row
    to the first. Faces look up where columns run along x and rows along y.
    """
    nets = np.asarray(points, dtype=np.float64)
    nets = nets[None] if nets.ndim == 3 else nets
    count, rows, columns = nets.shape[:3]
    row, column = np.mgrid[: rows - (not closed), : columns - 1].reshape(2, -1, 1)
    corner = np.array([(0, 0), (0, 1), (1, 1), (1, 0)])
    place = (row + corner[:, 0]) % rows * columns + column + corner[:, 1]
    faces = (np.arange(count, dtype=np.int64)[:, None, None] * rows * columns + place).reshape(-1, 4)
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(nets.reshape(-1, 3), [], faces.tolist())
    along = np.stack([(column + corner[:, 1]) / (columns - 1), (row + corner[:, 0]) / (rows - (not closed))], axis=-1)
    set_uv(mesh, np.concatenate([_cell(along, index, count) for index in range(count)]))
    mesh.polygons.foreach_set("use_smooth", [smooth] * len(faces))
    return mesh


def set_uv(mesh: bpy.types.Mesh, uv: Doubles) -> None:
    """Store UVs per face corner, any shape that ravels to (corners, 2)."""
    layer = mesh.uv_layers.new(name="UVMap")
    layer.uv.foreach_set("vector", np.ravel(uv).astype(np.float32))


def plane(name: str, width: float, depth: float) -> bpy.types.Mesh:
    """A rectangle about the origin, facing up."""
    x, y = np.meshgrid((-width / 2, width / 2), (-depth / 2, depth / 2))
    return sheet(name, np.stack([x, y, np.zeros_like(x)], axis=-1), smooth=False)


def lathe(name: str, profile: Sequence[Pair], segments: int = 64, crease: float = 40.0) -> bpy.types.Mesh:
    """Turn a profile of (radius, height) pairs about z; the surface faces right of the way it runs.

    UVs: angle along u, length along the profile up v. Edges sharper than `crease` degrees are shaded sharp.
    """
    radius, height = np.array(profile, dtype=np.float64).T
    angle = np.linspace(0.0, 2.0 * np.pi, segments + 1)[:, None]
    net = np.stack([radius * np.cos(angle), radius * np.sin(angle), height + 0.0 * angle], axis=-1)
    mesh = sheet(name, net.transpose(1, 0, 2))
    length = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(radius), np.diff(height)))])
    uv = np.empty(len(mesh.loops) * 2, dtype=np.float32)
    layer = mesh.uv_layers[0].uv
    layer.foreach_get("vector", uv)
    step = (uv[1::2] - INSET) / (1.0 - 2.0 * INSET) * (len(profile) - 1)
    uv[1::2] = INSET + (1.0 - 2.0 * INSET) * np.interp(
        step, np.arange(len(profile), dtype=np.int64), length / length[-1]
    )
    layer.foreach_set("vector", uv)
    with drawn(mesh) as draft:
        bmesh.ops.remove_doubles(draft, verts=draft.verts[:], dist=1e-6)
    mesh.set_sharp_from_angle(angle=radians(crease))
    return mesh


def arc(centre: Pair, radius: float, start: float, end: float, steps: int = 8) -> list[Pair]:
    """Points on a circle, from `start` to `end` degrees, both ends included."""
    angles = np.radians(np.linspace(start, end, steps + 1))
    return [(centre[0] + radius * float(np.cos(a)), centre[1] + radius * float(np.sin(a))) for a in angles]


def prism(
    draft: bmesh.types.BMesh,
    outline: Sequence[Pair],
    along: Triple,
    place: Matrix,
    holes: Sequence[Sequence[Pair]] = (),
    slot: int = 0,
) -> None:
    """Draw an outline with holes in the plane `place` maps xy to, and extrude it by the vector `along`."""
    edges = []
    for loop in (outline, *holes):
        corners = [draft.verts.new(place @ Vector((*point, 0.0))) for point in loop]
        edges += [draft.edges.new((corners[i - 1], corners[i])) for i in range(len(corners))]
    filled = bmesh.ops.triangle_fill(draft, use_beauty=True, use_dissolve=True, edges=edges)["geom"]
    faces = [piece for piece in filled if isinstance(piece, bmesh.types.BMFace)]
    grown = bmesh.ops.extrude_face_region(draft, geom=faces, use_keep_orig=True)["geom"]
    bmesh.ops.translate(draft, vec=along, verts=[piece for piece in grown if isinstance(piece, bmesh.types.BMVert)])
    walls = {face for edge in edges for face in edge.link_faces}
    solid = list({*faces, *(piece for piece in grown if isinstance(piece, bmesh.types.BMFace)), *walls})
    bmesh.ops.recalc_face_normals(draft, faces=solid)
    for face in solid:
        face.material_index = slot


def box(draft: bmesh.types.BMesh, low: Triple, high: Triple, slot: int = 0) -> None:
    """An axis-aligned box between two corners."""
    size = [top - bottom for bottom, top in zip(low, high, strict=True)]
    middle = [(top + bottom) / 2 for bottom, top in zip(low, high, strict=True)]
    made = bmesh.ops.create_cube(draft, size=1.0, matrix=Matrix.LocRotScale(middle, None, size))
    for face in {face for vertex in made["verts"] for face in vertex.link_faces}:
        face.material_index = slot


def boxes(name: str, *corners: tuple[Triple, Triple]) -> bpy.types.Mesh:
    """A mesh of axis-aligned boxes."""
    mesh = bpy.data.meshes.new(name)
    with solid(mesh) as draft:
        for low, high in corners:
            box(draft, low, high)
    return mesh


def pebble(name: str, seed: int, detail: int = 3) -> bpy.types.Mesh:
    """A worn stone of about unit radius: a sphere with a few flats ground off, shaded smooth."""
    mesh = bpy.data.meshes.new(name)
    with drawn(mesh) as draft:
        bmesh.ops.create_icosphere(draft, subdivisions=detail, radius=1.0)
    rng = np.random.default_rng(seed)
    grinders = rng.normal(size=(9, 3))
    grinders /= np.linalg.norm(grinders, axis=1, keepdims=True)
    depth = rng.uniform(0.55, 0.9, size=9)
    points = np.array([vertex.co for vertex in mesh.vertices])
    # A smooth minimum over the flats: the p-norm rounds the edges between them.
    reach = np.sum(np.maximum(points @ grinders.T / depth, 0.0) ** 8, axis=1) + 1.0
    mesh.vertices.foreach_set("co", np.ravel(points * reach[:, None] ** (-1 / 8)).astype(np.float32))
    mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
    return mesh


def _cell(uv: Doubles, index: int, count: int) -> Doubles:
    """Move unit-square UVs into one of `count` cells, stacked up v."""
    inside = INSET + (1.0 - 2.0 * INSET) * uv
    return (inside + np.array((0, index))) / (1, count) if count > 1 else inside
