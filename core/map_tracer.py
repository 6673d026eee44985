"""From the texels of one object to solved maps: their rays, the horizon, the filter, and how far all that is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import count
from typing import Self

import numpy as np

from . import coarse_first
from .base.arrays import Doubles, Floats, Ints, Longs
from .base.kernel_api import Control
from .base.timing import Stopwatch
from .progress import Stages
from .rays.accumulators import Accumulator
from .rays.map_spec import MapSpec, count_images, image_slices
from .rays.texel_surface import TexelSurface
from .rays.trace_scene import TraceScene
from .rays.tracer import CHUNK_RAYS, Sums, TraceOptions, trace, trace_blocks, trace_texels
from .solve import horizon
from .solve.blocks import all_texels_of
from .solve.goal import Goal, first_rays
from .solve.solver import Solved, solve, solve_from
from .solve.surface_filter import SurfaceFilter
from .spherical.lobe import open_horizon

# Seeds of probes and of codes, so many apart.
_NEXT_SEED, _PROBES, _CODES, _LEVELS = 0x9E3779B97F4A7C15, 1 << 20, 1 << 21, 1 << 22


@dataclass(eq=False)
class MapTracer:
    """What it takes to solve the maps of one object. options: how rays are traced but for their number; the seed is the
    bake's."""

    scene: TraceScene
    surface: TexelSurface
    options: TraceOptions
    goal: Goal
    stages: Stages
    clock: Stopwatch
    level: int = 0  # how often the image was halved

    def solve(self, specs: Sequence[MapSpec]) -> list[Solved]:
        """All maps."""
        if not specs:
            return []
        owner, sources = self.surface.owner, self.sources(specs)
        if (told := coarse_first.told(self, specs)) is not None:
            with self.clock.stage("solve"):
                return [solve_from(told.pop(0), owner, self.goal, self.seed, source) for source in sources]
        openings = self.openings(specs)
        with self.clock.stage("solve"):
            return [solve(openings.pop(0), owner, self.goal, self.seed, source) for source in sources]

    def halved(self, error: float) -> Self:
        """The same on an image half as wide and high, to an error."""
        goal, stages = replace(self.goal, error=error), self.stages.before(0.5)
        return replace(self, surface=self.surface.coarser(), goal=goal, stages=stages, level=self.level + 1)

    def sources(self, specs: Sequence[MapSpec]) -> list[RaysOfMap]:
        """What brings each map its rays."""
        return [RaysOfMap(self, spec) for spec in specs]

    def openings(self, specs: Sequence[MapSpec]) -> list[tuple[Floats, Floats | None]]:
        """The first round of all maps, traced together."""
        rays = first_rays(self.goal)
        with self.clock.stage("trace"):
            into = np.zeros((count_images(specs), *self.surface.owner.shape), dtype=np.float32)
            if specs[0].accumulator is not Accumulator.LIGHT:  # whose sums are no share of the rays
                self._preview(into[0], rays)
            sums = self._trace(specs, self.options_of(rays, 0), halves=not self.goal.plain, into=into)
            self.stages.preview(None)  # it holds the sums
            del into
        return _openings(sums, specs, rays)  # `solve` lets go of them once it has read them

    @property
    def seed(self) -> int:
        """The bake's."""
        return self.options.seed

    def options_of(self, rays: int, number: int) -> TraceOptions:
        """Rays of rounds, 0, go on in the sequences of one seed; each draw of the probes' has one of its own."""
        return replace(self.options, count=rays, seed=self.seed + (number + self.level * _LEVELS) * _NEXT_SEED)

    @property
    def options_of_codes(self) -> TraceOptions:
        """Those of directional codes, but for their number of rays."""
        return self.options_of(1, _CODES)

    def options_of_probes(self, rays: int, number: int) -> TraceOptions:
        """Those of a draw of probes."""
        return self.options_of(rays, _PROBES + number)

    def _trace(self, specs: Sequence[MapSpec], options: TraceOptions, *, halves: bool, into: Floats) -> Sums:
        """A round of rays of all texels, the horizon divided out where that is asked for."""
        control = self.stages.enter("tracing", rays=True)
        sums = trace(self.scene, self.surface, specs, options, halves=halves, into=into, control=control)
        for spec, its in zip(specs, image_slices(specs), strict=True):
            if spec.divided:
                _divide(sums, its.start, self.openness(spec))
        return sums

    def openness(self, spec: MapSpec, texels: Longs | None = None) -> Doubles:
        """What an open surface would get: of all texels, (H, W), or of those listed."""
        cosines = self._cosines if texels is None else self._cosines.reshape(-1)[texels]
        return open_horizon(spec.exponent, cosines)

    def enter_own(self, before: float, after: float) -> Control:
        """The stage of a map with rays of its own, from one share of it to another."""
        return self.stages.enter_own(before, after)

    @cached_property
    def filter(self) -> SurfaceFilter:
        """Built when first asked for."""
        return SurfaceFilter(self.surface, control=self.stages.enter("finding neighbours"))

    @cached_property
    def _cosines(self) -> Doubles:
        assert self.options.camera is not None
        return horizon.cosines_to_reflected(self.surface, self.options.camera)

    def _preview(self, sums: Floats, rays: int) -> None:
        """The first map as it fills in, until its texels have had their first chunk of rays."""
        first, control = min(rays, CHUNK_RAYS), self.stages.control

        def values() -> Floats | None:
            full = control.total > 0 and control.done * rays > control.total * first
            if full:
                return None
            seen: Floats = np.minimum(sums / np.float32(first), np.float32(1.0))
            seen[seen <= 0.0] = -1.0  # what is wholly closed is taken for not traced yet
            return seen

        self.stages.preview(values)


