"""What is wrong with meshes that people bake all the same: fins, doubled faces, needles, sheets of one side."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ....core.base.arrays import Doubles, Ints
from .polygon_mesh import PolygonMesh, copies, joined, net, net_faces, of_faces, unwelded


def fins(pages: int, rows: int = 3) -> PolygonMesh:
    """Sheets of quads that share one edge line, as the pages of a book do."""
    turn = 2.0 * np.pi * np.arange(pages, dtype=np.int64) / pages
    spine = np.stack([np.zeros(rows + 1), np.zeros(rows + 1), np.arange(rows + 1.0)], axis=1)
    edge = np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1)
    vertices = np.concatenate([spine, (edge[:, None] + spine).reshape(-1, 3)])
    page, row = np.divmod(np.arange(pages * rows, dtype=np.int64), rows)
    outer = rows + 1 + page * (rows + 1) + row
    return of_faces(vertices, np.stack([row, outer, outer + 1, row + 1], axis=1))


def t_junctions(cells: int) -> PolygonMesh:
    """A row of large quads beside a row of small ones that share only every other corner with it."""
    big = np.array([[(2 * c, 0, 0), (2 * c + 2, 0, 0), (2 * c + 2, 2, 0), (2 * c, 2, 0)] for c in range(cells)])
    small = np.array([[(c, 2, 0), (c + 1, 2, 0), (c + 1, 3, 0.5), (c, 3, 0.5)] for c in range(2 * cells)])
    return joined([copies(big, np.arange(4, dtype=np.int64)), copies(small, np.arange(4, dtype=np.int64))])


def bow_tie(cells: int) -> PolygonMesh:
    """Two sheets joined in a vertex."""
    x, y = np.meshgrid(np.arange(cells + 1.0), np.arange(cells + 1.0))
    sheet = np.stack([x, y, 0.1 * np.sin(x) * np.sin(y)], axis=-1).reshape(-1, 3)
    count = len(sheet)
    faces = net_faces(cells + 1, cells + 1)
    other = np.where(faces == 0, 0, faces + count - 1)  # its corner at the origin is the first sheet's
    return of_faces(np.concatenate([sheet, -sheet[1:]]), faces, other)


def moebius(steps: int, rows: int = 2, width: float = 0.4) -> PolygonMesh:
    """A strip that has one side."""
    turn = 2.0 * np.pi * np.arange(steps, dtype=np.int64) / steps
    across = np.linspace(-width, width, rows + 1)[:, None]
    reach = 1.0 + across * np.cos(0.5 * turn)
    points = np.stack([reach * np.cos(turn), reach * np.sin(turn), across * np.sin(0.5 * turn)], axis=-1)
    return _closed_with_a_flip(points)


def klein(steps: int, around: int = 12) -> PolygonMesh:
    """Klein's bottle as a figure of eight turned about itself: closed, with one side, through itself."""
    turn, roll = (
        2.0 * np.pi * np.arange(steps, dtype=np.int64) / steps,
        2.0 * np.pi * np.arange(around, dtype=np.int64)[:, None] / around,
    )
    reach = 2.0 + np.cos(0.5 * turn) * np.sin(roll) - np.sin(0.5 * turn) * np.sin(2.0 * roll)
    height = np.sin(0.5 * turn) * np.sin(roll) + np.cos(0.5 * turn) * np.sin(2.0 * roll)
    points = np.stack([reach * np.cos(turn), reach * np.sin(turn), height], axis=-1)
    return _closed_with_a_flip(points, close_rows=True)


def needles(count: int, seed: int, thin: float = 1e-4) -> PolygonMesh:
    """A strip of triangles as long as the strip, and loose ones thinner and thinner."""
    x = np.linspace(0.0, thin * count, count + 1)
    strip = net(np.stack([np.stack([x, np.zeros_like(x), 0.0 * x], 1), np.stack([x, np.ones_like(x), 0.0 * x], 1)]))
    width = 10.0 ** np.random.default_rng(seed).uniform(-8.0, 0.0, count)
    corners = np.zeros((count, 3, 3))
    corners[:, 1, 0], corners[:, 2, 1] = 1.0, width
    corners[..., 2] = 0.5 + np.arange(count, dtype=np.int64)[:, None]
    return joined([strip, copies(corners, np.arange(3, dtype=np.int64))])


