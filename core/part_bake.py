"""The way of one part of an object: frame → surface → rays → solve → finish.

An object is one part, but where what belongs to its mesh is too far apart for float32 (scene/parts.py): each part is
then baked about an origin of its own. Reading `PartBaker.bake` from top to bottom tells the whole way; each line goes
to the room that knows how.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .base.arrays import Ints
from .base.timing import Stopwatch
from .finish.baked import Baked, BakedMap, SurfaceReport
from .finish.map_finisher import MapFinisher
from .map_tracer import MapTracer
from .progress import Progress, Stages
from .rays.coherence import are_coherent
from .rays.embree import Device
from .rays.map_spec import MapSpec
from .rays.occluders import Occluders, TraceFrame
from .rays.texel_surface import TexelSurface
from .rays.tracer import TraceOptions
from .scene.parts import Part
from .scene.scene import Instance, Scene
from .scene.world_mesh import world_surface
from .settings import Settings
from .solve.adaptive_sampler import MOST_MEAN_RAYS
from .solve.solver import Solved
from .texels import flipped_faces, interior
from .texels.high_to_low import onto_high_poly
from .texels.rasterize import Texels
from .texels.shading_normals import with_shading_normals
from .texels.tangent_space import TexelFrames

_LIKELY_RAYS = 16  # of a texel, where an error is asked for: what is worth building depends on it
# Parts of the time that an object takes, for the progress bar.
_BUILD, _LOOK, _TRACE = (0.02, 0.05), (0.05, 0.06), (0.06, 1.0)


@dataclass(frozen=True, eq=False)
class Shared:
    """What all targets of a bake have in common."""

    scene: Scene
    settings: Settings
    progress: Progress
    device: Device
    occluders: Occluders


@dataclass(frozen=True, eq=False)
class Layout:
    """One image of a target. laid_out: the target as it lies in that; shown: what of it the image shows, for the
    preview. clock: of all that it takes."""

    target: Instance
    laid_out: Instance
    shown: Instance
    texels: Texels
    frames: TexelFrames
    clock: Stopwatch


class PartBaker:
    """Bakes the parts of one image, with margins of so many texels."""

    def __init__(self, shared: Shared, layout: Layout, margin: int) -> None:
        self._shared, self._layout, self._margin = shared, layout, margin

    def bake(self, part: Part, owner: Ints) -> Baked:
        """owner: (H, W) int32, of the part's texels, -1 elsewhere. Raises as `Baker.bake`."""
        layout, settings, clock = self._layout, self._shared.settings, self._layout.clock
        with clock.stage("build"):
            frame = self._frame(part, owner)
        with clock.stage("texels"):
            surface = self._surface(part, owner, frame)
        with clock.stage("inside"):
            report = self._looked_at(surface, frame)
        with clock.stage("texels"):
            surface = self._with_normal_maps(surface)
        tracer = self._tracer(frame, surface, report)
        solved = tracer.solve(settings.specs)
        self._shared.progress.raise_if_cancelled()
        finisher = MapFinisher(
            surface,
            layout.frames,
            layout.texels.coverage,
            self._margin,
            tracer.options.camera,
            self._shared.scene.environment,
        )
        maps = self._finished(solved, finisher, tracer)
        rays = sum(each.rays for each in solved) + sum(maps[each.name].rays for each in settings.maps if not each.spec)
        warnings = _shortfalls(layout.target, settings, solved)
        height, width = owner.shape
        return Baked(layout.target.name, (width, height), report, rays, maps, warnings=warnings)

    def _frame(self, part: Part, owner: Ints) -> TraceFrame:
        shared, target = self._shared, self._layout.target
        control = shared.progress.enter(f"{target.name}: building the scene", _BUILD)
        highs = shared.scene.highs.get(target.name)
        surfaces = [target] if highs is None else highs.meshes
        goal, maps = shared.settings.goal, len(shared.settings.specs)
        rays = owner.size * maps * (goal.rays if goal.error is None else _LIKELY_RAYS)
        return shared.occluders.frame_for(target, part, surfaces, rays=rays, control=control)

    def _surface(self, part: Part, owner: Ints, frame: TraceFrame) -> TexelSurface:
        """The part's own, or what it sees of the high meshes."""
        shared, target = self._shared, self._layout.target
        mesh = world_surface(self._layout.laid_out, frame.origin)
        surface = TexelSurface(mesh, owner, threads=shared.settings.threads)
        if (highs := shared.scene.highs.get(target.name)) is None:
            return surface
        control = shared.progress.enter(f"{target.name}: looking for high meshes", _LOOK)
        return onto_high_poly(target, highs, surface, part, shared.device, control=control)

    def _with_normal_maps(self, surface: TexelSurface) -> TexelSurface:
        shared, target = self._shared, self._layout.target
        if not shared.settings.normal_maps or target.normal_map is None or target.name in shared.scene.highs:
            return surface
        shared.progress.enter(f"{target.name}: laying its normal maps over it", _LOOK)
        check = shared.progress.raise_if_cancelled
        return with_shading_normals(target.normal_map, self._layout.frames, surface, check=check)

    def _looked_at(self, surface: TexelSurface, frame: TraceFrame) -> SurfaceReport:
        """What of the surface the artist may want to mend."""
        shared, target = self._shared, self._layout.target
        count = int(np.count_nonzero(surface.covered))
        inside = self._interior_share(surface, frame)
        own = shared.occluders.number_of(target, frame)
        control = shared.progress.enter(f"{target.name}: looking for faces that are turned", _LOOK)
        sights = flipped_faces.sights_of(frame.scene, surface, own, control=control)
        return SurfaceReport(count, interior=inside, sights=sights)

    def _interior_share(self, surface: TexelSurface, frame: TraceFrame) -> float:
        shared, target = self._shared, self._layout.target
        own = shared.occluders.number_of(target, frame)
        if target.name in shared.scene.highs:  # of one high mesh the faces are as its own; several may well overlap
            (first, *more) = shared.scene.highs[target.name].meshes
            own = -1 if more else shared.occluders.number_of(first, frame)
            if own < 0:
                return 0.0
        if not frame.holds_others(own):
            return 0.0
        control = shared.progress.enter(f"{target.name}: looking for meshes around it", _LOOK)
        return interior.interior_share(frame.scene, surface, own, control=control)

    def _tracer(self, frame: TraceFrame, surface: TexelSurface, report: SurfaceReport) -> MapTracer:
        settings, scene, progress = self._shared.settings, self._shared.scene, self._shared.progress
        own = 0.0
        if any(each.has_own_rays for each in settings.maps):
            own = 0.5 if settings.specs else 1.0
        options = TraceOptions(
            settings.goal.rays,
            settings.seed,
            settings.rays,
            settings.threads,
            camera=scene.camera and scene.camera.about(frame.origin),
            coherent=are_coherent(surface, frame.triangles, report.texels),
            light=scene.environment,
        )
        stages = Stages(progress, self._layout.shown, _TRACE, plain=settings.goal.plain, own=own)
        return MapTracer(frame.scene, surface, options, settings.goal, stages, self._layout.clock)

    def _finished(self, solved: Sequence[Solved], finisher: MapFinisher, tracer: MapTracer) -> dict[str, BakedMap]:
        """All maps by name: those of each spec together, then those that are made otherwise."""
        settings, maps = self._shared.settings, dict[str, BakedMap]()
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


def _shortfalls(target: Instance, settings: Settings, solved: Sequence[Solved]) -> list[str]:
    """A line for each map that did not get to the error asked for: it would have taken too many rays."""

    def line(spec: MapSpec, each: Solved) -> str:
        return (
            f"{target.name}: {spec.name} has an error of {each.error.rmse:.4f}, and {settings.goal.error:.4f} was "
            f"asked for; it would take over {MOST_MEAN_RAYS} rays a texel: ask for less, or bake fine detail into a "
            "larger image"
        )

    return [line(spec, each) for spec, each in zip(settings.specs, solved, strict=True) if not each.met]
