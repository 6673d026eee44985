"""Where texels are finer than what changes: maps as an image half as wide and high tells them, and one half of that.

Only texels with detail that a coarser image misses get rays of their own (solve/upsample.py).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, Self

import numpy as np

from .base.arrays import Floats
from .base.timing import Stopwatch
from .progress import Stages
from .rays.map_spec import Axis, MapSpec
from .rays.texel_surface import TexelSurface
from .solve.adaptive_sampler import missed_share
from .solve.goal import LEAST_ERROR, Goal
from .solve.ray_source import RaySource
from .solve.solver import begin, estimate, estimate_from, measured
from .solve.upsample import Estimates, Upsampled, upsampled

# With fewer texels of its own a coarse image would be too coarse for what most meshes have of detail (measured on
# samples and models at 1/50 to 1/510).
LEAST_TEXELS = 1 << 18  # at an error of LEAST_AT or less; above it they fall as its square, to a quarter
LEAST_AT = 1.0 / 255.0
COARSER = 0.92  # of the error that is wanted: what each halving leaves for what the coarser image misses
MOST_MISSED = 0.5  # of the texels may need rays of their own
# Times the first round's rays that the coarsest image may ask for in the next. Where it asks for more, what changes is
# finer than its texels, and tells nothing about what lies between them: leaves, crumbs.
MOST_GROWTH = 8.0


class Tracer(Protocol):
    """What solves the maps of one object, as MapTracer does."""

    surface: TexelSurface
    goal: Goal
    stages: Stages
    clock: Stopwatch

    @property
    def seed(self) -> int:
        """The bake's."""

    def sources(self, specs: Sequence[MapSpec]) -> Sequence[RaySource]:
        """What brings each map its rays."""

    def openings(self, specs: Sequence[MapSpec]) -> list[tuple[Floats, Floats | None]]:
        """The first round of all maps."""

    def halved(self, error: float) -> Self:
        """The same on an image half as wide and high, to an error."""


def told(tracer: Tracer, specs: Sequence[MapSpec]) -> list[Upsampled] | None:
    """All maps of a tracer as an image half as wide and high tells them; None where that does not pay.

    Raises Cancelled, MemoryError."""
    if not _may_be_halved(tracer, specs):
        return None
    assert tracer.goal.error is not None
    coarse = tracer.halved(max(COARSER * tracer.goal.error, LEAST_ERROR))
    found = _tell(coarse, tracer, specs)
    coarse.stages.preview(None)  # it holds the coarse image
    return found


def _may_be_halved(tracer: Tracer, specs: Sequence[MapSpec]) -> bool:
    height, width = tracer.surface.owner.shape
    return (
        tracer.goal.error is not None
        and tracer.goal.filters
        and tracer.surface.texel_normals is None  # as fine as the texels
        and tracer.surface.mesh.spacing is None  # a low mesh's texels are points: between them nothing is seen
        and all(each.axis is Axis.NORMAL for each in specs)
        and height % 2 == width % 2 == 0
        and np.count_nonzero(tracer.surface.covered) > 4 * _least_texels(tracer.goal.error)
    )


def _least_texels(error: float) -> float:
    """Of an image that is halved no more. error: the RMSE wanted."""
    return LEAST_TEXELS * min(max((LEAST_AT / error) ** 2, 0.25), 1.0)


def _tell(coarse: Tracer, finer: Tracer, specs: Sequence[MapSpec]) -> list[Upsampled] | None:
    """All maps to an image twice as wide and high; None where there is too much detail for it."""
    sources = coarse.sources(specs)
    if (coarser := told(coarse, specs)) is not None:
        with coarse.clock.stage("solve"):
            owner, goal = coarse.surface.owner, coarse.goal
            return [
                _upsampled(coarse, estimate_from(coarser.pop(0), owner, goal, source), finer, source.spec)
                for source in sources
            ]
    openings = coarse.openings(specs)
    with coarse.clock.stage("solve"):
        rounds = [begin(openings.pop(0), coarse.surface.owner, coarse.goal, source) for source in sources]
        for each, spec in zip(rounds, specs, strict=True):
            first = _upsampled(coarse, Estimates((each.values,), each.expected, each.rays), finer, spec)
            if missed_share(first, finer.surface.covered, finer.goal.error or 0.0) > MOST_MISSED:
                return None
            del first
        begun = [measured(rounds.pop(0), coarse.goal, coarse.seed, source) for source in sources]
        if max(each.growth for each in begun) > MOST_GROWTH:
            return None
        return [
            _upsampled(coarse, estimate(begun.pop(0), coarse.goal, coarse.seed, source), finer, source.spec)
            for source in sources
        ]


def _upsampled(coarse: Tracer, estimates: Estimates, finer: Tracer, spec: MapSpec) -> Upsampled:
    with coarse.clock.stage("upsample"):
        control = coarse.stages.enter("refining")
        return upsampled(coarse.surface, estimates, finer.surface, spec.exponent, control=control)
