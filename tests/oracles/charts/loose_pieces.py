"""Loose pieces: quads, triangles, leaves, cards, voxels, boards whose squares meet in corners alone."""

from __future__ import annotations

import numpy as np

from ....core.base.arrays import Doubles, Longs
from .polygon_mesh import PolygonMesh, copies, net_faces, of_faces, rotations, unwelded, welded

_SQUARE = np.array([(-0.5, -0.5, 0.0), (0.5, -0.5, 0.0), (0.5, 0.5, 0.0), (-0.5, 0.5, 0.0)])
_VOXEL_FACES: dict[tuple[int, int, int], list[tuple[int, int, int]]] = {
    (-1, 0, 0): [(0, 0, 0), (0, 0, 1), (0, 1, 1), (0, 1, 0)],
    (1, 0, 0): [(1, 0, 0), (1, 1, 0), (1, 1, 1), (1, 0, 1)],
    (0, -1, 0): [(0, 0, 0), (1, 0, 0), (1, 0, 1), (0, 0, 1)],
    (0, 1, 0): [(0, 1, 0), (0, 1, 1), (1, 1, 1), (1, 1, 0)],
    (0, 0, -1): [(0, 0, 0), (0, 1, 0), (1, 1, 0), (1, 0, 0)],
    (0, 0, 1): [(0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)],
}


def loose_quads(count: int, seed: int, sizes: float = 1.0) -> PolygonMesh:
    """Squares in a cloud, the largest `sizes` times as large as the smallest."""
    rng = np.random.default_rng(seed)
    return copies(_scattered(rng, np.broadcast_to(_SQUARE, (count, 4, 3)), sizes), np.arange(4, dtype=np.int64))


def loose_triangles(count: int, seed: int, sizes: float = 4.0) -> PolygonMesh:
    """Triangles of any shape."""
    rng = np.random.default_rng(seed)
    corners = np.concatenate([rng.normal(size=(count, 3, 2)), np.zeros((count, 3, 1))], axis=2)
    return copies(_scattered(rng, 0.5 * corners, sizes), np.arange(3, dtype=np.int64))


def leaves(count: int, seed: int, rows: int = 5, columns: int = 3, sizes: float = 3.0) -> PolygonMesh:
    """Pointed sheets, folded along their middle and drooping, each a piece of its own."""
    rng = np.random.default_rng(seed)
    along, across = np.linspace(0.0, 1.0, rows), np.linspace(-1.0, 1.0, columns)[:, None]
    width = 0.25 * across * (0.05 + np.sin(np.pi * along**0.8) ** 0.9)
    droop = rng.uniform(0.0, 0.6, (count, 1, 1))
    height = 0.3 * np.abs(width) - droop * along**2
    points = np.stack(np.broadcast_arrays(along + 0.0 * height, width + 0.0 * height, height), axis=-1)
    return copies(_scattered(rng, points.reshape(count, -1, 3), sizes), net_faces(columns, rows))


def hair_cards(count: int, seed: int, rows: int = 8) -> PolygonMesh:
    """Long strips of quads on a ball, that bend and lie over one another."""
    rng = np.random.default_rng(seed)
    along, across = np.linspace(0.0, 1.0, rows), np.array([-0.5, 0.5])[:, None]
    bend, width, length = (rng.uniform(low, high, (count, 1, 1)) for low, high in ((0.2, 2.0), (0.02, 0.06), (0.5, 1)))
    taper = width * (1.0 - 0.8 * along)
    forward, down = length * np.sin(bend * along) / bend, length * (1.0 - np.cos(bend * along)) / bend
    points = np.stack(np.broadcast_arrays(forward, across * taper, -down), axis=-1).reshape(count, -1, 3)
    turned = np.einsum("pkj,pij->pki", points + np.array([1.0, 0.0, 0.0]), rotations(rng, count))
    return copies(turned, net_faces(2, rows))


def voxels(side: int, seed: int, share: float = 0.4, shared: bool = False) -> PolygonMesh:
    """The faces between filled and empty cells of a random block of side³. shared: their vertices are, and so edges
    and corners of more than two faces."""
    filled = np.zeros((side + 2,) * 3, bool)
    filled[1:-1, 1:-1, 1:-1] = np.random.default_rng(seed).random((side,) * 3) < share
    filled[1, 1, 1] = True
    quads = []
    for step, corners in _VOXEL_FACES.items():
        cells = np.argwhere(filled & ~np.roll(filled, tuple(-each for each in step), axis=(0, 1, 2)))
        quads.append(cells[:, None] + np.array(corners))
    mesh = copies(np.concatenate(quads), np.arange(4, dtype=np.int64))
    return welded(mesh) if shared else mesh


def soup(mesh: PolygonMesh) -> PolygonMesh:
    """The triangles of a mesh, none of which share a vertex."""
    return unwelded(mesh)


def checkerboard(cells: int) -> PolygonMesh:
    """The black squares of a board: flat, and joined in corners alone."""
    faces = net_faces(cells + 1, cells + 1)
    row, column = np.divmod(np.arange(len(faces), dtype=np.int64), cells)
    return of_faces(_board(cells), faces[(row + column) % 2 == 0])


def islands_on_one_point(count: int, seed: int, spread: float = 0.0) -> PolygonMesh:
    """Squares all in one place, or turned about its middle with spread > 0."""
    rng = np.random.default_rng(seed)
    square = np.broadcast_to(_SQUARE, (count, 4, 3))
    turned = np.einsum("pkj,pij->pki", square, rotations(rng, count)) if spread > 0.0 else square
    return copies(turned, np.arange(4, dtype=np.int64))


def fan_of_pieces(count: int, seed: int) -> PolygonMesh:
    """Triangles in all directions from one vertex, their one shared one."""
    ends = np.random.default_rng(seed).normal(size=(2 * count, 3))
    number = 1 + 2 * np.arange(count, dtype=np.int64)
    return of_faces(np.concatenate([[(0.0, 0.0, 0.0)], ends]), np.stack([0 * number, number, number + 1], axis=1))


def _board(cells: int) -> Doubles:
    x, y = np.meshgrid(np.arange(cells + 1.0), np.arange(cells + 1.0))
    points: Doubles = np.stack([x, y, 0.0 * x], axis=-1).reshape(-1, 3)
    return points


def _scattered(rng: np.random.Generator, pieces: Doubles, sizes: float) -> Doubles:
    """(P, k, 3): the pieces turned at random, their sizes apart by up to that factor, in a cube that holds them."""
    count = len(pieces)
    scale = np.exp(rng.uniform(0.0, np.log(sizes), count)) if sizes > 1.0 else np.ones(count)
    turned = np.einsum("pkj,pij->pki", pieces * scale[:, None, None], rotations(rng, count))
    place = rng.uniform(-1.0, 1.0, (count, 1, 3)) * 1.5 * sizes * np.cbrt(count)
    scattered: Doubles = turned + place
    return scattered


def chosen_faces(mesh: PolygonMesh, share: float, seed: int) -> Longs:
    """The triangles of a random share of the polygons, at least one."""
    count = int(mesh.polygons.max()) + 1
    kept = np.random.default_rng(seed).random(count) < share
    kept[0] = True
    return np.flatnonzero(kept[mesh.polygons])
