"""The way through the house: scene → texels → rays → solve → finish, one object at a time.

Reading it from top to bottom tells the whole way; each line goes to the room that knows how.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from .base.errors import InputError
from .base.timing import Stopwatch
from .charts.udim import in_tile, outside_tile, part_in_tile
from .finish.baked import Baked, BakedMap, SurfaceReport
from .finish.map_finisher import MapFinisher
from .map_tracer import MapTracer
from .maps.occlusion import ambient_among
from .progress import Progress, Stages
from .rays.embree import open_device
from .rays.map_spec import Axis, MapSpec
from .rays.occluders import Occluders, TraceFrame
from .rays.texel_surface import TexelSurface
from .rays.tracer import TraceOptions
from .scene.checks import check_target, zero_area
from .scene.scene import Camera, Instance, Scene
from .scene.world_mesh import world_surface
from .settings import Settings
from .solve.solver import MOST_MEAN_RAYS, Goal, Solved
from .texels import flipped_faces, interior
from .texels.flipped_faces import Sight
from .texels.high_to_low import onto_high_poly
from .texels.rasterize import Texels, rasterize
from .texels.shading_normals import with_shading_normals
from .texels.tangent_space import TexelFrames, check_tangents

__all__ = ["Baked", "Baker", "Goal", "Settings", "bake"]

FARTHEST_CAMERA = 1e30  # float32 holds it, whatever the frame's origin

# Parts of the time that an object takes, for the progress bar.
_TEXELS, _BUILD, _LOOK, _TRACE = (0.0, 0.02), (0.02, 0.05), (0.05, 0.06), (0.06, 1.0)


def bake(scene: Scene, settings: Settings, progress: Progress | None = None) -> Iterator[Baked]:
    """Bake the scene's targets one after the other; each result can be written and forgotten before the next.

    Raises as `Baker` and its `bake`.
    """
    baker = Baker(scene, settings, progress)
    yield from map(baker.bake, scene.targets)


class Baker:
    """Bakes the targets of one scene with one set of settings; occluders are built once where they serve several.

    Raises InputError where a map needs a camera or a World and the scene has none, or where there is no Embree.
    """

    def __init__(self, scene: Scene, settings: Settings, progress: Progress | None = None) -> None:
        _check_scene(scene, settings)
        self.device = open_device(settings.threads)
        self.scene = scene
        self._settings = settings
        self._progress = progress or Progress()
        self._progress.expect(len(scene.targets))
        self._occluders = Occluders(self.device, scene.occluders, settings.rays, _reserved(scene))
        self._untold = list(self._occluders.warnings)

    def bake(self, target: Instance, tile: int | None = None, size: tuple[int, int] | None = None) -> Baked:
        """Bake one object, of a UDIM layout one tile. size: of its image, the settings' where it has none of its own.
        Raises InputError for one that cannot be baked, Cancelled, MemoryError.

        Same scene and settings, same bits, whatever the number of threads.
        """
        try:
            baked = self._bake(target, tile, size or self._settings.image.size)
        finally:
            self._progress.preview = None
            self._progress.finish_object()
        baked.warnings[:0] = self._untold  # those on occluders stand once, with the first object
        self._untold = []
        return baked

    def _bake(self, target: Instance, tile: int | None, size: tuple[int, int]) -> Baked:
        settings, progress, clock = self._settings, self._progress, Stopwatch()
        warnings = check_target(target)
        if settings.needs_tangents:
            check_tangents(target)
        laid_out = in_tile(target, tile)
        with clock.stage("texels"):
            texels = self._texels(target, laid_out, tile, size)
        with clock.stage("build"):
            progress.enter(f"{target.name}: building the scene", _BUILD)
            frame = self._occluders.frame_for(target, progress.control)
            surface = TexelSurface(world_surface(laid_out, frame.origin), texels.owner, threads=settings.threads)
        frames = TexelFrames(laid_out, texels.owner)
        warnings += texels.warnings
        if target.name in self.scene.highs:
            with clock.stage("texels"):
                surface, lines = self._onto_high_poly(target, surface, frame)
                warnings += lines
        with clock.stage("inside"):
            report, sights = self._looked_at(target, surface, texels, frame)
        if settings.normal_maps and target.normal_map is not None and target.name not in self.scene.highs:
            with clock.stage("texels"):
                progress.enter(f"{target.name}: laying its normal maps over it", _LOOK)
                check = progress.raise_if_cancelled
                surface = with_shading_normals(target.normal_map, frames, surface, check=check)
        tracer = self._tracer(part_in_tile(target, tile), frame, surface, report, clock)
        solved = tracer.solve(settings.specs)
        progress.raise_if_cancelled()
        finisher = MapFinisher(
            surface, frames, texels.coverage, settings.image.margin, tracer.options.camera, self.scene.environment
        )
        maps = self._finished(solved, finisher, tracer)
        warnings += _what_is_wrong(target, report, sights, maps)
        warnings += _shortfalls(target, settings, solved)
        rays = sum(each.rays for each in solved) + sum(maps[each.name].rays for each in settings.maps if not each.spec)
        return Baked(target.name, size, report, rays, maps, clock.seconds, warnings, tile)

    def _texels(self, target: Instance, laid_out: Instance, tile: int | None, size: tuple[int, int]) -> Texels:
        """laid_out: the target as the tile has its UVs."""
        mesh, tiled = laid_out.mesh, tile is not None
        if mesh.uv is None:
            raise InputError(f"{target.name}: the mesh has no UV map; unwrap it, or bake with chart UVs (--uv charts)")
        control = self._progress.enter(f"{target.name}: texels", _TEXELS)
        skip, threads = zero_area(mesh) | outside_tile(target.mesh, tile), self._settings.threads
        return rasterize(target.name, mesh.uv, *size, skip=skip, tiled=tiled, threads=threads, control=control)

    def _onto_high_poly(
        self, target: Instance, surface: TexelSurface, frame: TraceFrame
    ) -> tuple[TexelSurface, list[str]]:
        control = self._progress.enter(f"{target.name}: looking for high meshes", _LOOK)
        highs = self.scene.highs[target.name]
        return onto_high_poly(target, highs, surface, frame.origin, self.device, control=control)

    def _looked_at(
        self, target: Instance, surface: TexelSurface, texels: Texels, frame: TraceFrame
    ) -> tuple[SurfaceReport, Mapping[Sight, float]]:
        """What of the surface the artist may want to mend, and what its faces see."""
        count = int(np.count_nonzero(surface.covered))
        inside = self._interior_share(target, surface, frame)
        own = self._occluders.number_of(target, frame)
        control = self._progress.enter(f"{target.name}: looking for faces that are turned", _LOOK)
        sights = flipped_faces.sights_of(frame.scene, surface, own, control=control)
        report = SurfaceReport(count, texels.overlapped, inside, sights[Sight.FLIPPED], sights[Sight.BURIED])
        return report, sights

    def _interior_share(self, target: Instance, surface: TexelSurface, frame: TraceFrame) -> float:
        own = self._occluders.number_of(target, frame)
        if target.name in self.scene.highs:  # of one high mesh the faces are as its own; several may well overlap
            (first, *more) = self.scene.highs[target.name].meshes
            own = -1 if more else self._occluders.number_of(first, frame)
            if own < 0:
                return 0.0
        if not frame.holds_others(own):
            return 0.0
        control = self._progress.enter(f"{target.name}: looking for meshes around it", _LOOK)
        return interior.interior_share(frame.scene, surface, own, control=control)

    def _tracer(
        self, shown: Instance, frame: TraceFrame, surface: TexelSurface, report: SurfaceReport, clock: Stopwatch
    ) -> MapTracer:
        """shown: the target as it lies in the texture, for the preview."""
        settings, scene = self._settings, self.scene
        own = 0.0
        if any(each.has_own_rays for each in settings.maps):
            own = 0.5 if settings.specs else 1.0
        options = TraceOptions(
            settings.goal.rays,
            settings.seed,
            settings.rays,
            settings.threads,
            camera=scene.camera and scene.camera.about(frame.origin),
            # More triangles than texels: the rays of neighbouring texels mostly meet different ones (docs/figures.md).
            coherent=frame.triangles <= report.texels,
            light=scene.environment,
        )
        stages = Stages(self._progress, shown, _TRACE, plain=settings.goal.plain, own=own)
        return MapTracer(frame.scene, surface, options, settings.goal, stages, clock)

    def _finished(self, solved: Sequence[Solved], finisher: MapFinisher, tracer: MapTracer) -> dict[str, BakedMap]:
        """All maps by name: those of each spec together, then those that are made otherwise."""
        settings, maps = self._settings, dict[str, BakedMap]()
        with tracer.clock.stage("finish"):
            for spec, each in zip(settings.specs, solved, strict=True):
                for wanted in settings.maps:
                    if wanted.spec is not None and spec.serves(wanted.spec):
                        maps[wanted.name] = wanted.finish(each, finisher)
        for wanted in settings.maps:
            if wanted.spec is None:
                with tracer.clock.stage("code" if wanted.has_own_rays else "finish"):
                    maps[wanted.name] = wanted.make(finisher, tracer)
        return maps


def _check_scene(scene: Scene, settings: Settings) -> None:
    """What the maps need of it."""
    if any(each.axis is Axis.REFLECTED for each in settings.specs):
        _check_camera(scene.camera)
    if settings.needs_light and scene.environment is None:
        raise InputError("the scene has no World to take light from; add one in World properties, or bake no light")


def _check_camera(camera: Camera | None) -> None:
    cure = "or bake RO with direction normal"
    if camera is None:
        raise InputError(f"the scene has no camera to take R from; add one, {cure}")
    numbers = np.abs([*camera.position, *camera.forward])
    if not (numbers < FARTHEST_CAMERA).all():
        raise InputError(f"the scene's camera: its transform is not finite, or too far away; clear it, {cure}")


def _reserved(scene: Scene) -> dict[str, set[str]]:
    """Objects that block light for some targets alone, and those targets."""
    reserved: dict[str, set[str]] = {}
    for target in () if scene.shared else scene.targets:
        highs = scene.highs.get(target.name)
        for owner in [target] if highs is None else highs.meshes:
            reserved.setdefault(owner.belongs_to, set()).add(target.name)
    return reserved


def _what_is_wrong(
    target: Instance, report: SurfaceReport, sights: Mapping[Sight, float], maps: dict[str, BakedMap]
) -> list[str]:
    """A line for each thing that the artist may want to mend."""
    inside = interior.warning(target.name, report.interior)
    lines = inside + flipped_faces.warnings(target.name, report.flipped, report.buried)
    if (ambient := ambient_among(maps)) is not None and not inside:
        overlapped = report.overlapped / max(report.texels, 1)
        lines += flipped_faces.dark_warnings(target.name, maps[ambient].mean, overlapped, sights)
    return lines


def _shortfalls(target: Instance, settings: Settings, solved: Sequence[Solved]) -> list[str]:
    """A line for each map that did not get to the error asked for: it would have taken too many rays."""

    def line(spec: MapSpec, each: Solved) -> str:
        return (
            f"{target.name}: {spec.name} has an error of {each.error.rmse:.4f}, and {settings.goal.error:.4f} was "
            f"asked for; it would take over {MOST_MEAN_RAYS} rays a texel: ask for less, or bake fine detail into a "
            "larger image"
        )

    return [line(spec, each) for spec, each in zip(settings.specs, solved, strict=True) if not each.met]
