"""Charts packed into an image by their outlines."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ..base.arrays import Doubles, Ints, Longs
from ..base.triangles import uv_area_of

# Charts are packed on a grid no finer than this, at so many scales at most.
FINEST, TRIES = 1024, 8


def packed(uv: Doubles, piece: Longs, triangles: Longs, size: tuple[int, int], padding: int) -> tuple[Doubles, int]:
    """Lay charts out in the unit square: (T, 3, 2) UVs, and the padding kept.

    uv: (T, 3, 2), each chart in any place of its own, all at one scale. piece: (T,) the chart of each triangle, from 0.
    triangles: (T, 3) the vertices, which tell where a chart's border is. size: width and height of the image in texels;
    the texels are square. padding: texels to keep free between charts; halved where the charts fit at no scale, and
    with none left the layout is shrunk as a whole.
    """
    return _Pieces.of(uv, piece, triangles).fit(size, padding)


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

    def fit(self, size: tuple[int, int], padding: int) -> tuple[Doubles, int]:
        """(T, 3, 2) UVs at the largest scale found at which the charts fit, and the padding kept: see `packed`."""
        cell = min(-(-max(size) // FINEST), *size)  # texels
        width, height = (side // cell for side in size)
        most = self._most(width, height)
        area = float(uv_area_of(self.uv).sum())
        scale, best = min(most, np.sqrt(float(width * height)) * np.sqrt(0.6 / area)), None
        for _ in range(TRIES):
            places = self._places(scale, width, -(-padding // cell))
            fits = places.height <= height
            if fits and (best is None or scale > best.scale):
                best = places
            if fits and (places.height > 0.985 * height or scale == most):
                break
            # The atlas has the width of the image, so its height goes with the square of the scale.
            scale = min(most, scale * float(np.clip(np.sqrt(0.993 * height / places.height), 0.5, 1.5)))
        if best is None and padding > 0:
            return self.fit(size, padding // 2)
        best = best or places
        return best.apply(self.uv, self.piece) * (cell / (np.array(size) * max(1.0, best.height / height))), padding

    def _most(self, width: int, height: int) -> float:
        """The scale at which every chart alone fits, lying along the longer side."""
        longest, broadest = float(self.extent.max()), float(self.extent.min(axis=1).max())
        return min(0.999 * max(width, height) / longest, 0.999 * min(width, height) / broadest)

    def _places(self, scale: float, width: int, gap: int) -> _Places:
        """Drop the charts one by one, broadest first, turned by quarters, to where they come to lie lowest.

        The "Tetris" packing of Levy et al. 2002, "Least Squares Conformal Maps for Automatic Texture Atlas Generation".
        """
        outlines = [_Outlines.along(self, axis, scale) for axis in range(2)]
        horizon = np.full(width + 2 * gap, -gap, np.int32)
        count = len(self.extent)
        turn, place, height = np.zeros(count, np.int64), np.zeros((count, 2)), 0
        # Rounded, so that equal charts keep their order at any scale of the mesh.
        broadest = np.argsort(-np.round(self.extent.min(axis=1), 1), kind="stable")
        for chart in broadest:
            shapes = [outlines[quarter % 2].turned(chart, quarter) for quarter in range(4)]
            drops = {
                quarter: _drop(horizon, *shape, gap) for quarter, shape in enumerate(shapes) if len(shape[0]) <= width
            }
            turn[chart] = quarter = min((drop[0], quarter) for quarter, drop in drops.items())[1]
            top, x, y = drops[quarter]
            height, place[chart] = max(height, top), (x, y)
            upper = shapes[quarter][1]
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

    lower: Ints
    upper: Ints
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

    def turned(self, chart: int, quarter: int) -> tuple[Ints, Ints]:
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


def _drop(horizon: Ints, lower: Ints, upper: Ints, gap: int) -> tuple[int, int, int]:
    """Where a chart comes to lie lowest on the horizon, `gap` cells from the others: (its top, x, y)."""
    fringed = np.pad(lower, 2 * gap, constant_values=np.iinfo(np.int32).max // 2)
    wide = sliding_window_view(fringed, 2 * gap + 1).min(axis=1) - gap
    y = (sliding_window_view(horizon, len(wide)) - wide).max(axis=1)
    x = int(np.argmin(y))
    return int(y[x]) + int(upper.max()), x, int(y[x])
