"""UV charts for a mesh that has none."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.arrays import Doubles, Flags, Floats, Ints, Longs
from ..base.errors import InputError
from ..base.triangles import area_of, uv_area_of
from .chart_mesh import connected, places
from .long_charts import shortened
from .packing import packed
from .segment import laid_out
from .stages import Stages, Tell
from .stretch import Stretch, stretch_of
from .thin_charts import thickened

SIDE = 1000.0  # the square root of the surface that is charted, so that lengths are near texels


@dataclass(frozen=True, eq=False)
class Charts:
    """A chart layout in the unit square, which is the whole image.

    uv: (T, 3, 2) float32 per corner in [0, 1], v up, no triangle mirrored. count: number of charts.
    utilisation: share of the square that is used. padding: texels kept free between charts, fewer than asked where the
    charts are too many for the size.
    """

    uv: Floats
    count: int
    stretch: Stretch
    utilisation: float
    padding: int


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
    UVs at any scale, bit for bit where the scale is a power of two. Raises InputError, naming `name`, for a mesh with
    no finite surface.
    """
    points, faces, polygon = _normalised(name, vertices, triangles, polygons)
    place = places(points)[faces]
    sound = _sound(name, place)
    sides = size if isinstance(size, tuple) else (size, size)
    marked = None if seams is None else seams[sound]
    with Stages(progress) as stages:
        corners, count, kept = _made(points, faces[sound], _numbered(polygon[sound]), marked, sides, padding, stages)
    uv = _everywhere(corners, sound, polygon, place)
    placed = uv.astype(np.float32)
    return _told(points[faces], placed, sides, count, kept)


def _made(
    points: Doubles,
    faces: Longs,
    polygon: Longs,
    seams: Flags | None,
    sides: tuple[int, int],
    padding: int,
    stages: Stages,
) -> tuple[Doubles, int, int]:
    """(T, 3, 2) UVs of sound triangles, the number of charts, the padding kept."""
    stages.enter("reading the mesh", 0.0, 0.05)
    mesh = connected(points, faces, polygon, seams)
    layout = laid_out(mesh, stages)
    control = stages.enter("cutting long charts", 0.8, 0.82)
    layout = thickened(shortened(mesh, layout, sides, padding, control))
    control = stages.enter("packing charts", 0.82, 1.0)
    corners, kept = packed(layout.uv, layout.cuts.label, sides, padding, control=control)
    return corners, layout.cuts.count, kept


def _told(surface: Doubles, uv: Floats, sides: tuple[int, int], count: int, padding: int) -> Charts:
    final = uv.astype(np.float64)
    area = uv_area_of(final)
    used = float(area[area > 0.0].sum())
    stretch = stretch_of(surface, final * (np.array(sides) / max(sides)))  # as texels are square
    return Charts(uv, count, stretch, used, padding)


def _normalised(name: str, vertices: Floats, triangles: Ints, polygons: Ints | None) -> tuple[Doubles, Longs, Longs]:
    """The mesh at a fixed size about its middle, loose vertices aside, so that its place and scale do not matter."""
    used = np.zeros(len(vertices), np.bool_)
    used[triangles] = True
    number = np.cumsum(used, dtype=np.int64) - 1
    points, faces = vertices[used].astype(np.float64), number[triangles]
    if not np.isfinite(points).all():
        raise InputError(
            f"{name}: some vertices are not finite numbers; delete them or undo the modifier that made them"
        )
    total = float(area_of(points[faces]).sum())
    if not total > 0.0:
        raise InputError(f"{name}: no face has an area, so there is nothing to unwrap; scale or edit the mesh")
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    polygon = np.arange(len(faces), dtype=np.int64) if polygons is None else _numbered(polygons)
    return (points - middle) * (SIDE / np.sqrt(total)), faces, polygon


def _numbered(polygons: Ints | Longs) -> Longs:
    """(T,) numbers of polygons without gaps."""
    return np.unique(polygons, return_inverse=True)[1].ravel().astype(np.int64)


def _sound(name: str, place: Longs) -> Longs:
    """The triangles whose corners (T, 3) are at three places."""
    sound = np.flatnonzero((place != place[:, [1, 2, 0]]).all(axis=1))
    if not len(sound):  # though one has an area: only the middle of the mesh takes it
        raise InputError(
            f"{name}: its vertices lie so far apart that no face can be told from a point; delete those far away"
        )
    return sound


def _everywhere(uv: Doubles, sound: Longs, polygon: Longs, place: Longs) -> Doubles:
    """(T, 3, 2) UVs of all triangles, from those of the sound ones.

    The others cover nothing: their corners lie where their polygon has the same place, else on any of its corners.
    """
    key = polygon[:, None] * (int(place.max()) + 1) + place
    known, first = np.unique(key[sound], return_index=True)
    flat = uv.reshape(-1, 2)
    at = np.minimum(np.searchsorted(known, key), len(known) - 1)
    order = np.argsort(polygon[sound], kind="stable")
    anchor = np.minimum(np.searchsorted(polygon[sound][order], polygon), len(sound) - 1)
    anchored = uv[order[anchor], 0]
    everywhere = np.where((known[at] == key)[..., None], flat[first[at]], anchored[:, None])
    everywhere[sound] = uv
    return everywhere
