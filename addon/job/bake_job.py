"""One bake from Blender: who is baked, charts where they are needed, the scene, the maps."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import bpy

from ...core.bake import Baker
from ...core.base.errors import InputError
from ...core.charts.udim import Udim, UvTiles, tiles_of
from ...core.finish.atlas import Atlas, atlas_inputs
from ...core.finish.baked import Baked
from ...core.progress import Progress
from ...core.scene.scene import Instance, Scene
from ...core.settings import Settings
from ...core.texels.vertex_bake import check_corners, corner_image, with_corner_cells
from ..charts.chart_job import chart_steps
from ..charts.chart_request import ChartRequest
from ..output.color_attributes import check_colours
from ..output.result import Result, Texture
from ..read.blender_state import synced
from ..read.block_ref import BlockRef, find
from ..read.high_low_pairs import HighMeshes
from ..read.occluder_filter import EVERYTHING, OccluderFilter
from ..read.rendered_maps import refused_without_faces
from ..read.scene_reader import SceneRequest, read_scene
from ..read.world_reader import read_world
from ..typed import scene_in, view_layer_in
from .job_clock import REST
from .outcome import BAKING, DONE, REFUSED, WAITING, Outcome
from .runner import Steps


@dataclass(frozen=True)
class Layout:
    """How maps are laid out. atlas: the name of one image for all objects; empty: each has its own. udim: what UVs
    beyond the unit square are. corners: the corners of the faces are baked, no texels; size, margin and filter do not
    matter then, nor do UVs."""

    atlas: str = ""
    udim: Udim = Udim.AUTO
    corners: bool = False


OWN_IMAGES = Layout()


@dataclass(frozen=True)
class BakeJob:
    """What to bake: objects. uv: a UV map's name, CHARTS or SMART, or None for the active one, charts where none
    is. occluding: who blocks light. highs: what objects are baked from, where it is not their own surface. smart: those
    that Blender unwraps where we would, and could not."""

    objects: tuple[BlockRef, ...]
    settings: Settings
    uv: str | None = None
    occluding: OccluderFilter = EVERYTHING
    highs: Mapping[BlockRef, HighMeshes] = field(default_factory=dict)
    layout: Layout = OWN_IMAGES
    smart: frozenset[BlockRef] = frozenset()


Deliver = Callable[[Result], None]
Unchanged = Callable[[Texture], bool]  # whether its objects have it as it would be baked now


def bake_steps(
    context: bpy.types.Context,
    job: BakeJob,
    progress: Progress,
    outcome: Outcome,
    deliver: Deliver,
    unchanged: Unchanged | None = None,
) -> Steps:
    """The whole bake, for a `Runner`. `deliver` gets each result on the main thread as soon as it is there. unchanged:
    is asked on the main thread; objects of which it is true are left as they are.

    An object that cannot be baked or delivered is refused with a line, and the others go on. Raises Cancelled, and
    InputError where all are refused and for what concerns them all.
    """
    with outcome.clock.stage(REST):
        targets = yield from scene_steps(context, job, progress, outcome)
        yield from _bake_all(targets, job, progress, outcome, deliver, unchanged)
    outcome.complete = True
    if not outcome.finished:
        raise InputError(outcome.complaint(len(job.objects)))


Targets = Mapping[BlockRef, Instance]


def scene_steps(
    context: bpy.types.Context, job: BakeJob, progress: Progress, outcome: Outcome
) -> Generator[Callable[[], Any], Any, Targets]:
    """A bake up to where it could begin: charts are made, the scene is read, the outcome has its baker. Returns the
    targets that are not refused, in the job's order. Raises as `bake_steps`."""
    outcome.states.update(dict.fromkeys(job.objects, WAITING))
    refs: Sequence[BlockRef] = job.objects
    if not job.layout.corners:
        refs = yield from prepared_charts(context, job, progress, outcome, then=len(job.objects))
    progress.enter("reading the scene")
    with outcome.clock.stage("extract"):
        refs, scene = _read(context, refs, job, outcome)
        _refuse_without_faces(context, refs, scene, outcome)
        if job.settings.needs_light:
            scene = replace(scene, environment=read_world(scene_in(context)))
        if job.layout.corners:
            scene = _by_corners(context, refs, scene, job, outcome)
    outcome.baker = Baker(scene, _settings(job), progress)
    return {ref: each for ref, each in zip(refs, scene.targets, strict=True) if outcome.states[ref] != REFUSED}


def _settings(job: BakeJob) -> Settings:
    """The margin of an atlas is filled once, when all objects are in it; corners have neither margin nor filter."""
    settings = job.settings
    if job.layout.corners:
        settings = replace(settings, goal=replace(settings.goal, filtered=False))
    if job.layout.corners or job.layout.atlas:
        settings = replace(settings, image=replace(settings.image, margin=0))
    return settings


