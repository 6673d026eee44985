"""What is measured of a layout, whoever made it, and what must hold of one of ours."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ....core.base.arrays import Doubles, Floats, Longs, Reals
from ....core.charts.unwrap import Charts
from .overlaps import least_height, overlaps
from .polygon_mesh import PolygonMesh
from .texel_gaps import kept_padding

TOLERANCE = 5e-3  # texels: float32 UVs are finer than 1e-3 up to images of 8192
DENSITY = 0.05  # how far charts may be from one another in texels a square metre
ROUNDING = 2.0**-22  # of the image: as much may float32 turn a thin triangle over
MEASURED = 1.0  # texels: the density of a smaller chart is that of its rounding
NEEDLE = 0.1  # texels: what is thinner may be made thicker


@dataclass(frozen=True)
class Judgement:
    """What a layout is like. l2, p95: L2 stretch (Sander et al. 2001) in the mean and at the 95th percentile, after one
    scale for the whole layout. used: share of the image. padding: texels free between charts, -1 where two touch one.
    overlaps: pairs of triangles, deepest: by how many texels. mirrored: triangles. collapsed: those without an area for
    which float32 had room. outside: texels that the layout reaches beyond the image. uneven: how many times as dense as
    most of the surface, or as coarse, the worst chart is, less 1. torn: polygons that do not lie in one chart, or whose
    triangles disagree on a corner.
    """

    triangles: int
    charts: int
    l2: float
    p95: float
    used: float
    padding: int
    overlaps: int
    deepest: float
    mirrored: int
    collapsed: int
    outside: float
    uneven: float
    torn: int


def judged(mesh: PolygonMesh, uv: Reals, size: tuple[int, int], enough: int = 4) -> Judgement:
    """Judge UVs (T, 3, 2) on an image of `size` texels. enough: the padding that was asked for."""
    texels = uv.astype(np.float64) * size
    chart = charts_of(mesh, uv)
    shown = np.flatnonzero(np.abs(least_height(texels)) > TOLERANCE)
    found, depth = overlaps(texels, TOLERANCE)
    l2, p95 = stretch(mesh.corners, texels)
    return Judgement(
        triangles=len(uv),
        charts=len(np.unique(chart[shown])),
        l2=l2,
        p95=p95,
        used=float(np.abs(uv_areas(texels)).sum() / (size[0] * size[1])),
        padding=kept_padding(texels[shown], chart[shown], *size, enough),
        overlaps=len(found),
        deepest=float(depth.max(initial=0.0)),
        mirrored=int(np.count_nonzero(least_height(texels) < -ROUNDING * max(size))),
        collapsed=int(
            np.count_nonzero((uv_areas(texels) == 0.0) & (_wanted_height(mesh, texels) > ROUNDING * max(size)))
        ),
        outside=float(np.maximum(-texels, texels - size).max(initial=0.0)),
        uneven=unevenness(mesh, texels, chart),
        torn=torn_polygons(mesh, uv, chart),
    )


def assert_sound(
    mesh: PolygonMesh, charts: Charts, size: tuple[int, int], padding: int, most_stretch: float | None = 1.1
) -> Judgement:
    """All that holds of our own layouts, whatever the mesh. most_stretch: None for a mesh that is no surface."""
    found = assert_sound_layout(mesh, charts.uv, size, padding)
    assert 0 <= charts.padding <= padding
    assert charts.padding == 0 or found.padding >= charts.padding, found
    assert abs(found.used - charts.utilisation) <= 1e-4 and 0.0 < charts.utilisation <= 1.0, found
    if most_stretch is not None:
        assert found.l2 <= most_stretch and found.p95 <= 1.5, found
        assert abs(found.l2 - charts.stretch.l2) <= 1e-3 * found.l2, (found, charts.stretch)
        assert _is_p95(mesh.corners, charts.uv.astype(np.float64) * size, charts.stretch.p95), (found, charts.stretch)
    return found


def assert_sound_layout(mesh: PolygonMesh, uv: Floats, size: tuple[int, int], padding: int = 4) -> Judgement:
    """As `assert_sound`, of UVs of which nothing else is known."""
    assert uv.shape == (len(mesh.triangles), 3, 2) and uv.dtype == np.float32 and np.isfinite(uv).all()
    assert uv.min() >= 0.0 and uv.max() <= 1.0
    found = judged(mesh, uv, size, padding)
    assert found.overlaps == 0, found
    assert found.mirrored == 0, found
    assert found.torn == 0, found
    assert found.collapsed == 0, found
    assert found.uneven <= DENSITY, found
    return found


def _wanted_height(mesh: PolygonMesh, texels: Doubles) -> Doubles:
    """(T,): how many texels high a triangle is over its longest side, at the density of the whole layout."""
    corners, area = mesh.corners, surface_areas(mesh)
    longest = np.linalg.norm(corners - corners[:, [1, 2, 0]], axis=2).max(axis=1)
    scale = np.sqrt(np.abs(uv_areas(texels)).sum() / max(area.sum(), np.finfo(np.float64).tiny))
    height: Doubles = 2.0 * area * scale / np.maximum(longest, np.finfo(np.float64).tiny)
    return height


def charts_of(mesh: PolygonMesh, uv: Reals) -> Longs:
    """(T,) the chart of each triangle: those that share an edge, in its place in the mesh and in the layout, or a
    polygon, are in one."""
    place = _places(uv)
    vertex = np.unique(mesh.vertices + np.float32(0.0), axis=0, return_inverse=True)[1].ravel().astype(np.int64)
    corner = np.unique(vertex[mesh.triangles] * (place.max() + 1) + place, return_inverse=True)[1]
    corner = corner.reshape(-1, 3)
    ends = np.sort(np.stack([corner, corner[:, [1, 2, 0]]], axis=2), axis=2)
    edge = np.unique(ends[..., 0] * (corner.max() + 1) + ends[..., 1], return_inverse=True)[1].reshape(-1, 3)
    polygon = np.unique(mesh.polygons, return_inverse=True)[1].ravel()
    return _components(np.concatenate([edge, edge.max() + 1 + polygon[:, None]], axis=1))


def _components(links: Longs) -> Longs:
    """(T,): numbers from 0 of what is connected, by what each of T things (T, k) is tied to."""
    label = np.arange(len(links), dtype=np.int64)
    while True:
        least = np.full(int(links.max()) + 1, len(links))
        np.minimum.at(least, links.ravel(), np.repeat(label, links.shape[1]))
        lower = np.minimum(label, least[links].min(axis=1))
        np.minimum.at(lower, label, lower)  # what has joined another takes its whole group along
        lower = lower[lower]
        if np.array_equal(lower, label):
            numbers: Longs = np.unique(label, return_inverse=True)[1].ravel()
            return numbers
        label = lower


def stretch(corners: Doubles, uv: Doubles) -> tuple[float, float]:
    """L2 stretch in the mean and at the 95th percentile, both by area on the surface; infinite where nothing shows."""
    squared, area = _squared_stretch(corners, uv)
    if not len(area):
        return np.inf, np.inf
    order = np.argsort(squared)
    rank = np.searchsorted(np.cumsum(area[order]), 0.95 * area.sum())
    return float(np.sqrt(np.average(squared, weights=area))), float(np.sqrt(squared[order][min(rank, len(order) - 1)]))


def _is_p95(corners: Doubles, uv: Doubles, told: float) -> bool:
    """Whether that is the 95th percentile, to a thousandth: of few triangles the last bit of an area may decide which
    one's it is."""
    squared, area = _squared_stretch(corners, uv)
    rank = (0.95 + np.array([1e-6, -1e-6])) * area.sum()
    below, up_to = (area[squared < (told * factor) ** 2].sum() for factor in (0.999, 1.001))
    return bool(below <= rank[0] and up_to >= rank[1])


