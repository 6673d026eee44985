"""UV charts for a mesh that has none, by xatlas (https://github.com/jpcy/xatlas).

xatlas sees triangles only, while the UVs of a polygon mesh live on polygon corners. So its charts are a draft, which
`mending` makes whole. Its packer outgrows the image, mirrors charts and rounds each to whole texels, so the charts are
laid out by `packing`.
"""

from __future__ import annotations

import importlib
import importlib.util
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..base.arrays import Doubles, Flags, Floats, Ints, Longs
from ..base.errors import InputError, NoUnwrapper
from ..base.triangles import area_of, square, tangents, uv_area_of
from .packing import packed
from .polygon_charts import ChartMesh, Nodes, mended, parts, unfold
from .stages import Stages, Tell
from .stretch import Stretch, stretch_of

# The square root of the surface xatlas is given. Its epsilons are absolute (1e-4 lengths, 1e-7 areas), so the charts of
# one mesh change with its size up to some 100 units and stay much the same beyond.
SIDE = 1000.0
# Growing a chart of n triangles costs xatlas n² steps: up to FREE triangles that does not matter, above them a chart
# may hold PER_CHART triangles of mean area.
FREE, PER_CHART = 10_000, 700


@dataclass(frozen=True, eq=False)
class Charts:
    """A chart layout in the unit square, which is the whole image.

    uv: (T, 3, 2) float32 per corner in [0, 1], v up, no triangle mirrored. count: number of charts.
    utilisation: share of the square that is used. padding: texels kept free between charts, fewer than asked where the
    charts are too many for the size. collapsed: triangles that have an area on the surface and none in the layout.
    """

    uv: Floats
    count: int
    stretch: Stretch
    utilisation: float
    padding: int
    collapsed: int


def unwrap(
    name: str,
    vertices: Floats,
    triangles: Ints,
    polygons: Ints | None = None,
    size: int | tuple[int, int] = 1024,
    padding: int = 4,
    *,
    seams: Flags | None = None,
    progress: Tell | None = None,
) -> Charts:
    """Cut a mesh into charts and lay them out on an image of `size` texels: (width, height), or one number for both.

    vertices: (V, 3) float32. triangles: (T, 3) int32, counter-clockwise. polygons: (T,) int32, the polygon each
    triangle belongs to, or None where every triangle is one; a polygon stays in one chart, and its triangles agree on
    the UVs of shared corners. padding: texels kept free between charts. seams: (T, 3) bool, edge i from corner i to
    i + 1 is a marked seam or sharp edge of the mesh: a border where it closes a chart. progress: is told how far the
    work is, now and then and from any thread; what it raises, as Cancelled, ends the work. The same mesh gives the same
    UVs at any scale, bit for bit where the scale is a power of two. Raises InputError, naming `name`, without xatlas
    and for a mesh with no finite surface.
    """
    xatlas = _xatlas(name)
    surface = _surface(name, vertices, triangles, polygons)
    sides = size if isinstance(size, tuple) else (size, size)
    with Stages(progress) as stages:
        stages.enter("cutting charts", 0.0, 0.7)
        chart, nodes = mended(surface, *_drafted(xatlas, surface))
        stages.enter("packing charts", 0.7, 1.0)
        corners, count, kept = _laid_out(surface, chart, nodes, sides, padding)
    placed = corners.astype(np.float32)
    final = placed.astype(np.float64)
    area = uv_area_of(final)
    flat = (area_of(vertices.astype(np.float64)[surface.triangles]) > 0.0) & (area <= 0.0)
    used = float(area[area > 0.0].sum())
    stretch = stretch_of(surface.points[surface.triangles], final * (np.array(sides) / max(sides)))  # square texels
    return Charts(placed, count, stretch, used, kept, int(np.count_nonzero(flat)))


def _xatlas(name: str) -> Any:
    try:
        return importlib.import_module("xatlas")
    except ImportError:
        raise NoUnwrapper(name) from None


def has_unwrapper() -> bool:
    """Whether there is an xatlas."""
    return importlib.util.find_spec("xatlas") is not None


