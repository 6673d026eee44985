"""UV charts for a mesh that has none, by xatlas (https://github.com/jpcy/xatlas).

xatlas sees triangles only, while the UVs of a polygon mesh live on polygon corners. So its charts are a draft: polygons
that a chart border cuts through are moved whole into one of their charts (`_mended`). Its packer outgrows the image,
mirrors charts and rounds each to whole texels, so the charts are packed here (`_packed`).
"""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from .errors import InputError
from .scene import Doubles, Floats, Ints

Longs = NDArray[np.int64]
Flags = NDArray[np.bool_]

# The square root of the surface xatlas is given. Its epsilons are absolute (1e-4 lengths, 1e-7 areas), so the charts of
# one mesh change with its size up to some 100 units and stay much the same beyond.
SIDE = 1000.0
# xatlas leaves out triangles of an area below FLT_EPSILON.
LEAST_AREA = 2.0**-23
# Growing a chart of n triangles costs xatlas n² steps: up to FREE triangles that does not matter, above them a chart
# may hold PER_CHART triangles of mean area.
FREE, PER_CHART = 10_000, 700
# Charts are packed on a grid no finer than this, at so many scales at most.
FINEST, TRIES = 1024, 8
# An adopted triangle may be this many times longer or shorter than on the surface, in any direction.
MOST_STRETCH = 3.0


@dataclass(frozen=True)
class Stretch:
    """Distortion of a chart layout; 1 is none. Weighted by area on the surface, after one scale for the whole layout.

    l2 and p95: root mean square and 95th percentile of the L2 stretch of Sander et al. 2001, "Texture Mapping
    Progressive Meshes". area: mean of max(a, 1/a), a a triangle's share of the surface over its share of the layout.
    angle: mean of (s + 1/s)/2, s the ratio of the singular values of the map.
    """

    l2: float
    p95: float
    area: float
    angle: float


