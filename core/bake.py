"""The way through the house: scene → texels → rays → solve → finish, one object at a time."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import count

import numpy as np
from numpy.typing import NDArray

from .base.errors import InputError
from .base.timing import timed
from .charts.udim import part_in_tile, uv_in_tile, within_tile
from .finish.bent_normals import Bent, Space
from .finish.map_finisher import LIGHT, RATIO, BakedMap, Finisher, picture_of, traced_estimators
from .progress import Preview, Progress
from .rays.accumulators import Counts
from .rays.embree import open_device
from .rays.kernel_api import Control
from .rays.map_spec import AO, Axis, Estimator, Falloff
from .rays.occluders import Frame, Occluders
from .rays.tracer import CHUNK_RAYS, Rays, Sums, images_of, trace, trace_texels
from .scene.scene import Camera, Doubles, Floats, Instance, Ints, Placed, Scene, check_target, surface_of, zero_area
from .solve import horizon
from .solve.directional import Coder, Coding
from .solve.solver import MOST_MEAN_RAYS, Goal, Means, Solved, first_rays, solve
from .solve.surface_filter import Field
from .spherical.environment import Environment
from .texels import flipped_faces, interior
from .texels.high_to_low import onto_highs
from .texels.rasterize import Texels, rasterize
from .texels.shading_normals import with_normals
from .texels.tangent_space import Texture, check_tangents

MAX_SIZE = 65536
MAX_RAYS = 1 << 20
MAX_THREADS = 1024
LEAST_ERROR, MOST_ERROR = 1e-5, 0.5
LEAST_SPREAD = 1.0  # degrees: narrower cones are rays
FARTHEST_CAMERA = 1e30  # float32 holds it, whatever the frame's origin

# Seeds of rounds and of probes, so many apart.
_NEXT_SEED, _PROBES, _CODES = 0x9E3779B97F4A7C15, 1 << 20, 1 << 21

# Parts of the time that an object takes, for the progress bar.
_TEXELS, _BUILD, _INSIDE, _TRACE = (0.0, 0.02), (0.02, 0.05), (0.05, 0.06), (0.06, 1.0)


@dataclass(frozen=True)
class Settings:
    """What to bake, checked once here. rays: of every texel and map; error: the RMSE to bake each map to instead, with
    as many rays as that takes. filtered: by the filter that knows the surface; None: where an error is asked for.
    distance: scene units, None for no limit. threads 0: all.
    divide_horizon: maps about the reflected direction become a share of what an open surface would get (horizon.py).
    nearest: scene units; what is nearer blocks nothing. falloff: by which occluders block less up to the distance.
    spread: degrees across the cone about a lobe's axis that its rays stay in. front_only: faces block nothing from
    behind. bent: how bent normals are written, where they are wanted. coding: a directional code, where one is wanted.
    normal_maps: whether targets' normals are turned by their materials' normal maps; those that are baked from others
    have none. lights: which pictures of light are, RATIO, the share that gets through, or LIGHT, the light itself.

    Raises InputError, one line, for a value out of range.
    """

    estimators: tuple[Estimator, ...] = (AO,)
    width: int = 1024
    height: int = 1024
    rays: int = 64
    distance: float | None = None
    margin: int = 16
    threads: int = 0
    seed: int = 0
    divide_horizon: bool = False
    error: float | None = None
    filtered: bool | None = None
    nearest: float = 0.0
    falloff: Falloff = Falloff.NONE
    spread: float = 180.0
    front_only: bool = False
    bent: Bent | None = None
    coding: Coding | None = None
    normal_maps: bool = False
    lights: frozenset[str] = frozenset({RATIO})

    def __post_init__(self) -> None:
        if not self.estimators and self.bent is None and self.coding is None:
            raise InputError("nothing to bake; choose AO, RO or another map")
        names = [estimator.name for estimator in self.estimators]
        if len(set(names)) < len(names):
            raise InputError(f"of the maps {', '.join(names)} two have the same name; ask for each once")
        if not (1 <= self.width <= MAX_SIZE and 1 <= self.height <= MAX_SIZE):
            raise InputError(f"size {self.width}x{self.height}: give 1 to {MAX_SIZE} texels a side")
        if not 1 <= self.rays <= MAX_RAYS:
            raise InputError(f"rays {self.rays}: give 1 to {MAX_RAYS}")
        if self.error is not None and not LEAST_ERROR <= self.error <= MOST_ERROR:
            raise InputError(f"error {self.error:g}: give an RMSE of {LEAST_ERROR:g} to {MOST_ERROR:g}, e.g. 0.004")
        if self.distance is not None and not (math.isfinite(self.distance) and self.distance > 0.0):
            raise InputError(f"distance {self.distance:g}: give a number above 0, or none for no limit")
        if not (math.isfinite(self.nearest) and 0.0 <= self.nearest < self.reach):
            raise InputError(f"minimum distance {self.nearest:g}: give a number from 0 on, and below the distance")
        if self.falloff is not Falloff.NONE and self.distance is None:
            raise InputError(f"falloff {self.falloff.name.lower()}: it needs a distance to fall off over; give one")
        if not LEAST_SPREAD <= self.spread <= 180.0:
            raise InputError(f"spread {self.spread:g}: give {LEAST_SPREAD:g} to 180 degrees")
        if self.spread < 180.0 and (whole := self._of_whole_lobes):
            raise InputError(f"spread {self.spread:g}: {whole} is of whole lobes; leave it out, or give 180 degrees")
        if not 0 <= self.margin <= MAX_SIZE:
            raise InputError(f"margin {self.margin}: give 0 to {MAX_SIZE} texels")
        if not 0 <= self.threads <= MAX_THREADS:
            raise InputError(f"threads {self.threads}: give 1 to {MAX_THREADS}, or 0 for all")

    def names_of(self, estimator: Estimator) -> list[str]:
        """What the pictures of an estimator are called."""
        if not estimator.is_light:
            return [estimator.name]
        return [picture_of(estimator, kind) for kind in (RATIO, LIGHT) if kind in self.lights]

    @property
    def _of_whole_lobes(self) -> str:
        """What is asked for that has no meaning within a cone of directions; empty: nothing."""
        if self.coding is not None:
            return "a directional code"
        if LIGHT in self.lights and any(each.is_light for each in self.estimators):
            return "the light itself (not its share)"
        return "dividing by the horizon" if any(map(self.divides, self.estimators)) else ""

    def divides(self, estimator: Estimator) -> bool:
        """Whether the horizon is divided out of its map."""
        return self.divide_horizon and estimator.axis is Axis.REFLECTED and not estimator.is_light

    @property
    def needs_tangents(self) -> bool:
        """Whether targets must have tangents."""
        return self.coding is not None or (self.bent is not None and self.bent.space is Space.TANGENT)

    @property
    def goal(self) -> Goal:
        """How far to go."""
        return Goal(self.rays, self.error, self.error is not None if self.filtered is None else self.filtered)

    @property
    def reach(self) -> float:
        """The distance as the tracer takes it."""
        return math.inf if self.distance is None else self.distance


@dataclass(eq=False)
class Baked:
    """One baked object. maps by estimator name. rays: those of all its maps. inside: the share of its texels, 0 to 1,
    that lie inside other meshes (interior.py); their values are as traced. overlapped: texels that show one of several
    faces. turned: the share that sees the backs of its own faces alone (flipped_faces.py). seconds by stage. tile: of a
    UDIM layout, None where there is none."""

    name: str
    width: int
    height: int
    texels: int
    rays: int
    maps: dict[str, BakedMap]
    inside: float = 0.0
    overlapped: int = 0
    turned: float = 0.0
    seconds: dict[str, float] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)
    tile: int | None = None


class Baker:
    """Bakes the targets of one scene with one set of settings; occluders are built once where they serve several.

    Raises InputError where a map needs a camera and the scene has none, or where there is no Embree.
    """

    def __init__(self, scene: Scene, settings: Settings, progress: Progress | None = None) -> None:
        if any(each.axis is Axis.REFLECTED for each in settings.estimators):
            _check_camera(scene.camera)
        if any(each.is_light for each in settings.estimators) and scene.environment is None:
            raise InputError("the scene has no World to take light from; add one in World properties, or bake no light")
        self.device = open_device(settings.threads)
        self._scene = scene
        self._settings = settings
        self._progress = progress or Progress()
        self._progress.expect(len(scene.targets))
        self._occluders = Occluders(
            self.device, scene.occluders, settings.reach, _reserved(scene), front_only=settings.front_only
        )
        self._warnings = list(self._occluders.warnings)

    def bake(self, target: Instance, tile: int | None = None) -> Baked:
        """Bake one object, of a UDIM layout one tile. Raises InputError for one that cannot be, Cancelled, MemoryError.

        Same scene and settings, same bits, whatever the number of threads.
        """
        try:
            baked = self._bake(target, tile)
        finally:
            self._progress.preview = None
            self._progress.finish_object()
        baked.warnings[:0] = self._warnings  # those on occluders stand once, with the first object
        self._warnings = []
        return baked

    def _bake(self, target: Instance, tile: int | None) -> Baked:
        settings, progress = self._settings, self._progress
        seconds: dict[str, float] = {}
        warnings = check_target(target)
        if settings.needs_tangents:
            check_tangents(target)
        with timed(seconds, "texels"):
            texels = _texels_of(target, tile, settings, progress)
        with timed(seconds, "build"):
            progress.enter(f"{target.name}: building the scene", _BUILD)
            frame = self._occluders.frame_for(target, progress)
            surface = _in_tile(surface_of(target, frame.origin), tile)
        texture = Texture(target, texels.owner, tile)
        if target.name in self._scene.highs:
            with timed(seconds, "texels"):
                surface, texels = self._onto_highs(target, surface, texels, frame)
        with timed(seconds, "inside"):
            share = self._share_inside(target, surface, texels, frame)
            backs = self._share_turned(target, surface, texels, frame)
        if settings.normal_maps and target.normal_map is not None and target.name not in self._scene.highs:
            with timed(seconds, "texels"):
                progress.enter(f"{target.name}: laying its normal maps over it", _INSIDE)
                laid = (target.normal_map, texture, surface, texels.owner)
                surface = with_normals(*laid, threads=settings.threads, check=progress.raise_if_cancelled)
        camera = self._scene.camera and self._scene.camera.about(frame.origin)
        shown = target if tile is None else part_in_tile(target, tile)
        traced_maps = traced_estimators(settings.estimators, settings.bent)
        bench = _Bench(shown, frame, surface, texels, camera, settings, progress, traced_maps, self._scene.environment)
        solved = bench.solve(seconds)
        with timed(seconds, "finish"):
            progress.raise_if_cancelled()
            finisher = Finisher(
                *(surface, texels.owner, texture, texels.coverage, settings.margin, camera),
                *(self._scene.environment, settings.bent, settings.threads),
            )
            maps: dict[str, BakedMap] = {}
            wanted = {name for one in settings.estimators for name in settings.names_of(one)}
            for estimator, each in zip(traced_maps, solved, strict=True):
                maps.update(finisher.maps(estimator, each, wanted))
        traced = sum(each.rays for each in solved)
        if settings.coding is not None:
            with timed(seconds, "code"):
                coder = Coder(frame.scene, surface, texels.owner, texture, bench.rays(1, _CODES))
                code = maps[settings.coding.code.name] = self._coded(coder, settings.coding, finisher, bench)
                traced += code.rays
        warnings += [
            *texels.warnings,
            *interior.warning(target.name, share),
            *flipped_faces.warning(target.name, backs),
        ]
        if AO.name in maps and share < interior.TOLD and backs < interior.TOLD:
            warnings += flipped_faces.dark_warning(target.name, maps[AO.name].mean)
        warnings += _shortfalls(target, settings, traced_maps, solved)
        what = (target.name, settings.width, settings.height, texels.count, traced, maps)
        return Baked(*what, share, texels.overlapped, backs, seconds, warnings, tile)

    def _coded(self, coder: Coder, coding: Coding, finisher: Finisher, bench: _Bench) -> BakedMap:
        values = np.zeros((*coder.owner.shape, coding.code.count), dtype=np.float32)
        flat = values.reshape(-1, coding.code.count)
        for these, codes in coder.values(coding, bench.enter_code):
            flat[these] = codes
        error = coder.error(values, coding, self._settings.seed)
        covered = coder.owner >= 0
        rays = coding.rays * int(np.count_nonzero(covered))
        return finisher.finished(values, covered, error, rays, mixes=coding.code.kind != "mask")

    def _onto_highs(self, target: Instance, surface: Placed, texels: Texels, frame: Frame) -> tuple[Placed, Texels]:
        control = self._progress.enter(f"{target.name}: looking for high meshes", _INSIDE)
        what = (target, self._scene.highs[target.name], surface, texels, frame.origin, self.device)
        return onto_highs(*what, threads=self._settings.threads, control=control)

    def _share_turned(self, target: Instance, surface: Placed, texels: Texels, frame: Frame) -> float:
        own = self._occluders.number_of(target, frame)
        control = self._progress.enter(f"{target.name}: looking for faces that are turned", _INSIDE)
        return flipped_faces.share_turned(
            frame.scene, surface, texels.owner, own, threads=self._settings.threads, control=control
        )

    def _share_inside(self, target: Instance, surface: Placed, texels: Texels, frame: Frame) -> float:
        own = self._occluders.number_of(target, frame)
        if target.name in self._scene.highs:  # of one high mesh the faces are as its own; several may well overlap
            (first, *more) = self._scene.highs[target.name].meshes
            own = -1 if more else self._occluders.number_of(first, frame)
            if own < 0:
                return 0.0
        if not frame.holds_others(own):
            return 0.0
        control = self._progress.enter(f"{target.name}: looking for meshes around it", _INSIDE)
        threads = self._settings.threads
        return interior.share_inside(frame.scene, surface, texels.owner, own, threads=threads, control=control)


def _reserved(scene: Scene) -> dict[str, set[str]]:
    """Objects that block light for some targets alone, and those targets."""
    reserved: dict[str, set[str]] = {}
    for target in () if scene.shared else scene.targets:
        highs = scene.highs.get(target.name)
        for owner in [target] if highs is None else highs.meshes:
            reserved.setdefault(owner.belongs_to, set()).add(target.name)
    return reserved


def bake(scene: Scene, settings: Settings, progress: Progress | None = None) -> Iterator[Baked]:
    """Bake the scene's targets one after the other; each result can be written and forgotten before the next.

    Raises as `Baker` and its `bake`.
    """
    baker = Baker(scene, settings, progress)
    yield from map(baker.bake, scene.targets)


class _Bench:
    """What it takes to solve the maps of one target: rays from its texels, their horizon, the filter's field."""

    def __init__(
        self,
        target: Instance,
        frame: Frame,
        surface: Placed,
        texels: Texels,
        camera: Camera | None,
        settings: Settings,
        progress: Progress,
        estimators: Sequence[Estimator],
        environment: Environment | None,
    ) -> None:
        self._estimators, self._environment = estimators, environment
        self._target, self._frame, self._surface, self._owner = target, frame, surface, texels.owner
        # More triangles than texels: the rays of neighbouring texels mostly meet different ones (docs/figures.md).
        self._coherent = frame.triangles <= texels.count
        self._camera, self._settings, self._progress = camera, settings, progress
        # Where in the bar the next stage begins, and where the code does, which takes as long as maps may.
        self._left, self._end = _TRACE
        if settings.coding is not None:
            self._end = 0.5 * (self._left + self._end) if estimators else self._left

    def solve(self, seconds: dict[str, float]) -> list[Solved]:
        """All maps. Their first round is traced together."""
        goal, estimators = self._settings.goal, self._estimators
        if not estimators:
            return []
        with timed(seconds, "trace"):
            into = np.zeros((images_of(estimators), *self._owner.shape), dtype=np.float32)
            if estimators[0].counts is not Counts.LIGHT:  # whose sums are no share of the rays
                self._preview(into[0], first_rays(goal))
            sums = self._trace(self._owner, estimators, first_rays(goal), 0, halves=not goal.plain, into=into)
            self._progress.preview = None  # it holds the sums
            del into
        openings = _openings(sums, estimators, first_rays(goal))
        del sums  # as large as the image: `solve` lets go of them once it has read them
        solved = []
        with timed(seconds, "solve"):
            for estimator in estimators:
                means = self._means(estimator, seconds)
                seed = self._settings.seed
                solved.append(solve(openings.pop(0), self._owner, goal, estimator.exponent, seed, means))
        return solved

    def _means(self, estimator: Estimator, seconds: dict[str, float]) -> Means:
        rounds, draws = count(1), count(_PROBES)

        def trace_round(owner: Ints, rays: int) -> tuple[Floats, Floats]:
            with _moved(seconds, "solve", "trace"):
                sums = self._trace(owner, (estimator,), rays, next(rounds), halves=True)
            assert sums.first_half is not None
            return estimator.counts.totals(sums.all, rays), estimator.counts.totals(sums.first_half, rays // 2)

        def probe(texels: NDArray[np.int64], rays: int) -> Floats:
            with _moved(seconds, "solve", "probe"):
                how = self.rays(rays, next(draws))
                listed = trace_texels(
                    *(self._frame.scene, self._surface, self._owner, texels, (estimator,), how),
                    control=self._progress.control,
                )
            if self._settings.divides(estimator):
                horizon.divide(listed[0], self._openness(estimator, texels))
            return listed

        return Means(trace_round, probe, estimator.counts, lambda: self._field, self.enter, self._show)

    def _show(self, values: Floats) -> None:
        """A map as it is after a round."""
        self._progress.preview = Preview(self._target, lambda: values)

    def _preview(self, sums: Floats, rays: int) -> None:
        """The first map as it fills in, until its texels have had their first chunk of rays."""
        first, control = min(rays, CHUNK_RAYS), self._progress.control

        def values() -> Floats | None:
            full = control.total > 0 and control.done * rays > control.total * first
            if full:
                return None
            seen: Floats = np.minimum(sums / np.float32(first), np.float32(1.0))
            seen[seen <= 0.0] = -1.0  # what is wholly closed is taken for not traced yet
            return seen

        self._progress.preview = Preview(self._target, values)

    def _trace(
        self,
        owner: Ints,
        estimators: Sequence[Estimator],
        rays: int,
        number: int,
        *,
        halves: bool,
        into: Floats | None = None,
    ) -> Sums:
        control = self.enter("tracing", rays=True)
        what = (self._frame.scene, self._surface, owner, estimators, self.rays(rays, number))
        sums = trace(*what, halves=halves, into=into, control=control)
        index = 0
        for estimator in estimators:
            if self._settings.divides(estimator):
                openness = self._openness(estimator)
                for images in (sums.all, sums.first_half):
                    if images is not None:
                        horizon.divide(images[index], openness)
            index += estimator.counts.images
        return sums

    def rays(self, rays: int, number: int) -> Rays:
        """Each round's rays, and each draw of the probes', by a seed of its own; the first round's by the bake's."""
        settings = self._settings
        seed = settings.seed + number * _NEXT_SEED
        return Rays(
            *(rays, seed, settings.reach, settings.threads),
            camera=self._camera,
            coherent=self._coherent,
            nearest=settings.nearest,
            falloff=settings.falloff,
            spread=settings.spread,
            light=self._environment,
        )

    def _openness(self, estimator: Estimator, texels: NDArray[np.int64] | None = None) -> Doubles:
        """Of all texels, (H, W), or of those listed."""
        cosines = self._cosines if texels is None else self._cosines.reshape(-1)[texels]
        return horizon.open_horizon(estimator.exponent, cosines)

    @cached_property
    def _cosines(self) -> Doubles:
        assert self._camera is not None
        settings = self._settings
        return horizon.cosines_to_reflected(self._surface, self._owner, self._camera, threads=settings.threads)

    @cached_property
    def _field(self) -> Field:
        control = self.enter("finding neighbours")
        return Field(self._surface, self._owner, threads=self._settings.threads, control=control)

    def enter(self, stage: str, *, rays: bool = False) -> Control:
        """The next stage. How many there will be nobody knows: each gets half of what is left of the bar, a bake of a
        given number of rays all of it."""
        start, end = self._left, self._end
        if not self._settings.goal.plain:
            end = 0.5 * (start + end)
        self._left = end
        return self._progress.enter(f"{self._target.name}: {stage}", (start, end), rays=rays)

    def enter_code(self, before: float, after: float) -> Control:
        """The stage of the directional code, from one share of it to another."""
        start, end = (self._end + share * (_TRACE[1] - self._end) for share in (before, after))
        return self._progress.enter(f"{self._target.name}: tracing the directional code", (start, end), rays=True)


def _openings(sums: Sums, estimators: Sequence[Estimator], rays: int) -> list[tuple[Floats, Floats | None]]:
    """What each map is solved from: its rows times the rays, of all of them and of the first half."""
    openings: list[tuple[Floats, Floats | None]] = []
    first = 0
    for each in estimators:
        images = slice(first, first + each.counts.images)
        half = None if sums.first_half is None else each.counts.totals(sums.first_half[images], rays // 2)
        openings.append((each.counts.totals(sums.all[images], rays), half))
        first = images.stop
    return openings


def _shortfalls(
    target: Instance, settings: Settings, estimators: Sequence[Estimator], solved: Sequence[Solved]
) -> list[str]:
    """A line for each map that did not get to the error asked for: it would have taken too many rays."""
    return [
        f"{target.name}: {estimator.name} has an error of {each.error.rmse:.4f}, and {settings.error:.4f} was asked "
        f"for; it would take over {MOST_MEAN_RAYS} rays a texel: ask for less, or bake fine detail into a larger image"
        for estimator, each in zip(estimators, solved, strict=True)
        if not each.met
    ]


def _texels_of(target: Instance, tile: int | None, settings: Settings, progress: Progress) -> Texels:
    mesh = target.mesh
    if mesh.uv is None:
        raise InputError(f"{target.name}: the mesh has no UV map; unwrap it, or bake with chart UVs (--uv charts)")
    control = progress.enter(f"{target.name}: texels", _TEXELS)
    uv, skip = mesh.uv, zero_area(mesh)
    if tile is not None:
        uv, skip = uv_in_tile(uv, tile), skip | ~within_tile(mesh, tile)
    size = (settings.width, settings.height)
    return rasterize(target.name, uv, *size, skip=skip, threads=settings.threads, control=control)


def _in_tile(surface: Placed, tile: int | None) -> Placed:
    if tile is None or surface.uv is None:
        return surface
    return replace(surface, uv=uv_in_tile(surface.uv, tile))


def _check_camera(camera: Camera | None) -> None:
    cure = "or bake RO with direction normal"
    if camera is None:
        raise InputError(f"the scene has no camera to take R from; add one, {cure}")
    numbers = np.abs([*camera.position, *camera.forward])
    if not (numbers < FARTHEST_CAMERA).all():
        raise InputError(f"the scene's camera: its transform is not finite, or too far away; clear it, {cure}")


@contextmanager
def _moved(seconds: dict[str, float], outer: str, stage: str) -> Iterator[None]:
    """Time that belongs to `stage` though it passes within `outer`."""
    before = seconds.get(stage, 0.0)
    with timed(seconds, stage):
        yield
    seconds[outer] = seconds.get(outer, 0.0) - (seconds[stage] - before)