def _squared_stretch(corners: Doubles, uv: Doubles) -> tuple[Doubles, Doubles]:
    """Of the triangles that show, after one scale for all: squares of the L2 stretch, and areas on the surface.

    The mean of the squared singular values of a linear map is its Dirichlet energy over the area, which is a sum of
    cotangents (Pinkall and Polthier 1993, "Computing discrete minimal surfaces and their conjugates").
    """
    area, flat = _surface_areas(corners), np.abs(uv_areas(uv))
    good = (area > 0.0) & (flat > 0.0)
    area, flat, corners, uv = area[good], flat[good], corners[good], uv[good]
    energy = np.zeros(len(area))
    for corner in range(3):
        one, other = uv[:, corner - 2] - uv[:, corner], uv[:, corner - 1] - uv[:, corner]
        opposite = corners[:, corner - 2] - corners[:, corner - 1]
        energy += (one * other).sum(axis=1) / (2.0 * flat) * (opposite**2).sum(axis=1)
    scale = flat.sum() / area.sum() if len(area) else 1.0
    return energy / (4.0 * flat) * scale, area


def unevenness(mesh: PolygonMesh, texels: Doubles, chart: Longs) -> float:
    """How far the densest or the coarsest chart is from the density of half the surface, as a share: 0 is even.

    Charts that are to have less than MEASURED texels are not looked at, nor are those less broad than NEEDLE texels.
    """
    edges = np.linalg.norm(mesh.corners - mesh.corners[:, [1, 2, 0]], axis=2).max(axis=1)
    length = np.zeros(int(chart.max(initial=-1)) + 1)
    np.maximum.at(length, chart, edges)
    flat, area = np.bincount(chart, np.abs(uv_areas(texels))), np.bincount(chart, surface_areas(mesh))
    known = (flat > 0.0) & (area > 0.0)
    if not known.any():
        return 0.0
    flat, area, length = flat[known], area[known], length[known]
    density = flat / area
    order = np.argsort(density)
    middle = density[order][np.searchsorted(np.cumsum(area[order]), 0.5 * area.sum())]
    large = (area * middle >= MEASURED) & (area * np.sqrt(middle) >= NEEDLE * length)
    ratio = density[large] / middle
    return float(np.maximum(ratio, 1.0 / ratio).max(initial=1.0) - 1.0)


