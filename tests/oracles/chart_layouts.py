"""Meshes to be charted, and what must be true of a layout."""

from __future__ import annotations

from typing import Any

import numpy as np
from occlusion_bake.core.charts.unwrap import Charts

Mesh = tuple[Any, Any, Any]


def quads(vertices: Any, corners: Any) -> Mesh:
    """Vertices, triangles and the polygon of each triangle, from quads (Q, 4)."""
    corners = np.asarray(corners)
    triangles = corners[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3).astype(np.int32)
    polygons = np.repeat(np.arange(len(corners)), 2).astype(np.int32)
    return np.asarray(vertices, np.float32), triangles, polygons


def cube() -> Mesh:
    corners = [[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    return quads(corners, [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])


def waves(cells: int = 24, noise: float = 0.0) -> Mesh:
    """A curved sheet of quads none of which is flat; noise makes it rough."""
    x, y = np.meshgrid(np.linspace(-3, 3, cells + 1), np.linspace(-3, 3, cells + 1), indexing="ij")
    z = np.sin(2 * x) * np.cos(2 * y) + noise * np.random.default_rng(5).standard_normal(x.shape)
    first = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    corners = np.stack([first, first + cells + 1, first + cells + 2, first + 1], axis=1)
    return quads(np.stack([x, y, z], axis=-1).reshape(-1, 3), corners)


def sphere(columns: int = 24, rows: int = 12) -> Mesh:
    """A UV sphere of quads; those at the poles have two corners in one place, so half of each has no area."""
    theta, phi = np.meshgrid(np.linspace(0, np.pi, rows + 1), 2 * np.pi * np.arange(columns) / columns, indexing="ij")
    points = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)
    points[0], points[-1] = (0, 0, 1), (0, 0, -1)
    row, column = (grid.ravel() for grid in np.indices((rows, columns)))
    right = (column + 1) % columns
    corners = [row * columns + column, (row + 1) * columns + column, (row + 1) * columns + right, row * columns + right]
    return quads(points.reshape(-1, 3), np.stack(corners, axis=1))


def prism(sides: int = 9) -> Mesh:
    """A closed prism: two n-gons as triangle fans, and quads around."""
    angle = 2 * np.pi * np.arange(sides) / sides
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    vertices = np.concatenate([np.c_[ring, np.zeros(sides)], np.c_[ring, np.ones(sides)]]).astype(np.float32)
    fan = np.stack([np.zeros(sides - 2), np.arange(1, sides - 1), np.arange(2, sides)], axis=1).astype(np.int32)
    here, after = np.arange(sides), (np.arange(sides) + 1) % sides
    _, around, polygons = quads(vertices, np.stack([here, after, after + sides, here + sides], axis=1))
    triangles = np.concatenate([fan[:, ::-1], fan + sides, around])
    return vertices, triangles, np.concatenate([np.repeat([0, 1], sides - 2), polygons + 2]).astype(np.int32)


def uv_area(uv: Any) -> Any:
    p, q = (uv[:, 1] - uv[:, 0]).astype(np.float64), (uv[:, 2] - uv[:, 0]).astype(np.float64)
    return 0.5 * (p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0])


def surface_area(mesh: Mesh) -> Any:
    a, b, c = (mesh[0].astype(np.float64)[mesh[1][:, corner]] for corner in range(3))
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)


def chart_of(uv: Any) -> Any:
    """(T,) the chart of each triangle, by the edges whose both ends have the same UVs."""
    corner = np.unique(uv.reshape(-1, 2), axis=0, return_inverse=True)[1].reshape(-1, 3)
    edges = np.sort(np.stack([corner, corner[:, [1, 2, 0]]], axis=2), axis=2).reshape(-1, 2)
    edge = np.unique(edges, axis=0, return_inverse=True)[1].reshape(-1, 3)
    label = np.arange(len(uv))
    while True:
        least = np.full(edge.max() + 1, len(uv))
        np.minimum.at(least, edge.ravel(), np.repeat(label, 3))
        lower = least[edge].min(axis=1)
        if (lower == label).all():
            return np.unique(label, return_inverse=True)[1].ravel()
        label = lower


def cover(uv: Any, label: Any, width: int, height: int) -> tuple[Any, Any]:
    """Rasterise at texel centres: how many triangles hold each centre in their inside, and the label of one of them."""
    hits, owner = np.zeros((height, width), int), np.full((height, width), -1)
    for points, name in zip(uv.astype(np.float64) * (width, height), label, strict=True):
        (x0, y0), (x1, y1) = np.floor(points.min(axis=0)).astype(int), np.ceil(points.max(axis=0)).astype(int)
        x, y = np.meshgrid(np.arange(x0, x1) + 0.5, np.arange(y0, y1) + 0.5)
        sides = []
        for a, b in zip(points, points[[1, 2, 0]], strict=True):
            length = max(float(np.hypot(*(b - a))), 1e-12)
            sides.append(((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])) / length)
        inside = np.minimum.reduce(sides) > 1e-3  # texels; a shared edge is in neither triangle
        hits[y0:y1, x0:x1] += inside
        owner[y0:y1, x0:x1][inside] = name
    return hits, owner


def nearest_strangers(owner: Any, reach: int) -> int:
    """The least Chebyshev distance, up to reach + 1, between texels of different charts."""
    for distance in range(1, reach + 1):
        for dy in range(-distance, distance + 1):
            for dx in range(distance + 1):
                height, width = owner.shape
                here = owner[max(0, -dy) : height - max(0, dy), : width - dx]
                there = owner[max(0, dy) : height - max(0, -dy), dx:]
                if ((here >= 0) & (there >= 0) & (here != there)).any():
                    return distance
    return reach + 1


def check(mesh: Mesh, result: Charts) -> None:
    """What holds for every layout."""
    _, triangles, polygons = mesh
    uv = result.uv
    assert uv.shape == (len(triangles), 3, 2)
    assert uv.dtype == np.float32
    assert uv.min() >= 0.0
    assert uv.max() <= 1.0
    assert np.isfinite(uv).all()
    lost = (surface_area(mesh) > 0.0) & (uv_area(uv) <= 0.0)
    assert not lost.any()
    corner = np.stack([np.broadcast_to(polygons[:, None], triangles.shape), triangles], axis=2).reshape(-1, 2)
    both = np.unique(np.concatenate([corner, uv.reshape(-1, 2)], axis=1), axis=0)
    assert len(both) == len(np.unique(corner, axis=0)), "a polygon's triangles disagree on a corner"


MESHES = {
    "cube": cube(),
    "sphere": sphere(),
    "prism": prism(),
    "waves": waves(),
    "rough": waves(noise=0.2),
}
