"""One bake from Blender: who is baked, charts where they are needed, the scene, the maps."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import bpy

from ...core.bake import Baked, Baker, Settings
from ...core.base.errors import InputError
from ...core.base.timing import timed
from ...core.charts.udim import tiles_of
from ...core.finish.atlas import Atlas
from ...core.progress import Progress
from ...core.scene.scene import Instance, Scene
from ...core.texels.vertex_bake import with_corner_cells
from ..charts.chart_job import Charting, chart_steps
from ..output.color_attributes import check_colours
from ..read.high_low_pairs import HighNames
from ..read.occluder_filter import EVERYTHING, Occluding
from ..read.scene_reader import Warn, extract, synced
from ..read.world_reader import read_world
from .runner import Steps

WAITING, BAKING, DONE, REFUSED = "waiting", "baking", "done", "refused"


@dataclass(frozen=True)
class Options:
    """What to bake. objects: names. uv: a UV map's name, CHARTS or SMART, or None for the active one, charts where none
    is. occluding: who blocks light. colours: the corners of the faces are baked, no texels; the settings' size, margin
    and filter do not matter then, nor do UVs. highs: what objects are baked from, where it is not their own surface.
    atlas: the name of one image for all objects; empty: each has its own. tiled: a UDIM layout has an image a tile.
    smart: let Blender unwrap what xatlas would, where there is no xatlas."""

    objects: tuple[str, ...]
    settings: Settings
    uv: str | None = None
    occluding: Occluding = EVERYTHING
    colours: bool = False
    highs: Mapping[str, HighNames] = field(default_factory=dict)
    atlas: str = ""
    tiled: bool = True
    smart: bool = False


@dataclass(frozen=True, eq=False)
class Result:
    """One finished texture. name: its object's, or the atlas'. targets: the objects in it. bakes: one, or one a tile of
    a UDIM layout."""

    name: str
    targets: tuple[Instance, ...]
    bakes: tuple[Baked, ...]

    @property
    def target(self) -> Instance:
        """The object; the first of an atlas."""
        return self.targets[0]

    @property
    def baked(self) -> Baked:
        """The bake; the first of a UDIM layout."""
        return self.bakes[0]


@dataclass
class Outcome:
    """What became of it, filled while the work goes on. seconds: what the objects share."""

    scene: Scene | None = None
    baker: Baker | None = None
    finished: list[str] = field(default_factory=list)
    refused: list[str] = field(default_factory=list)  # a line for each object that could not be baked
    notes: list[str] = field(default_factory=list)  # lines on charts made, and on what Cycles would trace
    charting: Charting = field(default_factory=Charting)
    seconds: dict[str, float] = field(default_factory=dict)
    states: dict[str, str] = field(default_factory=dict)  # by object, in the order that they are baked

    @property
    def occluders(self) -> list[str]:
        """Names of the objects that block light, the targets among them where they do."""
        return sorted({each.belongs_to for each in self.scene.occluders}) if self.scene is not None else []

    def refuse(self, name: str, why: InputError) -> None:
        """An object cannot be baked; objects that share a reason share its line."""
        if str(why) not in self.refused:
            self.refused.append(str(why))
        self.states[name] = REFUSED

    def finish(self, name: str) -> None:
        """An object is baked and delivered."""
        self.finished.append(name)
        self.states[name] = DONE

    def complaint(self, objects: int) -> str:
        """The line to end with where some of so many objects were refused."""
        if objects == 1:
            return self.refused[0]
        missing = objects - len(self.finished)
        return f"{missing} of {objects} objects could not be baked; {self.refused[0]}"


Deliver = Callable[[Result], None]


def bake_steps(
    context: bpy.types.Context, options: Options, progress: Progress, outcome: Outcome, deliver: Deliver
) -> Steps:
    """The whole bake, for a `Runner`. `deliver` gets each result on the main thread as soon as it is there.

    An object that cannot be baked or delivered is refused with a line, and the others go on. Raises Cancelled, and
    InputError where all are refused and for what concerns them all.
    """
    start = time.perf_counter()
    outcome.states.update(dict.fromkeys(options.objects, WAITING))
    names = list(options.objects)
    if not options.colours:
        names = yield from prepared_charts(context, options, progress, outcome)
    progress.enter("reading the scene")
    with timed(outcome.seconds, "extract"):
        scene = _read(context, names, options, outcome)
        if any(each.is_light for each in options.settings.estimators):
            scene = replace(scene, environment=read_world(context.scene))
    outcome.scene = scene
    # The margin of an atlas is filled once, when all objects are in it.
    settings = replace(options.settings, margin=0) if options.atlas else options.settings
    outcome.baker = Baker(scene, settings, progress)
    tiles = {target.name: _tiles(target, options) for target in scene.targets}
    progress.expect(sum(map(len, tiles.values())))
    atlas, in_atlas = Atlas(options.atlas), []
    for target in scene.targets:
        outcome.states[target.name] = BAKING
        try:
            result = yield from _bake_one(context, target, tiles[target.name], options, progress, outcome)
            if options.atlas:
                atlas.add(result.baked)
                in_atlas.append(result.target)
                outcome.states[target.name] = DONE
                continue
            deliver(result)
        except InputError as refusal:
            outcome.refuse(target.name, refusal)
        else:
            outcome.finish(target.name)
    if in_atlas:
        whole: Baked = yield partial(atlas.finish, options.settings.margin)
        deliver(Result(options.atlas, tuple(in_atlas), (whole,)))
        for target in in_atlas:
            if outcome.states[target.name] != REFUSED:
                outcome.finish(target.name)
    outcome.seconds["total"] = time.perf_counter() - start
    if not outcome.finished:
        raise InputError(outcome.complaint(len(options.objects)))


def prepared_charts(
    context: bpy.types.Context, options: Options, progress: Progress, outcome: Outcome
) -> Generator[Callable[[], Any], Any, list[str]]:
    """`chart_steps` for these options, what it has to say in the outcome. Returns the names of the objects to go on
    with. Raises as that, and InputError where none is left."""
    settings = options.settings
    outcome.charting = Charting(options.uv, options.atlas, options.smart, (settings.width, settings.height))
    yield from chart_steps(context, options.objects, outcome.charting, progress)
    for name, refusal in outcome.charting.refused.items():
        outcome.refuse(name, refusal)
    outcome.notes += outcome.charting.notes
    outcome.seconds.update(outcome.charting.seconds)
    names = [name for name in options.objects if name not in outcome.charting.refused]
    if not names:
        raise InputError(outcome.complaint(len(options.objects)))
    return names


def _bake_one(
    context: bpy.types.Context,
    target: Instance,
    tiles: list[int | None],
    options: Options,
    progress: Progress,
    outcome: Outcome,
) -> Generator[Callable[[], Any], Any, Result]:
    assert outcome.scene is not None and outcome.baker is not None
    baker, laid_out = outcome.baker, target
    if options.colours:
        _refuse_second_of_a_mesh(context, target, outcome)
        baker, laid_out = _corner_baker(context, outcome.scene, target, options, progress)
    bakes = []
    for tile in tiles:
        baked: Baked = yield partial(baker.bake, laid_out, tile)
        bakes.append(baked)
    _share_times(outcome, bakes[0], alone=len(outcome.scene.targets) == 1)
    return Result(target.name, (laid_out,), tuple(bakes))


def _refuse_second_of_a_mesh(context: bpy.types.Context, target: Instance, outcome: Outcome) -> None:
    """Colours belong to the mesh, and of objects that share one the last would take them from the others."""
    objects = synced(context.view_layer)
    mesh = objects[target.name].data
    for name in outcome.finished:
        if objects.get(name) is not None and objects[name].data == mesh:
            raise InputError(
                f"{target.name}: it shares its mesh, and with it the colors, with {name}; make it a single user "
                "(Object > Relations > Make Single User > Object & Data)"
            )


def _tiles(target: Instance, options: Options) -> list[int | None]:
    """Of a UDIM layout; else the unit square alone."""
    one_image = options.colours or options.atlas or not options.tiled
    return [None] if one_image else list(tiles_of(target.mesh)) or [None]


def _read(context: bpy.types.Context, names: Sequence[str], options: Options, outcome: Outcome) -> Scene:
    """The scene with all targets; where some cannot be read, those are refused. Raises InputError if all are."""
    uv = None if options.colours else outcome.charting.layer

    def read(these: Sequence[str], warn: Warn | None = None) -> Scene:
        return extract(
            *(context, context.view_layer, these, uv),
            occluding=options.occluding,
            highs=options.highs,
            tangents=options.settings.needs_tangents,
            normal_maps=options.settings.normal_maps,
            warn=warn,
        )

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
            outcome.refuse(name, refusal)
        else:
            readable.append(name)
    if not readable:
        raise InputError(outcome.complaint(len(names)))
    return read(readable, outcome.notes.append)


def _corner_baker(
    context: bpy.types.Context, scene: Scene, target: Instance, options: Options, progress: Progress
) -> tuple[Baker, Instance]:
    """What bakes a target's face corners, and the target laid out for that (vertex_bake.py). Raises InputError."""
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