@dataclass(frozen=True, eq=False)
class Charts:
    """A chart layout in the unit square.

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


@dataclass(frozen=True, eq=False)
class _Surface:
    """What is charted. points: (V, 3), centred, the whole surface SIDE². polygon: (T,) from 0. area: (T,)."""

    points: Doubles
    triangles: Longs
    polygon: Longs
    area: Doubles

    @property
    def solid(self) -> Flags:
        """(T,) bool: triangles that xatlas will not leave out."""
        flags: Flags = self.area > 2.0 * LEAST_AREA
        return flags


class _Nodes:
    """Where the vertices lie in each chart: one position for each pair of a chart and a vertex."""

    def __init__(self, vertex_count: int) -> None:
        self._vertex_count = vertex_count
        self._keys: Longs = np.empty(0, np.int64)
        self._uv: Doubles = np.empty((0, 2))

    def add(self, chart: Longs, vertex: Longs, uv: Doubles) -> None:
        """chart, vertex: (n,), uv: (n, 2). Several proposals for one pair are averaged; a known pair stays as it is."""
        keys, slot = np.unique(chart * self._vertex_count + vertex, return_inverse=True)
        slot = slot.ravel()
        mean = np.stack([np.bincount(slot, uv[:, axis]) for axis in range(2)], axis=1) / np.bincount(slot)[:, None]
        merged = np.concatenate([self._keys, keys])
        self._keys, first = np.unique(merged, return_index=True)
        self._uv = np.concatenate([self._uv, mean])[first]

    def find(self, chart: Longs, vertex: Longs) -> tuple[Doubles, Flags]:
        """Position and whether it is known, for chart and vertex of any one shape; (0, 0) where it is not."""
        wanted = chart * self._vertex_count + vertex
        if len(self._keys) == 0:
            return np.zeros((*wanted.shape, 2)), np.zeros(wanted.shape, np.bool_)
        at = np.minimum(np.searchsorted(self._keys, wanted), len(self._keys) - 1)
        known: Flags = (self._keys[at] == wanted) & (chart >= 0)
        return np.where(known[..., None], self._uv[at], 0.0), known


def unwrap(
    name: str, vertices: Floats, triangles: Ints, polygons: Ints | None = None, size: int = 1024, padding: int = 4
) -> Charts:
    """Cut a mesh into charts and lay them out on a square image of `size` texels a side.

    vertices: (V, 3) float32. triangles: (T, 3) int32, counter-clockwise. polygons: (T,) int32, the polygon each
    triangle belongs to, or None where every triangle is one; a polygon stays in one chart, and its triangles agree on
    the UVs of shared corners. padding: texels kept free between charts. The same mesh gives the same UVs at any scale,
    bit for bit where the scale is a power of two. Raises InputError, naming `name`, without xatlas and for a mesh with
    no finite surface.
    """
    xatlas = _xatlas(name)
    surface = _surface(name, vertices, triangles, polygons)
    chart, nodes = _mended(surface, *_drafted(xatlas, surface))
    corners, count, kept = _packed(surface, chart, nodes, size, padding)
    placed = corners.astype(np.float32)
    final = placed.astype(np.float64)
    area = _uv_area(final)
    flat = (_area(vertices.astype(np.float64)[surface.triangles]) > 0.0) & (area <= 0.0)
    used = float(area[area > 0.0].sum())
    return Charts(placed, count, _stretch(surface, final), used, kept, int(np.count_nonzero(flat)))


def _xatlas(name: str) -> Any:
    try:
        return importlib.import_module("xatlas")
    except ImportError:
        raise InputError(
            f"{name}: it has no UV map and this Blender's Python has no xatlas to make one; "
            "unwrap it by hand first (UV > Smart UV Project)"
        ) from None


def _surface(name: str, vertices: Floats, triangles: Ints, polygons: Ints | None) -> _Surface:
    """The mesh at a fixed size about its middle, loose vertices aside, so that its place and scale do not matter."""
    faces = triangles.astype(np.int64)
    corners = vertices.astype(np.float64)[faces]
    if not np.isfinite(corners).all():
        raise InputError(
            f"{name}: some vertices are not finite numbers; delete them or undo the modifier that made them"
        )
    total = float(_area(corners).sum())
    if not total > 0.0:
        raise InputError(f"{name}: no face has an area, so there is nothing to unwrap; scale or edit the mesh")
    middle = 0.5 * (corners.min(axis=(0, 1)) + corners.max(axis=(0, 1)))
    points = (vertices.astype(np.float64) - middle) * (SIDE / np.sqrt(total))
    polygon = np.arange(len(faces)) if polygons is None else np.unique(polygons, return_inverse=True)[1].ravel()
    return _Surface(points, faces, polygon.astype(np.int64), _area(points[faces]))


def _drafted(xatlas: Any, surface: _Surface) -> tuple[Longs, Doubles]:
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


def _rescaled(surface: _Surface, chart: Longs, uv: Doubles) -> Doubles:
    """Undo the rounding of every chart's box to whole texels: the scales in u and v of least L2 stretch, area kept."""
    good = (chart >= 0) & (_uv_area(uv) > 0.0)
    along_u, along_v = _tangents(surface.points[surface.triangles[good]], uv[good])
    count, which, area = int(chart.max(initial=-1)) + 1, chart[good], surface.area[good]
    with np.errstate(divide="ignore", invalid="ignore"):  # a chart with no good triangle
        ratio = np.sqrt(_sums(which, area * _square(along_u), count) / _sums(which, area * _square(along_v), count))
        growth = _sums(which, area, count) / _sums(which, _uv_area(uv[good]), count)
        scale = np.nan_to_num(np.sqrt(np.stack([growth * ratio, growth / ratio], axis=1)), nan=1.0)
    rescaled: Doubles = uv * scale[chart][:, None, :]  # UVs outside all charts are 0
    return rescaled


