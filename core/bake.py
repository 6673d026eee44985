"""The way through the house: scene → texels → rays → solve → finish, one object at a time."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from . import horizon, inside
from .embree import open_device
from .errors import InputError
from .estimators import AO, Axis, Estimator
from .finish import fill_margin
from .occluders import Frame, Occluders
from .progress import Progress
from .scene import Camera, Floats, Instance, Placed, Scene, check_target, surface_of, zero_area
from .solve import solve
from .texels import Texels, rasterize
from .tracer import Rays, Sums, trace

MAX_SIZE = 65536
MAX_RAYS = 1 << 20
MAX_THREADS = 1024
FARTHEST_CAMERA = 1e30  # float32 holds it, whatever the frame's origin

# Parts of the time that an object takes, for the progress bar.
_TEXELS, _BUILD, _INSIDE, _TRACE = (0.0, 0.02), (0.02, 0.05), (0.05, 0.06), (0.06, 1.0)


@dataclass(frozen=True)
class Settings:
    """What to bake, checked once here. distance: scene units, None for no limit. threads 0: all.
    divide_horizon: maps about the reflected direction become a share of what an open surface would get (horizon.py).

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

    def __post_init__(self) -> None:
        if not self.estimators:
            raise InputError("nothing to bake; choose AO, RO or both")
        names = [estimator.name for estimator in self.estimators]
        if len(set(names)) < len(names):
            raise InputError(f"of the maps {', '.join(names)} two have the same name; ask for each once")
        if not (1 <= self.width <= MAX_SIZE and 1 <= self.height <= MAX_SIZE):
            raise InputError(f"size {self.width}x{self.height}: give 1 to {MAX_SIZE} texels a side")
        if not 1 <= self.rays <= MAX_RAYS:
            raise InputError(f"rays {self.rays}: give 1 to {MAX_RAYS}")
        if self.distance is not None and not (math.isfinite(self.distance) and self.distance > 0.0):
            raise InputError(f"distance {self.distance:g}: give a number above 0, or none for no limit")
        if not 0 <= self.margin <= MAX_SIZE:
            raise InputError(f"margin {self.margin}: give 0 to {MAX_SIZE} texels")
        if not 0 <= self.threads <= MAX_THREADS:
            raise InputError(f"threads {self.threads}: give 1 to {MAX_THREADS}, or 0 for all")

    @property
    def reach(self) -> float:
        """The distance as the tracer takes it."""
        return math.inf if self.distance is None else self.distance


@dataclass(frozen=True, eq=False)
class BakedMap:
    """One finished image. values: (H, W) float32 with margins; covered: (H, W) bool; coverage: (H, W) float32, 0 in
    margins; error: estimated RMSE over the covered texels; mean: their mean. Values are 0 to 1, but for noise above 1
    where the horizon was divided out."""

    values: Floats
    covered: NDArray[np.bool_]
    coverage: Floats
    error: float
    mean: float


@dataclass(eq=False)
class Baked:
    """One baked object. maps by estimator name. rays: all that were traced. inside: the share of its texels, 0 to 1,
    that lie inside other meshes (inside.py); their values are as traced. seconds by stage."""

    name: str
    width: int
    height: int
    texels: int
    rays: int
    maps: dict[str, BakedMap]
    inside: float = 0.0
    seconds: dict[str, float] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)