class RaysOfMap:
    """Rounds and probes of one map: the solver's `RaySource`."""

    def __init__(self, tracer: MapTracer, spec: MapSpec) -> None:
        self._tracer, self._spec = tracer, spec
        self._draws = count()

    @property
    def spec(self) -> MapSpec:
        """The map's."""
        return self._spec

    @property
    def filter(self) -> SurfaceFilter:
        """One for all maps of the surface."""
        return self._tracer.filter

    def filter_of(self, owner: Ints) -> SurfaceFilter:
        """As `RaySource.filter_of`."""
        tracer = self._tracer
        return SurfaceFilter(tracer.surface.part(owner), control=tracer.stages.enter("finding neighbours"))

    def trace(self, blocks: Longs, before: int, rays: int) -> tuple[Floats, Floats]:
        """As `RaySource.trace`."""
        tracer, spec = self._tracer, self._spec
        with tracer.clock.stage("trace"):
            options, control = tracer.options_of(rays, 0), tracer.stages.enter("tracing", rays=True)
            sums = trace_blocks(tracer.scene, tracer.surface, blocks, before, (spec,), options, control=control)
        if spec.divided:
            texels, inside = all_texels_of(blocks, tracer.surface.owner.shape)
            _divide(sums, 0, tracer.openness(spec, np.where(inside, texels, 0)))
        assert sums.first_half is not None
        first = max((before + rays) // 2 - before, 0)
        return spec.accumulator.totals(sums.all, rays), spec.accumulator.totals(sums.first_half, first)

    def probe(self, texels: Longs, rays: int) -> Floats:
        """As `RaySource.probe`."""
        tracer, spec = self._tracer, self._spec
        with tracer.clock.stage("probe"):
            options, control = tracer.options_of_probes(rays, next(self._draws)), tracer.stages.control
            sums = trace_texels(tracer.scene, tracer.surface, texels, (spec,), options, control=control)
        if spec.divided:
            _divide(sums, 0, tracer.openness(spec, texels))
        return sums.all

    def enter(self, stage: str) -> Control:
        """As `RaySource.enter`."""
        return self._tracer.stages.enter(stage)

    def show(self, values: Floats) -> None:
        """As `RaySource.show`."""
        self._tracer.stages.preview(lambda: values)


def _openings(sums: Sums, specs: Sequence[MapSpec], rays: int) -> list[tuple[Floats, Floats | None]]:
    """What each map is solved from: its rows times the rays, of all of them and of the first half."""
    openings: list[tuple[Floats, Floats | None]] = []
    for each, images in zip(specs, image_slices(specs), strict=True):
        half = None if sums.first_half is None else each.accumulator.totals(sums.first_half[images], rays // 2)
        openings.append((each.accumulator.totals(sums.all[images], rays), half))
    return openings


def _divide(sums: Sums, image: int, openness: Doubles) -> None:
    """Take the horizon out of a map's sums, which are one image of all."""
    for images in (sums.all, sums.first_half):
        if images is not None:
            horizon.divide(images[image], openness)
