"""One bake from Blender: who is baked, charts where they are needed, the scene, the maps."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import bpy

from ..core.apart import unwrap_apart
from ..core.bake import Baked, Baker, Settings
from ..core.errors import InputError
from ..core.progress import Progress
from ..core.scene import Instance, Scene
from .extract import BaseTriangles, base_triangles, extract, synced, write_uv
from .runner import Steps

CHARTS = "charts"  # as the UV map of the options: make one
CHART_MAP = "Occlusion Bake"  # and what it is called
_FINGERPRINT = "occlusion_bake_charts"
_PADDING = 4


@dataclass(frozen=True)
class Options:
    """What to bake. objects: names. uv: a UV map's name, CHARTS, or None for the active one, charts where none is."""

    objects: tuple[str, ...]
    settings: Settings
    uv: str | None = None


@dataclass
class Outcome:
    """What became of it, filled while the work goes on. seconds: what the objects share."""

    scene: Scene | None = None
    baker: Baker | None = None
    finished: list[str] = field(default_factory=list)
    refused: list[str] = field(default_factory=list)  # a line for each object that could not be baked
    notes: list[str] = field(
        default_factory=list
    )  # lines on charts made and on what Cycles would trace and this cannot
    charted: list[str] = field(default_factory=list)  # objects whose mesh was given a chart map
    seconds: dict[str, float] = field(default_factory=dict)


Deliver = Callable[[Instance, Baked], None]


def bake_steps(
    context: bpy.types.Context, options: Options, progress: Progress, outcome: Outcome, deliver: Deliver
) -> Steps:
    """The whole bake, for a `Runner`. `deliver` gets each result on the main thread as soon as it is there.

    An object that cannot be baked is refused with a line and the others go on; if all are, InputError is raised. Raises
    Cancelled, and InputError for what concerns them all.
    """
    start = time.perf_counter()
    yield from chart_steps(context, options, progress, outcome)
    progress.enter("reading the scene")
    with _timed(outcome, "extract"):
        chosen = CHART_MAP if options.uv == CHARTS else options.uv
        scene = extract(context, context.view_layer, options.objects, chosen, warn=outcome.notes.append)
    outcome.scene = scene
    outcome.baker = Baker(scene, options.settings, progress)
    for target in scene.targets:
        try:
            baked = yield lambda target=target: outcome.baker.bake(target)  # type: ignore[misc, union-attr]
        except InputError as refusal:
            outcome.refused.append(str(refusal))
            continue
        _share_times(outcome, baked, alone=len(scene.targets) == 1)
        deliver(target, baked)
        outcome.finished.append(target.name)
    outcome.seconds["total"] = time.perf_counter() - start
    if not outcome.finished:
        raise InputError(outcome.refused[0])


def _share_times(outcome: Outcome, baked: Baked, *, alone: bool) -> None:
    """Charts belong to their object; reading the scene does too where there is only one."""
    baked.seconds["charts"] = outcome.seconds.pop(f"charts of {baked.name}", 0.0)
    if alone:
        baked.seconds["extract"] = outcome.seconds.pop("extract", 0.0)


def chart_steps(context: bpy.types.Context, options: Options, progress: Progress, outcome: Outcome) -> Steps:
    """Give chart UVs, in a map of their own, to the meshes that need them."""
    size = (options.settings.width, options.settings.height)
    for obj in _without_charts(context, options):
        progress.enter(f"{obj.name}: making UV charts")
        with _timed(outcome, f"charts of {obj.name}"):
            base = base_triangles(context, obj)
            mark = _fingerprint(base, size)
            if obj.data.get(_FINGERPRINT) == mark and CHART_MAP in obj.data.uv_layers:
                continue
            _refuse_linked(obj)
            charts = yield lambda obj=obj, base=base: unwrap_apart(  # type: ignore[misc]
                *(obj.name, base.vertices, base.triangles, base.polygons),
                size=size,
                padding=_PADDING,
                cancelled=lambda: bool(progress.control.cancel),
            )
            write_uv(context, obj, CHART_MAP, charts.uv, base.loops)
            obj.data[_FINGERPRINT] = mark
        outcome.charted.append(obj.name)
        outcome.notes.append(
            f"{obj.name}: {charts.count} charts in the UV map {CHART_MAP}, stretch {charts.stretch.l2:.3f}, "
            f"{100.0 * charts.utilisation:.0f} % of the image used"
        )


def _without_charts(context: bpy.types.Context, options: Options) -> list[bpy.types.Object]:
    """The objects to chart, one for each mesh."""
    objects = synced(context.view_layer)
    found: dict[int, bpy.types.Object] = {}
    for name in options.objects:
        obj = objects.get(name)
        if obj is None or obj.type != "MESH" or len(obj.data.polygons) == 0:
            continue  # reading the scene says what is wrong
        layers = obj.data.uv_layers
        own = layers.active is not None and layers.active.name == CHART_MAP
        if options.uv == CHARTS or (options.uv is None and (len(layers) == 0 or own)):
            found.setdefault(obj.data.as_pointer(), obj)
    return list(found.values())


def _refuse_linked(obj: bpy.types.Object) -> None:
    """Before minutes of unwrapping, what `write_uv` would say after."""
    if obj.data.library is not None:
        where = obj.data.library.filepath
        raise InputError(
            f"{obj.name}: its mesh is linked from {where} and has no UV map; make it local or unwrap it there"
        )


def _fingerprint(base: BaseTriangles, size: tuple[int, int]) -> str:
    """Tells whether charts made before still fit."""
    digest = hashlib.blake2b(repr(size).encode(), digest_size=16)
    for array in (base.vertices, base.triangles, base.polygons):
        digest.update(array.tobytes())
    return digest.hexdigest()


@contextmanager
def _timed(outcome: Outcome, stage: str) -> Iterator[None]:
    start = time.perf_counter()
    yield
    outcome.seconds[stage] = outcome.seconds.get(stage, 0.0) + time.perf_counter() - start


def meshes_in_render(view_layer: bpy.types.ViewLayer) -> list[str]:
    """Names of the view layer's mesh objects with faces that render, in the Outliner's order."""
    shown = set(_shown_collections(view_layer.layer_collection))
    names = []
    for obj in synced(view_layer):
        visible = not obj.hide_render and any(collection.name_full in shown for collection in obj.users_collection)
        if obj.type == "MESH" and visible and len(obj.data.polygons):
            names.append(obj.name)
    return names


def _shown_collections(layer: Any) -> Iterator[str]:
    if layer.exclude or layer.collection.hide_render:
        return
    yield layer.collection.name_full
    for child in layer.children:
        yield from _shown_collections(child)