def _mended(surface: _Surface, draft: Longs, uv: Doubles) -> tuple[Longs, _Nodes]:
    """Give every polygon one chart: (T,) chart or -1 where a polygon has no area, and the positions in the charts.

    A polygon cut by a chart border moves into the chart that holds most of it, unfolded over the border; where it does
    not fit there (mirrored, overstretched, over another triangle) it becomes a chart of its own.
    """
    draft = np.where((_uv_area(uv) > 0.0) & ~_repeated(draft, uv), draft, -1)
    nodes = _Nodes(len(surface.points))
    charted = draft >= 0
    nodes.add(np.repeat(draft[charted], 3), surface.triangles[charted].ravel(), uv[charted].reshape(-1, 2))
    chart = _home(surface, draft)[surface.polygon]
    moved = surface.solid & (chart != draft) & (chart >= 0)
    _unfold(surface, chart, nodes, moved)
    misfit = _misfits(surface, chart, nodes, moved)
    alone = np.bincount(surface.polygon, misfit | (surface.solid & (chart < 0)))[surface.polygon] > 0.0
    alone |= (chart < 0) & (np.bincount(surface.polygon, surface.area)[surface.polygon] > 0.0)
    chart = np.where(alone, surface.polygon + int(chart.max(initial=-1)) + 1, chart)
    _set_apart(surface, chart, nodes, alone)
    return chart, nodes


def _repeated(chart: Longs, uv: Doubles) -> Flags:
    """(T,) bool: triangles that lie exactly over an earlier one of their chart, as doubled faces do."""
    corners = np.sort(uv[..., 0] + 1j * uv[..., 1], axis=1)
    order = np.lexsort((*corners.T.imag, *corners.T.real, chart))  # stable, so the earlier comes first
    row = np.concatenate([chart[:, None], corners.real, corners.imag], axis=1)[order]
    repeated = np.zeros(len(chart), np.bool_)
    repeated[order[1:]] = (row[1:] == row[:-1]).all(axis=1)
    return repeated


