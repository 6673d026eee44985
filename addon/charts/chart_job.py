"""UV charts for the meshes that need them, in a UV map of their own: each mesh's, or those of all in one atlas."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

import bpy

from ...core.base.errors import InputError
from ...core.base.timing import Stopwatch
from ...core.charts.child_process import Child
from ...core.charts.figures import ChartFigures
from ...core.progress import Progress
from ..read.blender_state import object_mode, synced
from ..read.block_ref import BlockRef, by_ref
from ..read.writable_mesh import check_reachable
from ..typed import library_of, view_layer_in
from .chart_layout import ChartLayout, layout_steps
from .chart_marks import OUR_NAMES, is_ours, set_mark
from .chart_order import ChartOrder, stands
from .chart_parts import Part, Wanted, parts_of
from .chart_plan import ChartPlan, chart_plan
from .chart_request import ChartRequest
from .rollback import MapChange
from .uv_maps import check_map, write_uv


@dataclass
class ChartJob:
    """What became of a request for charts, filled while the work goes on.

    smart: the objects that Blender unwraps, as ours broke down. maps: the UV maps that objects are baked onto,
    where those are not the active ones. made: the objects whose mesh was given charts, and figures of the layout.
    refused: why an object cannot have any. clock: tells how long each layout took. changes: of meshes.
    """

    request: ChartRequest = field(default_factory=ChartRequest)
    smart: frozenset[BlockRef] = frozenset()
    maps: dict[BlockRef, str] = field(default_factory=dict)
    made: dict[BlockRef, ChartFigures] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    refused: dict[BlockRef, InputError] = field(default_factory=dict)
    clock: Stopwatch = field(default_factory=Stopwatch)
    changes: list[MapChange] = field(default_factory=list)

    @contextmanager
    def refusing(self, refs: Sequence[BlockRef]) -> Iterator[None]:
        """An InputError that is raised within is what is said of these objects, of which nothing else is."""
        try:
            yield
        except InputError as refusal:
            self.refused.update({ref: refusal for ref in refs if ref not in self.refused})


def chart_steps(
    context: bpy.types.Context, refs: Sequence[BlockRef], charting: ChartJob, progress: Progress, then: int = 0
) -> Generator[Callable[[], Any], Any, None]:
    """Give chart UVs to the objects' meshes that need them; for a `Runner`. then: how many objects are baked after
    that. Raises Cancelled.

    All meshes are read first and written last: each way out of Edit Mode and back is two steps of undo.
    """
    with object_mode(context):
        orders = _orders(context, refs, charting)
    made: list[tuple[ChartOrder, ChartLayout]] = []
    with Child() as child:
        for done, order in enumerate(orders):
            progress.expect(len(orders) - done + then)
            progress.enter(f"{order.title}: making UV charts", (0.0, 1.0))
            with _of(order, charting):
                layout = yield from layout_steps(context, order, progress, child)
                made.append((order, layout))
                progress.finish_object()
    progress.expect(then)
    if made:
        with object_mode(context):
            for order, layout in made:
                with _of(order, charting):
                    _write(context, order, layout, charting)


@contextmanager
def _of(order: ChartOrder, charting: ChartJob) -> Iterator[None]:
    """What passes within, in time and in refusals, is the order's."""
    with charting.clock.stage(f"charts of {order.title}"), charting.refusing(order.refs):
        yield


def _orders(context: bpy.types.Context, refs: Sequence[BlockRef], charting: ChartJob) -> list[ChartOrder]:
    """The layouts to be made; what would be refused when they are written is so now. Within `object_mode`."""
    found = {}
    for ref, obj in by_ref(synced(view_layer_in(context)), refs).items():
        if obj is not None and obj.type == "MESH":
            with charting.refusing([ref]):
                check_reachable(obj, ref.label)
                found[ref] = obj
    plan = chart_plan(context, found, charting.request)
    charting.maps |= plan.maps
    charting.refused |= plan.refused
    orders = (_order(context, group, plan, charting) for group in plan.groups)
    return [order for order in orders if order is not None]


def _order(context: bpy.types.Context, wanted: Wanted, plan: ChartPlan, charting: ChartJob) -> ChartOrder | None:
    """Of those of a group whose meshes can be written; None where their charts stand."""
    request = replace(charting.request, smart=charting.smart.issuperset(wanted))
    title = request.atlas or next(iter(wanted)).label
    with charting.clock.stage(f"charts of {title}"):
        parts = []
        for ref, source in wanted.items():
            with charting.refusing(plan.sharing[ref]):
                parts += parts_of(context, {ref: source}, in_world=bool(request.atlas))
        if not stands(parts, request):
            for part in list(parts):
                with charting.refusing(plan.sharing[part.ref]):
                    _check_free(part, request.layer)
            parts = [part for part in parts if part.ref not in charting.refused]
        if not stands(parts, request):
            return ChartOrder(title, [ref for part in parts for ref in plan.sharing[part.ref]], parts, request)
    for part in parts:
        _prefer(part, request.layer, charting)
    return None


def _write(context: bpy.types.Context, order: ChartOrder, layout: ChartLayout, charting: ChartJob) -> None:
    """A layout into its meshes, all or none. Within `object_mode`; raises InputError."""
    layer, parts = order.request.layer, order.parts_now(context)
    for part in parts:
        _check_free(part, layer)
    for i, (part, uv) in enumerate(zip(parts, layout.uv, strict=True)):
        charting.changes.append(MapChange.of(part.ref, part.mesh, layer, written=True))
        write_uv(context, part.obj, layer, uv, part.base.loops)
        set_mark(part.mesh, layer, f"{order.made_for}{i}", part.source)
        _prefer(part, layer, charting)
    charting.made.update(dict.fromkeys(order.refs, layout.figures))
    charting.notes.append(f"{order.title}: {_told(layout.figures, parts, order.request)}")


def _told(figures: ChartFigures, parts: Sequence[Part], request: ChartRequest) -> str:
    """What was made, in a line."""
    kept, how = sum(part.own is not None for part in parts), " by Smart UV Project" if request.by_blender else ""
    if kept == len(parts):
        how = ", those of their own UV maps side by side,"
    elif kept:
        how = f", those of {kept} of {len(parts)} UV maps beside new ones{how},"
    return f"{figures.count} charts{how} in the UV map {request.layer}, {figures.in_words()}"


def _prefer(part: Part, layer: str, charting: ChartJob) -> None:
    """Of our own maps the last that was baked onto is active; an artist's stays so. Within `object_mode`."""
    layers, local = part.mesh.uv_layers, library_of(part.mesh) is None
    active = layers.active.name if layers.active is not None else ""
    if local and active != layer and active in OUR_NAMES and is_ours(part.mesh, active):
        charting.changes.append(MapChange.of(part.ref, part.mesh, layer, written=False))
        layers.active = layers[layer]


def _check_free(part: Part, layer: str) -> None:
    """Whether charts can be written, and over nothing that an artist has made or been at. Raises InputError."""
    check_map(part.obj, part.ref.label, layer)
    if layer in part.mesh.uv_layers and not is_ours(part.mesh, layer):
        raise InputError(
            f"{part.ref.label}: new charts would take the place of its UV map {layer}, which was made or edited by "
            "hand; rename it to keep it, or remove it"
        )