def _surface(name: str, vertices: Floats, triangles: Ints, polygons: Ints | None) -> ChartMesh:
    """The mesh at a fixed size about its middle, loose vertices aside, so that its place and scale do not matter."""
    faces = triangles.astype(np.int64)
    corners = vertices.astype(np.float64)[faces]
    if not np.isfinite(corners).all():
        raise InputError(
            f"{name}: some vertices are not finite numbers; delete them or undo the modifier that made them"
        )
    total = float(area_of(corners).sum())
    if not total > 0.0:
        raise InputError(f"{name}: no face has an area, so there is nothing to unwrap; scale or edit the mesh")
    middle = 0.5 * (corners.min(axis=(0, 1)) + corners.max(axis=(0, 1)))
    points = (vertices.astype(np.float64) - middle) * (SIDE / np.sqrt(total))
    polygon = np.arange(len(faces)) if polygons is None else np.unique(polygons, return_inverse=True)[1].ravel()
    return ChartMesh(points, faces, polygon.astype(np.int64), area_of(points[faces]))


def _drafted(xatlas: Any, surface: ChartMesh) -> tuple[Longs, Doubles]:
    """xatlas' own charts: (T,) chart or -1, (T, 3, 2) UVs in units of the surface."""
    solid = np.flatnonzero(surface.solid)
    used, local = np.unique(surface.triangles[solid], return_inverse=True)
    atlas = xatlas.Atlas()
    atlas.add_mesh(surface.points[used].astype(np.float32), local.reshape(-1, 3).astype(np.uint32))
    options = xatlas.ChartOptions()
    options.fix_winding = True
    if len(solid) > FREE:
        options.max_chart_area = SIDE * SIDE * PER_CHART / len(solid)
    packing = xatlas.PackOptions()
    packing.resolution = 256  # small is quick; this layout is thrown away
    packing.rotate_charts = False  # xatlas rotates by swapping u and v, which mirrors
    packing.bilinear = False
    atlas.generate(options, packing, False)
    _, indices, uv = atlas[0]
    chart, corners = np.full(len(surface.triangles), -1, np.int64), np.zeros((len(surface.triangles), 3, 2))
    chart[solid] = atlas.get_mesh_vertex_assignment(0)[1].view(np.int32)[indices[:, 0]]
    corners[solid] = uv.astype(np.float64)[indices] * (atlas.width, atlas.height)
    return chart, _rescaled(surface, chart, corners)


def _rescaled(surface: ChartMesh, chart: Longs, uv: Doubles) -> Doubles:
    """Undo the rounding of every chart's box to whole texels: the scales in u and v of least L2 stretch, area kept."""
    good = (chart >= 0) & (uv_area_of(uv) > 0.0)
    along_u, along_v = tangents(surface.points[surface.triangles[good]], uv[good])
    count, which, area = int(chart.max(initial=-1)) + 1, chart[good], surface.area[good]
    with np.errstate(divide="ignore", invalid="ignore"):  # a chart with no good triangle
        ratio = np.sqrt(_sums(which, area * square(along_u), count) / _sums(which, area * square(along_v), count))
        growth = _sums(which, area, count) / _sums(which, uv_area_of(uv[good]), count)
        scale = np.nan_to_num(np.sqrt(np.stack([growth * ratio, growth / ratio], axis=1)), nan=1.0)
    rescaled: Doubles = uv * scale[chart][:, None, :]  # UVs outside all charts are 0
    return rescaled


def _laid_out(
    surface: ChartMesh, chart: Longs, nodes: Nodes, size: tuple[int, int], padding: int
) -> tuple[Doubles, int, int]:
    """Place the charts in the unit square: (T, 3, 2) UVs, the number of charts, the padding kept."""
    uv, known = nodes.find(chart[:, None], surface.triangles)
    part = parts(surface, chart)
    shown = np.flatnonzero(known.all(axis=1))
    names, piece = np.unique(part[shown], return_inverse=True)
    layout, kept = packed(uv[shown], piece.ravel(), surface.triangles[shown], size, padding)
    placed = Nodes(len(surface.points))
    placed.add(np.repeat(part[shown], 3), surface.triangles[shown].ravel(), layout.reshape(-1, 2))
    unfold(surface, part, placed, part >= 0)
    return _corners(surface, part, placed), len(names), kept


def _corners(surface: ChartMesh, chart: Longs, nodes: Nodes) -> Doubles:
    """(T, 3, 2) UVs of the corners. One that lies nowhere falls on one that does, so that it covers nothing."""
    uv, known = nodes.find(chart[:, None], surface.triangles)
    anchor = np.take_along_axis(uv, np.argmax(known, axis=1)[:, None, None], axis=1)
    return np.where(known[..., None], uv, anchor)


def _sums(group: Longs, values: Doubles, count: int) -> Doubles:
    sums: Doubles = np.bincount(group, values, minlength=count).astype(np.float64)
    return sums