def one_triangle() -> PolygonMesh:
    """All there is."""
    return of_faces([(0, 0, 0), (2, 0, 0), (0, 1, 0)], [[0, 1, 2]])


def collinear_polygon(corners: int) -> PolygonMesh:
    """A square as one n-gon, all but four of whose corners lie in the middle of one side, and a neighbour above."""
    along = np.linspace(0.0, 1.0, corners - 2)
    outline = [*((x, 0.0, 0.0) for x in along), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0)]
    count = len(outline)
    above = [(1.0, 1.0, 1.0), (0.0, 1.0, 1.0)]
    return of_faces([*outline, *above], [[*range(count)]], [[count - 1, count - 2, count, count + 1]])


def _doubled(mesh: PolygonMesh, chosen: Ints) -> PolygonMesh:
    return _with(mesh, mesh.triangles[chosen])


def _turned(mesh: PolygonMesh, chosen: Ints) -> PolygonMesh:
    return _with(mesh, mesh.triangles[chosen][:, ::-1])


def _no_area(mesh: PolygonMesh, chosen: Ints) -> PolygonMesh:
    first = mesh.triangles[chosen]
    return _with(mesh, np.concatenate([first[:, [0, 0, 1]], first[:1, [2, 2, 2]]]))


def _mixed_winding(mesh: PolygonMesh, chosen: Ints) -> PolygonMesh:
    """Whole polygons turned over."""
    over = np.isin(mesh.polygons, mesh.polygons[chosen])
    return mesh._replace(triangles=np.where(over[:, None], mesh.triangles[:, ::-1], mesh.triangles))


def _with_holes(mesh: PolygonMesh, chosen: Ints) -> PolygonMesh:
    kept = ~np.isin(mesh.polygons, mesh.polygons[chosen])
    kept[: 1 if kept.any() else len(kept)] = True
    return mesh._replace(triangles=mesh.triangles[kept], polygons=mesh.polygons[kept])


def _with(mesh: PolygonMesh, triangles: Ints) -> PolygonMesh:
    """With more triangles, each a polygon."""
    more = int(mesh.polygons.max()) + 1 + np.arange(len(triangles), dtype=np.int64)
    return PolygonMesh(
        mesh.vertices,
        np.concatenate([mesh.triangles, triangles]).astype(np.int32),
        np.concatenate([mesh.polygons, more]).astype(np.int32),
    )


def _closed_with_a_flip(points: Doubles, close_rows: bool = False) -> PolygonMesh:
    """A net whose last column meets the first upside down."""
    rows, columns = points.shape[:2]
    faces = net_faces(rows, columns, close_rows, close_columns=True)
    row, column = np.divmod(faces, columns)
    first = np.arange(len(faces), dtype=np.int64) % columns == columns - 1
    flipped = first[:, None] & (column == 0)
    mirrored = (-row) % rows if close_rows else rows - 1 - row
    return of_faces(points, np.where(flipped, mirrored * columns, faces))


DEFECTS: dict[str, Callable[[PolygonMesh, Ints], PolygonMesh]] = {
    "none": lambda mesh, chosen: mesh,
    "doubled": _doubled,
    "turned doubles": _turned,
    "no area": _no_area,
    "mixed winding": _mixed_winding,
    "holes": _with_holes,
    "unwelded": lambda mesh, chosen: unwelded(mesh),
}


def spoiled(mesh: PolygonMesh, defect: str, seed: int, share: float = 0.1) -> PolygonMesh:
    """The mesh with one of DEFECTS in a random share of its triangles, at least one."""
    count = len(mesh.triangles)
    chosen = np.random.default_rng(seed).choice(count, max(1, int(share * count)), replace=False)
    return DEFECTS[defect](mesh, np.sort(chosen))
