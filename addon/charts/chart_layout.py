"""One layout for several meshes: new charts, by us or by Blender, beside those that some of them keep."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from ...core.base.arrays import Floats
from ...core.base.triangles import uv_area_of
from ...core.charts.existing import side_by_side
from ...core.charts.figures import ChartFigures
from ...core.charts.stages import Tell
from ...core.charts.stretch import stretch_of
from ...core.charts.unwrap import Charts
from ...core.charts.unwrap_process import unwrap_in_process
from ...core.progress import Progress
from ...core.texels.rasterize import owners_by_centre
from .chart_parts import Part, seams_of
from .chart_request import PADDING, ChartRequest
from .smart_project import smart_unwrap

_UNWRAPPED = 0.8  # of the work is done once there are new charts to be laid beside others
_LOOKED_AT = 1024  # texels a side, at most, to see how much is used

Made = Generator[Callable[[], Any], Any, "ChartLayout"]


@dataclass(frozen=True, eq=False)
class ChartLayout:
    """uv: for each part (T, 3, 2) float32."""

    uv: list[Floats]
    figures: ChartFigures


def layout_steps(
    context: bpy.types.Context, title: str, parts: Sequence[Part], request: ChartRequest, progress: Progress
) -> Made:
    """Lay the parts out, for a `Runner`. Raises InputError, NoUnwrapper and Cancelled."""
    bare = [part for part in parts if part.own is None]
    new: list[Floats] = []
    if bare and request.by_blender:
        new = smart_unwrap(context, [part.obj for part in bare], in_world=bool(request.atlas))
    elif bare:
        alone = len(bare) == len(parts)
        charts: Charts = yield _unwrapping(
            title, bare, request, _teller(progress, title, 0.0, 1.0 if alone else _UNWRAPPED)
        )
        new = np.split(charts.uv, np.cumsum([len(part.base.triangles) for part in bare])[:-1])
        if alone:
            return ChartLayout(
                new, ChartFigures(charts.count, charts.stretch, charts.utilisation, charts.padding, PADDING)
            )
    tell = _teller(progress, title, _UNWRAPPED if bare else 0.0, 1.0)
    layout: ChartLayout = yield lambda: _side_by_side(title, parts, new, request, tell)
    return layout


def _teller(progress: Progress, title: str, start: float, end: float) -> Tell:
    """Tells how far a part of the making of charts is."""
    return lambda share, stage: progress.reach(start + (end - start) * share, f"{title}: {stage}")


def _unwrapping(title: str, parts: Sequence[Part], request: ChartRequest, tell: Tell) -> Callable[[], Charts]:
    """The unwrap of parts as one mesh."""
    starts = np.cumsum([0, *(len(part.base.vertices) for part in parts)])
    faces = np.cumsum([0, *(int(part.base.polygons.max(initial=-1)) + 1 for part in parts)])
    vertices = np.concatenate([part.vertices for part in parts])
    triangles = np.concatenate([part.base.triangles + start for part, start in zip(parts, starts, strict=False)])
    polygons = np.concatenate([part.base.polygons + start for part, start in zip(parts, faces, strict=False)])
    seams = seams_of(parts)
    return lambda: unwrap_in_process(
        title,
        vertices,
        triangles.astype(np.int32),
        polygons.astype(np.int32),
        size=request.size,
        padding=PADDING,
        seams=seams,
        progress=tell,
    )


def _side_by_side(
    title: str, parts: Sequence[Part], new: Sequence[Floats], request: ChartRequest, tell: Tell
) -> ChartLayout:
    """new: UVs of those parts that keep no charts, one after the other."""
    laid_out, size = iter(new), request.size
    maps = [part.laid_out(next(laid_out)) if part.own is None else part.kept(request.udim) for part in parts]
    laid = side_by_side(title, maps, size, PADDING, progress=tell)
    uv = np.concatenate(laid.uv)
    drawn = uv.astype(np.float64) * (np.array(size) / max(size))  # as texels are square
    turned = np.where((uv_area_of(drawn) < 0.0)[:, None], [0, 2, 1], [0, 1, 2])[:, :, None]  # those that are mirrored
    surface = np.take_along_axis(np.concatenate([part.corners for part in parts]), turned, axis=1)
    stretch = stretch_of(surface, np.take_along_axis(drawn, turned, axis=1))
    width, height = (min(side, _LOOKED_AT) for side in size)
    used = float((owners_by_centre(uv, width, height) >= 0).mean())  # charts may lie on one another
    return ChartLayout(laid.uv, ChartFigures(laid.count, stretch, used, laid.padding, PADDING))
