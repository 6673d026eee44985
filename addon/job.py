"""One bake from Blender: who is baked, charts where they are needed, the scene, the maps."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import bpy

from ..core.apart import unwrap_apart
from ..core.bake import Baked, Baker, Settings
from ..core.charts import Charts
from ..core.corners import with_corner_cells
from ..core.errors import InputError
from ..core.progress import Progress
from ..core.scene import Instance, Scene
from .colours import check_colours
from .extract import BaseTriangles, Warn, base_triangles, extract, synced, write_uv
from .occluding import EVERYTHING, Occluding
from .runner import Steps

CHARTS = "charts"  # as the UV map of the options: make one
CHART_MAP = "Occlusion Bake"  # and what it is called
FINGERPRINT = "occlusion_bake_charts"
_PADDING = 4


@dataclass(frozen=True)
class Options:
    """What to bake. objects: names. uv: a UV map's name, CHARTS, or None for the active one, charts where none is.
    occluding: who blocks light. colours: the corners of the faces are baked, no texels; the settings' size, margin and
    filter do not matter then, nor do UVs."""

    objects: tuple[str, ...]
    settings: Settings
    uv: str | None = None
    occluding: Occluding = EVERYTHING
    colours: bool = False


@dataclass
class Outcome:
    """What became of it, filled while the work goes on. seconds: what the objects share."""

    scene: Scene | None = None
    baker: Baker | None = None
    finished: list[str] = field(default_factory=list)
    refused: list[str] = field(default_factory=list)  # a line for each object that could not be baked
    notes: list[str] = field(default_factory=list)  # lines on charts made, and on what Cycles would trace
    charted: list[str] = field(default_factory=list)  # objects whose mesh was given a chart map
    seconds: dict[str, float] = field(default_factory=dict)

    @property
    def occluders(self) -> list[str]:
        """Names of the objects that block light, the targets among them where they do."""
        return sorted({each.belongs_to for each in self.scene.occluders}) if self.scene is not None else []

    def complaint(self, objects: int) -> str:
        """The line to end with where some of so many objects were refused."""
        if objects == 1:
            return self.refused[0]
        missing = objects - len(self.finished)
        return f"{missing} of {objects} objects could not be baked; {self.refused[0]}"


Deliver = Callable[[Instance, Baked], None]


def bake_steps(
    context: bpy.types.Context, options: Options, progress: Progress, outcome: Outcome, deliver: Deliver
) -> Steps:
    """The whole bake, for a `Runner`. `deliver` gets each result on the main thread as soon as it is there.

    An object that cannot be baked or delivered is refused with a line, and the others go on. Raises Cancelled, and
    InputError where all are refused and for what concerns them all.
    """
    start = time.perf_counter()
    if options.colours:
        names = list(options.objects)
    else:
        names = yield from chart_steps(context, options, progress, outcome)
    progress.enter("reading the scene")
    with _timed(outcome, "extract"):
        scene = _read(context, names, options, outcome)
    outcome.scene = scene
    outcome.baker = Baker(scene, options.settings, progress)
    for target in scene.targets:
        try:
            baker, laid_out = outcome.baker, target
            if options.colours:
                baker, laid_out = _corner_baker(context, scene, target, options, progress)
            baked = yield partial(baker.bake, laid_out)
            _share_times(outcome, baked, alone=len(scene.targets) == 1)
            deliver(laid_out, baked)
        except InputError as refusal:
            outcome.refused.append(str(refusal))
        else:
            outcome.finished.append(target.name)
    outcome.seconds["total"] = time.perf_counter() - start
    if not outcome.finished:
        raise InputError(outcome.complaint(len(options.objects)))


def _read(context: bpy.types.Context, names: Sequence[str], options: Options, outcome: Outcome) -> Scene:
    """The scene with all targets; where some cannot be read, those are refused. Raises InputError if all are."""
    uv = CHART_MAP if options.uv == CHARTS and not options.colours else options.uv

    def read(these: Sequence[str], warn: Warn | None = None) -> Scene:
        return extract(context, context.view_layer, these, uv, occluding=options.occluding, warn=warn)

    try:
        return read(names, outcome.notes.append)
    except InputError:
        if len(names) == 1:
            raise
    readable = []
    for name in names:
        try:
            read((name,))
        except InputError as refusal:
            outcome.refused.append(str(refusal))
        else:
            readable.append(name)
    if not readable:
        raise InputError(outcome.complaint(len(names)))
    return read(readable, outcome.notes.append)


def _corner_baker(
    context: bpy.types.Context, scene: Scene, target: Instance, options: Options, progress: Progress
) -> tuple[Baker, Instance]:
    """What bakes a target's face corners, and the target laid out for that (core/corners.py). Raises InputError."""
    check_colours(context.view_layer, target)
    apart, width, height = with_corner_cells(scene, target)
    settings = replace(options.settings, width=width, height=height, margin=0, filtered=False)
    baker = Baker(apart, settings, progress)
    progress.expect(len(scene.targets))
    return baker, apart.targets[0]


