"""Things with edges: bevelled boxes, stairs, plates with holes, gears, prisms of n-gons."""

from __future__ import annotations

import numpy as np

from ....core.base.arrays import Doubles
from .polygon_mesh import PolygonMesh, copies, joined, net, of_faces, turned_over, welded


def bevelled_box(
    segments: int = 2, radius: float = 0.15, size: tuple[float, float, float] = (2, 1.5, 1)
) -> PolygonMesh:
    """A closed box with rounded edges and corners, of so many segments; none for a plain box."""
    half = 0.5 * np.asarray(size, np.float64)
    sides = []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            across, up = np.meshgrid(_bevel_lines(half[u], radius, segments), _bevel_lines(half[v], radius, segments))
            points = np.empty((*across.shape, 3))
            points[..., axis], points[..., u], points[..., v] = sign * half[axis], across, up
            side = net(_rounded(points, half, radius) if segments else points)
            sides.append(side if sign > 0.0 else turned_over(side))
    return welded(joined(sides))


def cube() -> PolygonMesh:
    """Of side 2 about the origin."""
    return bevelled_box(0, size=(2, 2, 2))


def stairs(steps: int, width: float = 3.0) -> PolygonMesh:
    """Treads, risers and, in columns that meet without sharing all their corners, the two cheeks."""
    quads = []
    for step in range(steps):
        x0, x1, low, high = float(step), step + 1.0, float(step), step + 1.0
        quads.append([(x0, 0, high), (x1, 0, high), (x1, width, high), (x0, width, high)])
        quads.append([(x0, 0, low), (x0, 0, high), (x0, width, high), (x0, width, low)])
        quads.append([(x0, 0, 0), (x1, 0, 0), (x1, 0, high), (x0, 0, high)])
        quads.append([(x0, width, 0), (x0, width, high), (x1, width, high), (x1, width, 0)])
    return welded(copies(quads, np.arange(4, dtype=np.int64)))


def plate(holes: int, sides: int = 16, thickness: float = 0.2) -> PolygonMesh:
    """A slab of holes x holes square cells, a round hole through each. sides: of a hole, a multiple of 4."""
    square, circle = _square_and_circle(sides)
    parts = []
    for cell in np.ndindex(holes, holes):
        outer, inner = square + np.array(cell, np.float64), circle + np.array(cell, np.float64)
        top = net(_lifted([outer, inner], [thickness, thickness]), close_columns=True)
        bottom = turned_over(net(_lifted([outer, inner], [0.0, 0.0]), close_columns=True))
        wall = net(_lifted([inner, inner], [thickness, 0.0]), close_columns=True)
        parts += [top, bottom, wall]
    edge = np.arange(sides // 4, dtype=np.int64)
    for number in range(holes):  # the rim, a side of a cell at a time
        for side, at in enumerate([(number, 0), (holes - 1, number), (number, holes - 1), (0, number)]):
            run = (square + np.array(at, np.float64))[(side * sides // 4 + np.append(edge, edge[-1] + 1)) % sides]
            parts.append(net(_lifted([run, run], [0.0, thickness])))
    return welded(joined(parts))


def gear(teeth: int, thickness: float = 0.4, bore: float = 0.35) -> PolygonMesh:
    """A toothed wheel with a bore, all of quads."""
    turn = 2.0 * np.pi * np.arange(4 * teeth, dtype=np.int64) / (4 * teeth)
    reach = np.where(np.arange(4 * teeth, dtype=np.int64) % 4 < 2, 1.0, 1.0 - 2.0 / teeth)
    circle = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    outer, inner = reach[:, None] * circle, bore * circle
    rows = [outer, outer, inner, inner]
    return net(_lifted(rows, [0.0, thickness, thickness, 0.0]), close_rows=True, close_columns=True)


def prism(sides: int, height: float = 1.0) -> PolygonMesh:
    """A closed prism: two n-gons, and quads around."""
    turn = 2.0 * np.pi * np.arange(sides, dtype=np.int64) / sides
    outline = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    here, after = np.arange(sides, dtype=np.int64), (np.arange(sides, dtype=np.int64) + 1) % sides
    around = np.stack([here, after, after + sides, here + sides], axis=1)
    return of_faces(_lifted([outline, outline], [0.0, height]), np.stack([here[::-1], here + sides]), around)


def part(detail: int = 16) -> PolygonMesh:
    """Pieces of a machine in one mesh: a plate, a gear, a box, a prism, some of them through one another."""
    pieces = [
        plate(3, 4 * max(1, detail // 4)),
        gear(detail),
        bevelled_box(max(1, detail // 8)),
        prism(max(3, detail), 3.0),
    ]
    return joined([piece._replace(vertices=piece.vertices + np.float32(0.9 * n)) for n, piece in enumerate(pieces)])


def _bevel_lines(half: float, radius: float, segments: int) -> Doubles:
    """Where the lines across a side lie: crowded at the bevels, so that these turn by equal angles."""
    if segments == 0:
        return np.array([-half, half])
    inset = radius * (1.0 - np.tan(0.25 * np.pi * np.arange(segments + 1, dtype=np.int64) / segments)[::-1])
    lines: Doubles = np.concatenate([-half + inset, half - inset[::-1]])
    return lines


def _rounded(points: Doubles, half: Doubles, radius: float) -> Doubles:
    """Points on a box, those near an edge drawn in onto a ball of that radius that rolls within."""
    core = np.clip(points, radius - half, half - radius)
    away = points - core
    rounded: Doubles = core + radius * away / np.linalg.norm(away, axis=-1, keepdims=True)
    return rounded


def _square_and_circle(sides: int) -> tuple[Doubles, Doubles]:
    """(sides, 2) each: points around a unit square from its lower left corner, and around a hole in its middle."""
    quarter = sides // 4
    run = np.arange(quarter, dtype=np.int64) / quarter
    corner, way = np.array([(0, 0), (1, 0), (1, 1), (0, 1)]), np.array([(1, 0), (0, 1), (-1, 0), (0, -1)])
    square = (corner[:, None] + run[:, None] * way[:, None]).reshape(-1, 2)
    turn = 1.25 * np.pi + 2.0 * np.pi * np.arange(sides, dtype=np.int64) / sides
    return square, 0.5 + 0.3 * np.stack([np.cos(turn), np.sin(turn)], axis=1)


def _lifted(rows: list[Doubles], heights: list[float]) -> Doubles:
    """(rows, n, 3): plane outlines, each at a height."""
    lifted: Doubles = np.stack(
        [np.column_stack([row, np.full(len(row), h)]) for row, h in zip(rows, heights, strict=True)]
    )
    return lifted