def torn_polygons(mesh: PolygonMesh, uv: Reals, chart: Longs) -> int:
    """Polygons in several charts, or whose triangles do not agree where a corner is."""
    polygon = np.unique(mesh.polygons, return_inverse=True)[1].ravel()
    place = _places(uv)
    own, first = np.unique(polygon, return_index=True)
    torn = np.zeros(len(own), bool)
    torn[polygon[chart != chart[first][polygon]]] = True
    corner = np.repeat(polygon, 3) * len(mesh.vertices) + mesh.triangles.ravel()
    key = np.unique(corner, return_inverse=True)[1].ravel()
    seen = np.full(key.max() + 1, -1, np.int64)
    seen[key] = place.ravel()
    torn[np.repeat(polygon, 3)[seen[key] != place.ravel()]] = True
    return int(np.count_nonzero(torn))


def _places(uv: Reals) -> Longs:
    """(T, 3): corners with the same UVs, to the bit of float32, have the same number."""
    pairs = np.ascontiguousarray(uv, np.float32) + np.float32(0.0)  # -0 is 0
    numbers: Longs = np.unique(pairs.view(np.uint64), return_inverse=True)[1].reshape(-1, 3).astype(np.int64)
    return numbers


def surface_areas(mesh: PolygonMesh) -> Doubles:
    """(T,) on the surface."""
    return _surface_areas(mesh.corners)


def _surface_areas(corners: Doubles) -> Doubles:
    areas: Doubles = 0.5 * np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    return areas


def uv_areas(uv: Reals) -> Doubles:
    """(T,) in the layout, below 0 where mirrored."""
    corners = uv.astype(np.float64)
    p, q = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    areas: Doubles = 0.5 * (p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0])
    return areas