def _bake_all(
    given: Targets, job: BakeJob, progress: Progress, outcome: Outcome, deliver: Deliver, unchanged: Unchanged | None
) -> Steps:
    """One target after the other, each delivered, or all in an atlas; less what has not changed."""
    tiles = {ref: uv_tiles(target, job) for ref, target in given.items()}
    if unchanged is not None:
        progress.enter("looking at what has changed")
        textures: list[Texture] = yield partial(_textures, given, tiles, job, progress, outcome)
        given = {ref: given[ref] for ref in _not_left(textures, progress, outcome, unchanged)}
    progress.expect(sum(len(tiles[ref].numbers) or 1 for ref in given))
    if job.layout.atlas:
        yield from _bake_atlas(given, job, outcome, deliver)
        return
    for ref, target in given.items():
        outcome.states[ref] = BAKING
        try:
            yield from _bake_one(ref, target, tiles[ref], job, outcome, deliver)
        except InputError as refusal:
            outcome.refuse(ref, refusal)
        else:
            outcome.finish(ref)


def _bake_atlas(given: Targets, job: BakeJob, outcome: Outcome, deliver: Deliver) -> Steps:
    """One target after the other into the atlas, which is delivered at the end."""
    name = job.layout.atlas
    atlas, in_atlas = Atlas(name), dict[BlockRef, Instance]()
    for ref, target in given.items():
        outcome.states[ref] = BAKING
        try:
            yield from _bake_one(ref, target, UvTiles(), job, outcome, lambda result: atlas.add(result.baked))
        except InputError as refusal:
            outcome.refuse(ref, refusal)
        else:
            in_atlas[ref] = target
            outcome.states[ref] = DONE
    if in_atlas:
        whole: Baked = yield partial(atlas.finish, job.settings.image.margin)
        deliver(Result(name, tuple(in_atlas), tuple(in_atlas.values()), whole, atlas=name, inputs=(whole.inputs,)))
        for ref in in_atlas:
            if outcome.states[ref] != REFUSED:
                outcome.finish(ref)


def _textures(
    given: Targets, tiles: Mapping[BlockRef, UvTiles], job: BakeJob, progress: Progress, outcome: Outcome
) -> list[Texture]:
    """What would be baked of these targets."""
    assert outcome.baker is not None
    made = []
    for ref, target in given.items():
        progress.raise_if_cancelled()
        numbers = tiles[ref].numbers
        inputs = tuple(outcome.baker.inputs_of(target, tile) for tile in numbers or (None,))
        made.append(Texture(ref.label, (ref,), (target,), inputs, numbers))
    if not job.layout.atlas or not made:
        return made
    name, parts = job.layout.atlas, [part for each in made for part in each.inputs]
    return [
        Texture(
            name, tuple(given), tuple(given.values()), (atlas_inputs(parts, job.settings.image.margin),), atlas=name
        )
    ]


def _not_left(
    textures: Sequence[Texture], progress: Progress, outcome: Outcome, unchanged: Unchanged
) -> list[BlockRef]:
    """The objects that are to be baked; the outcome has the others."""
    changed: list[BlockRef] = []
    for texture in textures:
        progress.raise_if_cancelled()
        if not unchanged(texture):
            changed += texture.objects
            continue
        for ref in texture.objects:
            outcome.leave(ref)
    return changed


def prepared_charts(
    context: bpy.types.Context, job: BakeJob, progress: Progress, outcome: Outcome, then: int = 0
) -> Generator[Callable[[], Any], Any, list[BlockRef]]:
    """`chart_steps` for these options, what it has to say in the outcome. Returns the objects to go on with. Raises as
    that, and InputError where none is left."""
    charting, layout = outcome.charting, job.layout
    charting.request = ChartRequest(job.uv, layout.atlas, size=job.settings.image.size, udim=layout.udim)
    charting.smart, charting.clock = job.smart, outcome.clock
    yield from chart_steps(context, job.objects, charting, progress, then)
    for ref, refusal in charting.refused.items():
        outcome.refuse(ref, refusal)
    outcome.notes += charting.notes
    refs = [ref for ref in job.objects if ref not in charting.refused]
    if not refs:
        raise InputError(outcome.complaint(len(job.objects)))
    return refs


def _bake_one(ref: BlockRef, target: Instance, tiles: UvTiles, job: BakeJob, outcome: Outcome, take: Deliver) -> Steps:
    """take: gets the result, of a UDIM layout that of each tile before the next is baked."""
    assert outcome.baker is not None
    size = corner_image(len(target.mesh.triangles)) if job.layout.corners else None
    told: set[str] = set()
    inputs: list[str] = []
    for tile in tiles.numbers or (None,):
        baked: Baked = yield partial(outcome.baker.bake, target, tile, size)
        inputs.append(baked.inputs)
        result = Result(ref.label, (ref,), (target,), baked, tiles.numbers, inputs=tuple(inputs))
        if result.is_first:
            baked.warnings += tiles.warnings(target.name)
            _share_times(outcome, baked, alone=len(outcome.baker.scene.targets) == 1)
        baked.warnings = [line for line in baked.warnings if line not in told]  # those on the mesh are of each tile
        told.update(baked.warnings)
        take(result)
        del baked, result  # or it would be held while the next is baked


