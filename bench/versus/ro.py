"""RO of suzanne: rays by the lobe against the naive estimator, uniform over the sphere. The section `ro`."""

from __future__ import annotations

import argparse
from functools import partial
from itertools import product
from typing import Any

from ...core.finish.compare import compare
from ...core.rays.map_spec import MapSpec, reflection, sampled
from ..pages import filled, machine
from ..subject import Subject, prepare
from ..sweep import in_turns
from .curves import ratio_at
from .record import without_noise
from .reference import Reference, rays_within, trace_reference

SCENE, SIZE = "suzanne", 512
EXPONENTS = (10.0, 100.0)
RAYS = (16, 64, 256)
LOBE, NAIVE = "importance", "uniform_sphere"


def measure(chosen: argparse.Namespace) -> dict[str, Any]:
    """Both estimators at a few numbers of rays."""
    subject = prepare(SCENE, SIZE, chosen.models)
    found: dict[str, Any] = {"about": {"machine": machine(), "size": SIZE, "object": subject.label}}
    for exponent in EXPONENTS:
        spec = reflection(exponent)
        against = trace_reference(subject, spec, rays_within(subject, spec, chosen.budget))
        cases = {
            f"{exponent:g} {sampler} {rays}": partial(_bake, subject, sampled(spec, sampler), rays, against)
            for rays, sampler in product(RAYS, (LOBE, NAIVE))
        }
        found |= {name: runs[0] for name, runs in in_turns(cases, 1).items()}
    return found


def page(result: dict[str, Any]) -> list[str]:
    """The section of the page."""
    rows = []
    for exponent in EXPONENTS:
        of = {sampler: [result[f"{exponent:g} {sampler} {rays}"] for rays in RAYS] for sampler in (LOBE, NAIVE)}
        curves = [[(each["seconds"], each["rmse"]) for each in found] for found in of.values()]
        for rays, lobe, naive in zip(RAYS, of[LOBE], of[NAIVE], strict=True):
            ratio = ratio_at(lobe["rmse"], *curves)
            rows.append({"exponent": exponent, "rays": rays, "lobe": lobe, "naive": naive, "ratio": ratio})
    return filled(__file__, scene=SCENE, rows=rows, **result)


def _bake(subject: Subject, spec: MapSpec, rays: int, against: Reference, _: int) -> dict[str, float]:
    made = subject.bake(spec, rays=rays, filtered=False)
    rmse = compare(made.baked.maps[spec.name].values, against.values, subject.covered).rmse
    return {"seconds": made.seconds, "rmse": without_noise(rmse, against.noise)}
