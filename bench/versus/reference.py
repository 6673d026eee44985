"""What errors are measured against: ours with thousands of rays a texel, plain, in two halves that tell its noise."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...core.base.arrays import Floats
from ...core.finish.compare import compare
from ...core.rays.map_spec import AO, MapSpec
from ..subject import Subject

RAYS, FEWEST = 4096, 512  # of both halves together
SEEDS = (1000, 1001)  # which no baker is given
PILOT = 16  # rays that tell how long the reference will take


@dataclass(frozen=True, eq=False)
class Reference:
    """values: (H, W) float32, the mean of two bakes of rays / 2. noise: the RMSE of that mean about its expectation,
    half the RMS difference of the two."""

    values: Floats
    rays: int
    noise: float


def reference(subject: Subject, budget: float, file: Path, fresh: bool) -> Reference:
    """The reference of a subject, from its file where it is there and of the same texels; else traced and kept."""
    if file.exists() and not fresh:
        with np.load(file) as kept:
            if np.array_equal(kept["owner"], subject.owner):
                return Reference(kept["values"], int(kept["rays"]), float(kept["noise"]))
        print(f"{file.name}: of other texels, so traced again")
    made = trace_reference(subject, AO, rays_within(subject, budget))
    file.parent.mkdir(parents=True, exist_ok=True)
    with file.open("wb") as stream:
        np.savez_compressed(stream, owner=subject.owner, values=made.values, rays=made.rays, noise=made.noise)
    return made


def trace_reference(subject: Subject, spec: MapSpec, rays: int) -> Reference:
    """Two plain bakes of half the rays."""
    bakes = [subject.bake(spec, rays=rays // 2, filtered=False, seed=seed).baked for seed in SEEDS]
    halves = [baked.maps[spec.name].values for baked in bakes]
    apart = compare(halves[0], halves[1], subject.covered).rmse
    return Reference(0.5 * (halves[0] + halves[1]), rays, 0.5 * apart)


def rays_within(subject: Subject, budget: float) -> int:
    """How many rays a reference gets: RAYS, halved until tracing them fits the budget (seconds)."""
    each = subject.bake(rays=PILOT, filtered=False).baked.seconds["trace"] / PILOT
    rays = RAYS
    while rays > FEWEST and each * rays > budget:
        rays //= 2
    if rays < RAYS:
        print(f"reference: {rays} rays a texel, since {RAYS} would take more than {budget:.0f} s", flush=True)
    return rays