def _home(surface: _Surface, draft: Longs) -> Longs:
    """(P,) the chart that holds most of each polygon, by area, or -1 where none holds any of it."""
    held = np.flatnonzero(draft >= 0)
    count = int(draft.max(initial=-1)) + 1
    pair, slot = np.unique(surface.polygon[held] * count + draft[held], return_inverse=True)
    area = np.bincount(slot.ravel(), surface.area[held])
    home = np.full(int(surface.polygon.max()) + 1, -1, np.int64)
    order = np.argsort(area, kind="stable")  # the largest is written last, and stays
    home[pair[order] // count] = pair[order] % count
    return home


def _unfold(surface: _Surface, chart: Longs, nodes: _Nodes, chosen: Flags) -> None:
    """Place the unknown corners of the chosen triangles: where two are known, the third follows by similarity."""
    waiting = np.flatnonzero(chosen)
    while len(waiting):
        uv, known = nodes.find(chart[waiting, None], surface.triangles[waiting])
        ready = known.sum(axis=1) == 2
        if not ready.any():
            return
        turn = (np.argmin(known[ready], axis=1)[:, None] + [1, 2, 0]) % 3
        vertices = np.take_along_axis(surface.triangles[waiting[ready]], turn, axis=1)
        base = np.take_along_axis(uv[ready], turn[:, :2, None], axis=1)
        nodes.add(chart[waiting[ready]], vertices[:, 2], _third(surface.points[vertices], base))
        waiting = waiting[~ready]


def _third(corners: Doubles, base: Doubles) -> Doubles:
    """(n, 2): the third corner of triangles (n, 3, 3), similar to the originals over the base (n, 2, 2)."""
    edge, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    length = np.maximum(_square(edge), np.finfo(np.float64).tiny)[:, None]
    along = (edge * other).sum(axis=1)[:, None] / length
    up = 2.0 * _area(corners)[:, None] / length
    run = base[:, 1] - base[:, 0]
    third: Doubles = base[:, 0] + along * run + up * np.stack([-run[:, 1], run[:, 0]], axis=1)
    return third


def _set_apart(surface: _Surface, chart: Longs, nodes: _Nodes, alone: Flags) -> None:
    """Place the polygons that are charts of their own, each from its largest triangle.

    That triangle is at least 1 long and half as high, about a texel's worth: a smaller one would be lost in float32.
    """
    mine = np.flatnonzero(alone)
    mine = mine[np.lexsort((-surface.area[mine], surface.polygon[mine]))]
    seeds = mine[np.unique(surface.polygon[mine], return_index=True)[1]]
    corners = surface.points[surface.triangles[seeds]]
    lengths = np.sqrt(_square(corners[:, [1, 2, 0]] - corners))
    turn = (np.argmax(lengths, axis=1)[:, None] + [0, 1, 2]) % 3
    vertices = np.take_along_axis(surface.triangles[seeds], turn, axis=1)
    base = np.zeros((len(seeds), 2, 2))
    base[:, 1, 0] = np.maximum(lengths.max(axis=1, initial=0.0), 1.0)
    apex = _third(surface.points[vertices], base)
    apex[:, 1] = np.maximum(apex[:, 1], 0.5)
    placed = np.concatenate([base, apex[:, None]], axis=1)
    nodes.add(np.repeat(chart[seeds], 3), vertices.ravel(), placed.reshape(-1, 2))
    _unfold(surface, chart, nodes, alone)


def _misfits(surface: _Surface, chart: Longs, nodes: _Nodes, moved: Flags) -> Flags:
    """(T,) bool: moved triangles that do not fit into their charts."""
    uv, known = nodes.find(chart[:, None], surface.triangles)
    fits = moved & known.all(axis=1) & (_uv_area(uv) > 0.0)
    largest, least = _singular(surface.points[surface.triangles[fits]], uv[fits])
    fits[fits] = (largest < MOST_STRETCH) & (least > 1.0 / MOST_STRETCH)
    present = known.all(axis=1) & surface.solid & (fits | ~moved)
    fits &= ~_overlapping(chart, uv, fits, present)
    misfit: Flags = moved & ~fits
    return misfit


def _overlapping(chart: Longs, uv: Doubles, suspects: Flags, present: Flags) -> Flags:
    """(T,) bool: suspects whose inside meets the inside of another triangle present in the same chart."""
    low, high = uv.min(axis=1), uv.max(axis=1)
    first, second = [np.empty(0, np.int64)], [np.empty(0, np.int64)]
    members = np.flatnonzero(present & np.isin(chart, chart[suspects]))
    members = members[np.argsort(chart[members], kind="stable")]
    for group in np.split(members, np.flatnonzero(np.diff(chart[members])) + 1):
        for some in np.array_split(group[suspects[group]], 1 + len(group) // 1000):  # bounds the memory
            meet = (low[some, None] < high[group]).all(axis=2) & (high[some, None] > low[group]).all(axis=2)
            one, other = np.nonzero(meet & (some[:, None] != group))
            first.append(some[one])
            second.append(group[other])
    a, b = np.concatenate(first), np.concatenate(second)
    crossing = ~(_separated(uv[a], uv[b]) | _separated(uv[b], uv[a]))
    found: Flags = np.bincount(a[crossing], minlength=len(chart)) > 0
    return found


def _separated(a: Doubles, b: Doubles) -> Flags:
    """(n,) bool: all of b (n, 3, 2) is outside an edge of a (n, 3, 2), counter-clockwise, give or take 1e-6."""
    edge = a[:, [1, 2, 0]] - a
    offset = b[:, None, :, :] - a[:, :, None, :]
    side = edge[:, :, None, 0] * offset[..., 1] - edge[:, :, None, 1] * offset[..., 0]
    outside: Flags = (side.max(axis=2) <= 1e-6 * np.sqrt(_square(edge))).any(axis=1)
    return outside


def _packed(surface: _Surface, chart: Longs, nodes: _Nodes, size: int, padding: int) -> tuple[Doubles, int, int]:
    """Lay the charts out in the unit square: (T, 3, 2) UVs, the number of charts, the padding kept."""
    uv, known = nodes.find(chart[:, None], surface.triangles)
    part = _parts(surface, chart)
    shown = np.flatnonzero(known.all(axis=1))
    names, piece = np.unique(part[shown], return_inverse=True)
    layout, kept = _Pieces.of(uv[shown], piece.ravel(), surface.triangles[shown]).fit(size, padding)
    packed = _Nodes(len(surface.points))
    packed.add(np.repeat(part[shown], 3), surface.triangles[shown].ravel(), layout.reshape(-1, 2))
    _unfold(surface, part, packed, part >= 0)
    return _corners(surface, part, packed), len(names), kept


def _parts(surface: _Surface, chart: Longs) -> Longs:
    """(T,) the connected part of a chart each triangle lies in: moving polygons away may have left several."""
    ends = np.sort(np.stack([surface.triangles, surface.triangles[:, [1, 2, 0]]], axis=2), axis=2)
    vertex_count = len(surface.points)
    _, start = np.unique(chart[:, None] * vertex_count + ends[..., 0], return_inverse=True)
    _, edge = np.unique(start.reshape(-1, 3) * vertex_count + ends[..., 1], return_inverse=True)
    links = np.concatenate([edge.reshape(-1, 3), surface.polygon[:, None] + int(edge.max()) + 1], axis=1)
    part = np.arange(len(chart))
    while True:
        least = np.full(int(links.max()) + 1, len(chart))
        np.minimum.at(least, links.ravel(), np.repeat(part, 4))
        lower = least[links].min(axis=1)
        lower = lower[lower]
        if np.array_equal(lower, part):
            return np.where(chart >= 0, part, -1)
        part = lower


@dataclass(frozen=True, eq=False)
class _Pieces:
    """Charts to be packed, the box of each beginning at (0, 0).

    uv: (T, 3, 2). piece: (T,) the chart of each triangle. rim: (E, 2, 2) the edges at the borders of the charts.
    rim_piece: (E,) their charts. extent: (C, 2).
    """

    uv: Doubles
    piece: Longs
    rim: Doubles
    rim_piece: Longs
    extent: Doubles

    @staticmethod
    def of(uv: Doubles, piece: Longs, triangles: Longs) -> _Pieces:
        count = int(piece.max()) + 1
        low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
        np.minimum.at(low, piece, uv.min(axis=1))
        np.maximum.at(high, piece, uv.max(axis=1))
        moved = uv - low[piece][:, None, :]
        ends = np.sort(np.stack([triangles, triangles[:, [1, 2, 0]]], axis=2).reshape(-1, 2), axis=1)
        edges = np.concatenate([np.repeat(piece, 3)[:, None], ends], axis=1)
        _, first, uses = np.unique(edges, axis=0, return_index=True, return_counts=True)
        rim = np.stack([moved, moved[:, [1, 2, 0]]], axis=2).reshape(-1, 2, 2)[first[uses == 1]]
        return _Pieces(moved, piece, rim, edges[first[uses == 1], 0], high - low)

    def fit(self, size: int, padding: int) -> tuple[Doubles, int]:
        """(T, 3, 2) UVs at the largest scale found at which the charts fit, and the padding kept.

        The padding is halved where they fit at no scale; with none left, the layout is shrunk as a whole.
        """
        cell = -(-size // FINEST)  # texels
        cells = size // cell
        most = 0.999 * cells / float(self.extent.max())  # the longest chart fits
        scale, best = min(most, cells * np.sqrt(0.6 / float(_uv_area(self.uv).sum()))), None
        for _ in range(TRIES):
            places = self._places(scale, cells, -(-padding // cell))
            fits = places.height <= cells
            if fits and (best is None or scale > best.scale):
                best = places
            if fits and (places.height > 0.985 * cells or scale == most):
                break
            # The atlas has the width of the image, so its height goes with the square of the scale.
            scale = min(most, scale * float(np.clip(np.sqrt(0.993 * cells / places.height), 0.5, 1.5)))
        if best is None and padding > 0:
            return self.fit(size, padding // 2)
        best = best or places
        return best.apply(self.uv, self.piece) * (cell / (size * max(1.0, best.height / cells))), padding

    def _places(self, scale: float, cells: int, gap: int) -> _Places:
        """Drop the charts one by one, broadest first, turned by quarters, to where they come to lie lowest.

        The "Tetris" packing of Levy et al. 2002, "Least Squares Conformal Maps for Automatic Texture Atlas Generation".
        """
        outlines = [_Outlines.along(self, axis, scale) for axis in range(2)]
        horizon = np.full(cells + 2 * gap, -gap, np.int32)
        count = len(self.extent)
        turn, place, height = np.zeros(count, np.int64), np.zeros((count, 2)), 0
        # Rounded, so that equal charts keep their order at any scale of the mesh.
        broadest = np.argsort(-np.round(self.extent.min(axis=1), 1), kind="stable")
        for chart in broadest:
            drops = [_drop(horizon, *outlines[quarter % 2].turned(chart, quarter), gap) for quarter in range(4)]
            turn[chart] = quarter = int(np.argmin([drop[0] for drop in drops]))
            top, x, y = drops[quarter]
            height, place[chart] = max(height, top), (x, y)
            upper = outlines[quarter % 2].turned(chart, quarter)[1]
            under = horizon[x + gap : x + gap + len(upper)]
            np.maximum(under, y + upper, out=under)
        return _Places(scale, height, turn, place, self.extent * scale)


@dataclass(frozen=True, eq=False)
class _Places:
    """Where the charts lie. turn: (C,) quarter turns; place: (C, 2) the lower left of the turned box, in cells."""

    scale: float
    height: int
    turn: Longs
    place: Doubles
    extent: Doubles

    def apply(self, uv: Doubles, piece: Longs) -> Doubles:
        """(T, 3, 2) cells, from the UVs of the pieces."""
        turn, far = self.turn[piece][:, None], np.ceil(self.extent)[piece][:, None, :]
        u, v = uv[..., 0] * self.scale, uv[..., 1] * self.scale
        across, up = far[..., 0] - u, far[..., 1] - v
        x = np.choose(turn, [u, up, across, v])
        y = np.choose(turn, [v, u, up, across])
        turned: Doubles = np.stack([x, y], axis=-1) + self.place[piece][:, None, :]
        return turned


@dataclass(frozen=True, eq=False)
class _Outlines:
    """How low and how high each chart reaches in each cell along one axis, in whole cells, for all charts in a row.

    start: (C + 1,) the first column of each chart; far: (C,) the cells each chart's box has across.
    """

    lower: NDArray[np.int32]
    upper: NDArray[np.int32]
    start: Longs
    far: Longs

    @staticmethod
    def along(pieces: _Pieces, axis: int, scale: float) -> _Outlines:
        boxes = np.maximum(np.ceil(pieces.extent * scale), 1.0).astype(np.int64)
        start = np.concatenate([[0], np.cumsum(boxes[:, axis])])
        lower, upper = np.full(start[-1], np.iinfo(np.int32).max, np.int32), np.zeros(start[-1], np.int32)
        line, column, reach = _crossings(pieces.rim[..., [axis, 1 - axis]] * scale)
        chart = pieces.rim_piece[line]
        at = start[chart] + np.minimum(column, boxes[chart, axis] - 1)
        across = boxes[chart, 1 - axis]
        np.minimum.at(lower, at, np.clip(np.floor(reach), 0, across - 1).astype(np.int32))
        np.maximum.at(upper, at, np.clip(np.ceil(reach), 1, across).astype(np.int32))
        return _Outlines(np.minimum(lower, upper), upper, start, boxes[:, 1 - axis])

    def turned(self, chart: int, quarter: int) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """The lower and the upper outline of a chart after quarter turns; odd ones are for the outlines along v."""
        lower, upper = (ends[self.start[chart] : self.start[chart + 1]] for ends in (self.lower, self.upper))
        far = np.int32(self.far[chart])
        if quarter == 0:
            return lower, upper
        if quarter == 1:
            return lower[::-1], upper[::-1]
        if quarter == 2:
            return far - upper[::-1], far - lower[::-1]
        return far - upper, far - lower


def _crossings(lines: Doubles) -> tuple[Longs, Longs, Doubles]:
    """Where lines (E, 2, 2) begin, end and pass from one column to the next: (n,) line, column, height there."""
    order = np.argsort(lines[:, :, 0], axis=1)[:, :, None]
    (x0, y0), (x1, y1) = np.moveaxis(np.take_along_axis(lines, order, axis=1), 0, -1)
    first, count = np.floor(x0).astype(np.int64) + 1, np.maximum(np.floor(x1) - np.floor(x0), 0).astype(np.int64)
    line = np.repeat(np.arange(len(lines)), count)
    column = first[line] + np.arange(len(line)) - np.repeat(np.cumsum(count) - count, count)
    height = y0[line] + (column - x0[line]) / (x1 - x0)[line] * (y1 - y0)[line]
    ends = np.arange(len(lines))
    columns = [np.floor(x0).astype(np.int64), np.floor(x1).astype(np.int64), column - 1, column]
    return np.concatenate([ends, ends, line, line]), np.concatenate(columns), np.concatenate([y0, y1, height, height])


def _drop(
    horizon: NDArray[np.int32], lower: NDArray[np.int32], upper: NDArray[np.int32], gap: int
) -> tuple[int, int, int]:
    """Where a chart comes to lie lowest on the horizon, `gap` cells from the others: (its top, x, y)."""
    fringed = np.pad(lower, 2 * gap, constant_values=np.iinfo(np.int32).max // 2)
    wide = sliding_window_view(fringed, 2 * gap + 1).min(axis=1) - gap
    y = (sliding_window_view(horizon, len(wide)) - wide).max(axis=1)
    x = int(np.argmin(y))
    return int(y[x]) + int(upper.max()), x, int(y[x])


def _corners(surface: _Surface, chart: Longs, nodes: _Nodes) -> Doubles:
    """(T, 3, 2) UVs of the corners. One that lies nowhere falls on one that does, so that it covers nothing."""
    uv, known = nodes.find(chart[:, None], surface.triangles)
    anchor = np.take_along_axis(uv, np.argmax(known, axis=1)[:, None, None], axis=1)
    return np.where(known[..., None], uv, anchor)


def _stretch(surface: _Surface, uv: Doubles) -> Stretch:
    good = (_uv_area(uv) > 0.0) & (surface.area > 0.0)
    if not good.any():
        return Stretch(np.inf, np.inf, np.inf, np.inf)
    area, flat = surface.area[good], _uv_area(uv[good])
    largest, least = _singular(surface.points[surface.triangles[good]], uv[good])
    unit = np.sqrt(area.sum() / flat.sum())
    l2 = np.sqrt(0.5 * (largest**2 + least**2)) / unit
    order = np.argsort(l2)
    rank = np.searchsorted(np.cumsum(area[order]), 0.95 * area.sum())
    ratio, skew = area / flat / unit**2, largest / np.maximum(least, np.finfo(np.float64).tiny)
    return Stretch(
        l2=float(np.sqrt(np.average(l2**2, weights=area))),
        p95=float(l2[order][min(rank, len(order) - 1)]),
        area=float(np.average(np.maximum(ratio, 1.0 / ratio), weights=area)),
        angle=float(np.average(0.5 * (skew + 1.0 / skew), weights=area)),
    )


def _tangents(corners: Doubles, uv: Doubles) -> tuple[Doubles, Doubles]:
    """(n, 3) each: how the point moves with u and with v, for triangles (n, 3, 3) and their UVs (n, 3, 2)."""
    p, q = corners[:, 1:] - corners[:, :1], uv[:, 1:] - uv[:, :1]
    double = (q[:, 0, 0] * q[:, 1, 1] - q[:, 0, 1] * q[:, 1, 0])[:, None]
    along_u = (p[:, 0] * q[:, 1, 1, None] - p[:, 1] * q[:, 0, 1, None]) / double
    along_v = (p[:, 1] * q[:, 0, 0, None] - p[:, 0] * q[:, 1, 0, None]) / double
    return along_u, along_v


def _singular(corners: Doubles, uv: Doubles) -> tuple[Doubles, Doubles]:
    """(n,) each: the singular values of the map from UV to surface, larger first."""
    along_u, along_v = _tangents(corners, uv)
    a, b, c = _square(along_u), (along_u * along_v).sum(axis=1), _square(along_v)
    root = np.hypot(a - c, 2.0 * b)
    return np.sqrt(0.5 * (a + c + root)), np.sqrt(np.maximum(0.5 * (a + c - root), 0.0))


def _area(corners: Doubles) -> Doubles:
    """(n,) area of triangles (n, 3, 3)."""
    area: Doubles = 0.5 * np.sqrt(_square(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])))
    return area


def _uv_area(uv: Doubles) -> Doubles:
    """(n,) signed area of triangles (n, 3, 2), positive counter-clockwise."""
    p, q = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    area: Doubles = 0.5 * (p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0])
    return area


def _square(vectors: Doubles) -> Doubles:
    total: Doubles = (vectors * vectors).sum(axis=-1)
    return total


def _sums(group: Longs, values: Doubles, count: int) -> Doubles:
    sums: Doubles = np.bincount(group, values, minlength=count).astype(np.float64)
    return sums
