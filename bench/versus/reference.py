"""What errors are measured against: ours with thousands of rays a texel, plain, in two halves that tell its noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...core.base.arrays import Floats
from ...core.finish.compare import compare
from ...core.rays.map_spec import MapSpec
from ..subject import Subject, textures_of

RAYS, FEWEST = 4096, 512  # of both halves together
SEEDS = (1000, 1001)  # which no baker is given
PILOT = 16  # rays that tell how long the reference will take


@dataclass(frozen=True, eq=False)
class Reference:
    """values: (N * size, size) float32, the mean of two bakes of rays / 2. noise: the RMSE of that mean about its
    expectation, half the RMS difference of the two."""

    values: Floats
    rays: int
    noise: float


def reference(subject: Subject, spec: MapSpec, budget: float, files: Sequence[Path], fresh: bool) -> Reference:
    """The reference of a subject's map, from the first of the files that is there and of the same texels; else traced
    and kept in the last."""
    for file in () if fresh else files:
        if file.exists():
            with np.load(file) as kept:
                if np.array_equal(kept["owner"], subject.owner):
                    return Reference(kept["values"], int(kept["rays"]), float(kept["noise"]))
            print(f"{file.name}: of other texels, so traced again")
    made = trace_reference(subject, spec, rays_within(subject, spec, budget))
    files[-1].parent.mkdir(parents=True, exist_ok=True)
    with files[-1].open("wb") as stream:
        np.savez_compressed(stream, owner=subject.owner, values=made.values, rays=made.rays, noise=made.noise)
    return made


def trace_reference(subject: Subject, spec: MapSpec, rays: int) -> Reference:
    """Two plain bakes of half the rays."""
    bakes = [subject.bake(spec, rays=rays // 2, filtered=False, seed=seed) for seed in SEEDS]
    halves = [textures_of(made, spec).values for made in bakes]
    apart = compare(halves[0], halves[1], subject.covered).rmse
    return Reference(0.5 * (halves[0] + halves[1]), rays, 0.5 * apart)


def rays_within(subject: Subject, spec: MapSpec, budget: float) -> int:
    """How many rays a reference gets: RAYS, halved until tracing them fits the budget (seconds)."""
    pilot = subject.bake(spec, rays=PILOT, filtered=False)
    each = sum(baked.seconds["trace"] for _, baked in pilot.results) / PILOT
    rays = RAYS
    while rays > FEWEST and each * rays > budget:
        rays //= 2
    if rays < RAYS:
        print(f"reference: {rays} rays a texel, since {RAYS} would take more than {budget:.0f} s", flush=True)
    return rays