def _refuse_without_faces(context: bpy.types.Context, refs: Sequence[BlockRef], scene: Scene, outcome: Outcome) -> None:
    """Before others have been baked, and with the modifier that is to blame."""
    objects = synced(view_layer_in(context))
    bare = [ref for ref, target in zip(refs, scene.targets, strict=True) if not len(target.mesh.triangles)]
    found = {ref: obj for ref in bare if (obj := find(objects, ref)) is not None}
    for ref, refusal in refused_without_faces(context, found).items():
        outcome.refuse(ref, refusal)


def _by_corners(
    context: bpy.types.Context, refs: Sequence[BlockRef], scene: Scene, job: BakeJob, outcome: Outcome
) -> Scene:
    """The scene laid out for colours; targets that can have none are refused. Raises InputError where none is left."""
    objects, names = synced(view_layer_in(context)), [each.name for each in job.settings.maps]
    taken: dict[int, BlockRef] = {}  # by mesh: its colours are one, and the last of several objects would have them
    for ref, target in zip(refs, scene.targets, strict=True):
        if outcome.states[ref] == REFUSED:
            continue
        obj: Any = find(objects, ref)  # it has just been read
        try:
            check_corners(target)
            check_colours(obj, target, names)
            if (other := taken.setdefault(obj.data.session_uid, ref)) != ref:
                raise InputError(
                    f"{ref.label}: it shares its mesh, and with it the colors, with {other.label}; make it a single "
                    "user (Object > Relations > Make Single User > Object & Data)"
                )
        except InputError as refusal:
            outcome.refuse(ref, refusal)
    if not taken:
        raise InputError(outcome.complaint(len(job.objects)))
    return with_corner_cells(scene)


def uv_tiles(target: Instance, job: BakeJob) -> UvTiles:
    """Of a UDIM layout; none where the unit square alone is baked."""
    one_image = job.layout.corners or job.layout.atlas
    return UvTiles() if one_image else tiles_of(target.mesh, job.layout.udim)


def _read(
    context: bpy.types.Context, refs: Sequence[BlockRef], job: BakeJob, outcome: Outcome
) -> tuple[Sequence[BlockRef], Scene]:
    """The scene with all targets, and which these are; those that cannot be read are refused. Raises InputError if all
    are."""

    def read(these: Sequence[BlockRef]) -> tuple[Scene, list[str]]:
        request = SceneRequest(
            these,
            outcome.charting.maps,
            job.occluding,
            job.highs,
            tangents=job.settings.needs_tangents,
            normal_maps=job.settings.normal_maps,
        )
        return read_scene(context, view_layer_in(context), request)

    try:
        scene, lines = read(refs)
    except InputError:
        if len(refs) == 1:
            raise
        refs = _readable(refs, read, outcome)
        scene, lines = read(refs)
    outcome.notes += lines
    return refs, scene


def _readable(refs: Sequence[BlockRef], read: Callable[[Sequence[BlockRef]], Any], outcome: Outcome) -> list[BlockRef]:
    """Those that can be read alone; the others are refused. Raises InputError where none is left."""
    readable = []
    for ref in refs:
        try:
            read((ref,))
        except InputError as refusal:
            outcome.refuse(ref, refusal)
        else:
            readable.append(ref)
    if not readable:
        raise InputError(outcome.complaint(len(refs)))
    return readable


def _share_times(outcome: Outcome, baked: Baked, *, alone: bool) -> None:
    """Charts belong to their object; reading the scene does too where there is only one."""
    baked.seconds["charts"] = outcome.clock.hand_over(f"charts of {baked.name}")
    if alone:
        baked.seconds["extract"] = outcome.clock.hand_over("extract")


def meshes_in_render(view_layer: bpy.types.ViewLayer) -> list[bpy.types.Object]:
    """The view layer's mesh objects that render, in the Outliner's order; those without faces are left out."""
    collections = _shown_collections(view_layer.layer_collection)
    shown = {obj.session_uid for collection in collections for obj in collection.objects}
    return [
        obj
        for obj in synced(view_layer)
        if obj.type == "MESH"
        and _renders_itself(obj)
        and obj.session_uid in shown
        and (len(obj.data.polygons) or len(obj.modifiers))  # modifiers may make the faces
    ]


def _renders_itself(obj: bpy.types.Object) -> bool:
    instances = obj.is_instancer or len(obj.particle_systems) > 0
    return not obj.hide_render and (obj.show_instancer_for_render or not instances)


def _shown_collections(layer: Any) -> Iterator[bpy.types.Collection]:
    if layer.exclude or layer.collection.hide_render:
        return
    yield layer.collection
    for child in layer.children:
        yield from _shown_collections(child)
