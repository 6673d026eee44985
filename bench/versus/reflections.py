"""RO of suzanne: rays by the lobe against the naive estimator, uniform over the sphere. The section `ro`."""

from __future__ import annotations

import argparse
from typing import Any

from ...core.finish.compare import compare
from ...core.rays.map_spec import MapSpec, reflection, sampled
from ...tests.oracles.settings import flat_settings
from ..ours import bake_here
from ..pages import machine
from .curves import Curve, ratio_at
from .reference import Reference, rays_within, trace_reference
from .store import Rows
from .subject import Subject, prepare

SCENE = "suzanne"
EXPONENTS = (10.0, 100.0)
RAYS = (16, 64, 256)
LOBE, NAIVE = "importance", "uniform_sphere"


def measure(chosen: argparse.Namespace, rows: Rows) -> None:
    """Both estimators at a few numbers of rays."""
    subject = prepare(SCENE, chosen.size, chosen.models)
    rows.add("about", lambda: {"machine": machine(), "size": chosen.size, "object": subject.name})
    for exponent in EXPONENTS:
        if all(_key(exponent, sampler, rays) in rows.values for sampler in (LOBE, NAIVE) for rays in RAYS):
            continue
        against = trace_reference(subject, reflection(exponent), rays_within(subject, chosen.budget))
        for rays in RAYS:
            for sampler in (LOBE, NAIVE):
                spec = sampled(reflection(exponent), sampler)
                rows.add(
                    _key(exponent, sampler, rays),
                    lambda spec=spec, rays=rays, against=against: _bake(subject, spec, rays, against),
                )


def page(rows: dict[str, Any]) -> list[str]:
    """The section of the page."""
    about = rows["about"]
    lines = [
        "## Reflection occlusion: the lobe's own rays against naive ones",
        "",
        f"{about['object']} of `{SCENE}`, {about['size']}x{about['size']}, plain. Naive: directions uniform over the "
        "sphere, weighted by the lobe. The ratio: the naive estimator's seconds, by the rules above, to the RMSE that "
        "the lobe's rays have, over theirs.",
        "",
        "| exponent | rays | RMSE, lobe | RMSE, naive | s, lobe | s, naive | time ratio at equal RMSE |",
        "|---|---|---|---|---|---|---|",
    ]
    for exponent in EXPONENTS:
        curves = {name: _curve(rows, exponent, name) for name in (LOBE, NAIVE)}
        for rays in RAYS:
            lobe, naive = (rows.get(_key(exponent, name, rays)) for name in (LOBE, NAIVE))
            if lobe and naive:
                ratio = ratio_at(lobe["rmse"], curves[LOBE], curves[NAIVE])
                lines.append(
                    f"| {exponent:g} | {rays} | {lobe['rmse']:.5f} | {naive['rmse']:.5f} | {lobe['seconds']:.2f} "
                    f"| {naive['seconds']:.2f} | {ratio} |"
                )
    return [*lines, "", f"On {about['machine']}."]


def _bake(subject: Subject, spec: MapSpec, rays: int, against: Reference) -> dict[str, float]:
    settings = flat_settings((spec,), width=subject.size, height=subject.size, rays=rays, filtered=False, margin=0)
    seconds, results, _ = bake_here([subject.name], settings)
    rmse = compare(results[0][1].maps[spec.name].values, against.values, subject.covered).rmse
    return {"seconds": seconds, "rmse": max(rmse**2 - against.noise**2, (0.25 * against.noise) ** 2) ** 0.5}


def _curve(rows: dict[str, Any], exponent: float, sampler: str) -> Curve:
    there = (rows.get(_key(exponent, sampler, rays)) for rays in RAYS)
    return [(each["seconds"], each["rmse"]) for each in there if each]


def _key(exponent: float, sampler: str, rays: int) -> str:
    return f"{exponent:g} {sampler} {rays}"