def _share_times(outcome: Outcome, baked: Baked, *, alone: bool) -> None:
    """Charts belong to their object; reading the scene does too where there is only one."""
    baked.seconds["charts"] = outcome.seconds.pop(f"charts of {baked.name}", 0.0)
    if alone:
        baked.seconds["extract"] = outcome.seconds.pop("extract", 0.0)


def chart_steps(
    context: bpy.types.Context, options: Options, progress: Progress, outcome: Outcome
) -> Generator[Callable[[], Any], Any, list[str]]:
    """Give chart UVs, in a map of their own, to the meshes that need them; for a `Runner`.

    Returns the names of the objects to go on with: one whose mesh cannot have charts is refused with a line. Raises
    Cancelled, and InputError where none is left.
    """
    names = list(options.objects)
    for sharing in _without_charts(context, options):
        progress.enter(f"{sharing[0]}: making UV charts")
        try:
            with _timed(outcome, f"charts of {sharing[0]}"):
                made = yield from _chart(context, sharing[0], options.settings, progress)
        except InputError as refusal:
            outcome.refused.append(str(refusal))
            names = [name for name in names if name not in sharing]
            continue
        if made is not None:
            outcome.charted += sharing
            outcome.notes.append(
                f"{sharing[0]}: {made.count} charts in the UV map {CHART_MAP}, stretch {made.stretch.l2:.3f}, "
                f"{100.0 * made.utilisation:.0f} % of the image used"
            )
    if not names:
        raise InputError(outcome.complaint(len(options.objects)))
    return names


def _chart(
    context: bpy.types.Context, name: str, settings: Settings, progress: Progress
) -> Generator[Callable[[], Any], Any, Charts | None]:
    """Charts for the mesh of one object; None where those made before still fit."""
    size = (settings.width, settings.height)
    obj = synced(context.view_layer)[name]
    base = base_triangles(context, obj)
    mark = _fingerprint(base, size)
    if obj.data.get(FINGERPRINT) == mark and CHART_MAP in obj.data.uv_layers:
        return None
    _refuse_linked(obj)
    charts: Charts = yield lambda: unwrap_apart(
        *(name, base.vertices, base.triangles, base.polygons),
        size=size,
        padding=_PADDING,
        cancelled=lambda: bool(progress.control.cancel),
    )
    obj = synced(context.view_layer).get(name)  # the artist, or an undo, may have been at it
    if obj is None or _fingerprint(base_triangles(context, obj), size) != mark:
        raise InputError(f"{name}: it was changed while its charts were made; start again")
    write_uv(context, obj, CHART_MAP, charts.uv, base.loops)
    obj.data[FINGERPRINT] = mark
    return charts


def _without_charts(context: bpy.types.Context, options: Options) -> list[list[str]]:
    """Names of the objects to chart; those that share a mesh together."""
    objects = synced(context.view_layer)
    found: dict[int, list[str]] = {}
    for name in options.objects:
        obj = objects.get(name)
        if obj is None or obj.type != "MESH" or len(obj.data.polygons) == 0:
            continue  # reading the scene says what is wrong
        layers = obj.data.uv_layers
        own = layers.active is not None and layers.active.name == CHART_MAP
        if options.uv == CHARTS or (options.uv is None and (len(layers) == 0 or own)):
            found.setdefault(obj.data.as_pointer(), []).append(name)
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
    """Names of the view layer's mesh objects that render, in the Outliner's order; those without faces are left out."""
    shown = set(_shown_collections(view_layer.layer_collection))
    return [
        obj.name
        for obj in synced(view_layer)
        if obj.type == "MESH"
        and _renders_itself(obj)
        and any(collection.name_full in shown for collection in obj.users_collection)
        and (len(obj.data.polygons) or len(obj.modifiers))  # modifiers may make the faces
    ]


def _renders_itself(obj: bpy.types.Object) -> bool:
    instances = obj.is_instancer or len(obj.particle_systems) > 0
    return not obj.hide_render and (obj.show_instancer_for_render or not instances)


def _shown_collections(layer: Any) -> Iterator[str]:
    if layer.exclude or layer.collection.hide_render:
        return
    yield layer.collection.name_full
    for child in layer.children:
        yield from _shown_collections(child)
