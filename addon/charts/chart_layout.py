"""One layout for several meshes: new charts, by us or by Blender, beside those that some of them keep."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import bpy
import numpy as np

from ...core.base.arrays import Floats
from ...core.charts.child_process import Child
from ...core.charts.existing import side_by_side
from ...core.charts.figures import ChartFigures
from ...core.charts.stages import Tell
from ...core.charts.unwrap import Charts
from ...core.charts.unwrap_process import side_by_side_in_process, unwrap_in_process
from ...core.progress import Progress
from ...core.texels.rasterize import owners_by_centre
from ..read.blender_state import object_mode
from .chart_order import ChartOrder
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


def layout_steps(context: bpy.types.Context, order: ChartOrder, progress: Progress, child: Child) -> Made:
    """Make it, for a `Runner`. child: is asked for all that is not Blender's. Raises InputError, NoUnwrapper and
    Cancelled."""
    title, parts, request = order.title, order.parts, order.request
    bare = [part for part in parts if part.own is None]
    new: list[Floats] = []
    if bare and request.by_blender:
        with object_mode(context):
            now = [part.obj for part in order.parts_now(context) if part.own is None]
            new = smart_unwrap(context, now, in_world=bool(request.atlas))
    elif bare:
        alone = len(bare) == len(parts)
        charts: Charts = yield _unwrapping(
            title, bare, request, _teller(progress, title, 0.0, 1.0 if alone else _UNWRAPPED), child
        )
        new = np.split(charts.uv, np.cumsum([len(part.base.triangles) for part in bare], dtype=np.int64)[:-1])
        if alone:
            return ChartLayout(
                new, ChartFigures(charts.count, charts.stretch, charts.utilisation, charts.padding, PADDING)
            )
    tell = _teller(progress, title, _UNWRAPPED if bare else 0.0, 1.0)
    layout: ChartLayout = yield lambda: _side_by_side(title, parts, new, request, tell, child)
    return layout


def _teller(progress: Progress, title: str, start: float, end: float) -> Tell:
    """Tells how far a part of the making of charts is."""
    return lambda share, stage: progress.reach(start + (end - start) * share, f"{title}: {stage}")


def _unwrapping(
    title: str, parts: Sequence[Part], request: ChartRequest, tell: Tell, child: Child
) -> Callable[[], Charts]:
    """The unwrap of parts as one mesh."""
    starts = np.cumsum([0, *(len(part.base.vertices) for part in parts)], dtype=np.int64)
    faces = np.cumsum([0, *(int(part.base.polygons.max(initial=-1)) + 1 for part in parts)], dtype=np.int64)
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
        child=child,
    )


def _side_by_side(
    title: str, parts: Sequence[Part], new: Sequence[Floats], request: ChartRequest, tell: Tell, child: Child
) -> ChartLayout:
    """new: UVs of those parts that keep no charts, one after the other."""
    laid_out = iter(new)
    maps = [part.charts_in(next(laid_out)) if part.own is None else part.kept(request.udim) for part in parts]
    # Blender unwraps where a process of ours broke down, too: what is left to do is done without another.
    lay = side_by_side if request.by_blender else partial(side_by_side_in_process, child=child)
    laid = lay(title, maps, request.size, PADDING, progress=tell)
    width, height = (min(side, _LOOKED_AT) for side in request.size)
    owners = owners_by_centre(np.concatenate(laid.uv), width, height)  # charts may lie on one another
    return ChartLayout(
        laid.uv, ChartFigures(laid.count, laid.stretch, float((owners >= 0).mean()), laid.padding, PADDING)
    )