class Baker:
    """Bakes the targets of one scene with one set of settings; occluders are built once where they serve several.

    Raises InputError where a map needs a camera and the scene has none, or where there is no Embree.
    """

    def __init__(self, scene: Scene, settings: Settings, progress: Progress | None = None) -> None:
        if any(each.axis is Axis.REFLECTED for each in settings.estimators):
            _check_camera(scene.camera)
        self.device = open_device(settings.threads)
        self._scene = scene
        self._settings = settings
        self._progress = progress or Progress()
        self._progress.expect(len(scene.targets))
        self._occluders = Occluders(self.device, scene.occluders, settings.reach)
        self._warnings = list(self._occluders.warnings)

    def bake(self, target: Instance) -> Baked:
        """Bake one object. Raises InputError for one that cannot be, Cancelled, MemoryError.

        Same scene and settings, same bits, whatever the number of threads.
        """
        try:
            baked = self._bake(target)
        finally:
            self._progress.finish_object()
        baked.warnings[:0] = self._warnings  # those on occluders stand once, with the first object
        self._warnings = []
        return baked

    def _bake(self, target: Instance) -> Baked:
        settings, progress = self._settings, self._progress
        seconds: dict[str, float] = {}
        warnings = check_target(target)
        with _timed(seconds, "texels"):
            texels = _texels_of(target, settings, progress)
        with _timed(seconds, "build"):
            progress.enter(f"{target.name}: building the scene", _BUILD)
            frame = self._occluders.frame_for(target, progress)
            surface = surface_of(target, frame.origin)
        with _timed(seconds, "inside"):
            share = self._share_inside(target, surface, texels, frame)
        camera = self._scene.camera and self._scene.camera.about(frame.origin)
        with _timed(seconds, "trace"):
            control = progress.enter(f"{target.name}: tracing", _TRACE)
            rays = Rays(settings.rays, settings.seed, settings.reach, settings.threads, camera=camera)
            sums = trace(frame.scene, surface, texels.owner, settings.estimators, rays, control=control)
        with _timed(seconds, "solve"):
            if settings.divide_horizon and camera is not None:
                _divide_by_horizon(sums, surface, texels, camera, settings)
            maps = {
                estimator.name: _finished(sums, index, texels, settings, progress)
                for index, estimator in enumerate(settings.estimators)
            }
        traced = texels.count * settings.rays * len(settings.estimators)
        warnings += [*texels.warnings, *inside.warning(target.name, share)]
        return Baked(target.name, settings.width, settings.height, texels.count, traced, maps, share, seconds, warnings)

    def _share_inside(self, target: Instance, surface: Placed, texels: Texels, frame: Frame) -> float:
        own = self._occluders.number_of(target, frame)
        if not frame.holds_others(own):
            return 0.0
        control = self._progress.enter(f"{target.name}: looking for meshes around it", _INSIDE)
        threads = self._settings.threads
        return inside.share_inside(frame.scene, surface, texels.owner, own, threads=threads, control=control)


def bake(scene: Scene, settings: Settings, progress: Progress | None = None) -> Iterator[Baked]:
    """Bake the scene's targets one after the other; each result can be written and forgotten before the next.

    Raises as `Baker` and its `bake`.
    """
    baker = Baker(scene, settings, progress)
    yield from map(baker.bake, scene.targets)


def _finished(sums: Sums, index: int, texels: Texels, settings: Settings, progress: Progress) -> BakedMap:
    progress.raise_if_cancelled()
    solved = solve(sums, index, settings.rays, texels.covered)
    values = fill_margin(solved.values, solved.covered, settings.margin)
    coverage = np.where(solved.covered, texels.coverage, np.float32(0.0))
    return BakedMap(values, solved.covered, coverage, solved.error, solved.mean)


def _divide_by_horizon(sums: Sums, surface: Placed, texels: Texels, camera: Camera, settings: Settings) -> None:
    cosines = horizon.cosines_to_reflected(surface, texels.owner, camera, threads=settings.threads)
    for index, estimator in enumerate(settings.estimators):
        if estimator.axis is Axis.REFLECTED:
            horizon.divide(sums, index, horizon.open_horizon(estimator.exponent, cosines))


def _texels_of(target: Instance, settings: Settings, progress: Progress) -> Texels:
    mesh = target.mesh
    if mesh.uv is None:
        raise InputError(f"{target.name}: the mesh has no UV map; unwrap it, or bake with chart UVs (--uv charts)")
    control = progress.enter(f"{target.name}: texels", _TEXELS)
    size = (settings.width, settings.height)
    return rasterize(target.name, mesh.uv, *size, skip=zero_area(mesh), threads=settings.threads, control=control)


def _check_camera(camera: Camera | None) -> None:
    cure = "or bake RO with direction normal"
    if camera is None:
        raise InputError(f"the scene has no camera to take R from; add one, {cure}")
    numbers = np.abs([*camera.position, *camera.forward])
    if not (numbers < FARTHEST_CAMERA).all():
        raise InputError(f"the scene's camera: its transform is not finite, or too far away; clear it, {cure}")


@contextmanager
def _timed(seconds: dict[str, float], stage: str) -> Iterator[None]:
    start = time.perf_counter()
    yield
    seconds[stage] = seconds.get(stage, 0.0) + time.perf_counter() - start
