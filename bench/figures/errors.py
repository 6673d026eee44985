"""What the filter leaves of the error, and where: noise, blur, edges."""

from __future__ import annotations

import argparse
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ...core.base.arrays import Doubles, Flags
from ...core.rays.map_spec import AO
from ..pages import ROOT, filled
from ..plots import panels, save
from ..subject import Subject, prepare
from ..tables import table
from ..versus.reference import Reference, trace_reference

SCENES = ("bunny", "suzanne", "foliage", "gaps")
SIZE, RAYS, SEEDS, REFERENCE = 512, 64, 8, 4096
EDGES = 0.05  # of the texels
SHOWN = 0.03  # the largest error that a picture tells from larger ones
FOLDER = ROOT / "docs" / "pictures" / "errors"


@dataclass(frozen=True)
class Left:
    """Root mean squares, and the part of the squared error that edges hold."""

    scene: str
    plain: float
    filtered: float
    noise: float
    blur: float
    edges: float


def measure(chosen: argparse.Namespace) -> list[dict[str, Any]]:
    """One after the other; draws their pictures on the way."""
    return [asdict(_left(scene, prepare(scene, SIZE, chosen.models))) for scene in SCENES]


def page(result: list[dict[str, Any]]) -> list[str]:
    """The section of the page."""
    heads = ["scene", "plain", "filtered", "noise", "blur", "of it at edges"]
    rows = [(each["scene"], *(f"{each[name]:.4f}" for name in heads[1:5]), f"{each['edges']:.0%}") for each in result]
    pictures = [f"![{each['scene']}: map, error, noise, blur](pictures/errors/{each['scene']}.png)" for each in result]
    sizes = {"size": SIZE, "rays": RAYS, "seeds": SEEDS, "reference": REFERENCE, "shown": SHOWN}
    return filled(__file__, rows=table(heads, rows), pictures="\n\n".join(pictures), **sizes)


def _left(scene: str, subject: Subject) -> Left:
    reference = trace_reference(subject, AO, REFERENCE)
    bakes = np.stack([_bake(subject, seed, filtered=True) for seed in range(SEEDS)])
    plain = _bake(subject, 0, filtered=False)
    covered, truth = subject.covered, reference.values
    mean = bakes.mean(axis=0)
    noise2 = bakes.var(axis=0, ddof=1)
    own2 = reference.noise**2
    error2 = np.mean((bakes - truth) ** 2, axis=0)
    _draw(scene, subject, reference, bakes[0] - truth, np.sqrt(noise2), mean - truth)
    return Left(
        scene,
        _root(((plain - truth) ** 2)[covered].mean() - own2),
        _root(error2[covered].mean() - own2),
        _root(noise2[covered].mean()),
        _root(((mean - truth) ** 2)[covered].mean() - own2 - noise2[covered].mean() / SEEDS),
        float(error2[_edges(truth, covered)].sum() / error2[covered].sum()),
    )


def _bake(subject: Subject, seed: int, *, filtered: bool) -> Doubles:
    values: Doubles = subject.bake(rays=RAYS, filtered=filtered, seed=seed).baked.maps["ao"].values.astype(np.float64)
    return values


def _root(square: float) -> float:
    return float(np.sqrt(max(square, 0.0)))


def _edges(truth: Any, covered: Flags) -> Flags:
    """The steepest texels."""
    steep = np.zeros(truth.shape)
    for axis in (0, 1):
        for step in (1, -1):
            beside = covered & np.roll(covered, step, axis)
            np.maximum(steep, np.where(beside, np.abs(np.roll(truth, step, axis) - truth), 0.0), out=steep)
    mask: Flags = covered & (steep > np.quantile(steep[covered], 1.0 - EDGES))
    return mask


def _draw(scene: str, subject: Subject, reference: Reference, error: Doubles, noise: Doubles, blur: Doubles) -> None:
    FOLDER.mkdir(parents=True, exist_ok=True)
    figure, axes = panels(1, 4, f"{scene}: what {RAYS} rays and the filter leave", 3.9)
    values = reference.values.astype(np.float64)
    for axis, image in zip(axes, (values, error, noise, blur), strict=True):
        low, high, colours = (0.0, 1.0, "gray") if image is values else (-SHOWN, SHOWN, "RdBu")
        axis.imshow(np.where(subject.covered, image, 0.0)[::-1], cmap=colours, vmin=low, vmax=high)
        axis.set_axis_off()
    save(figure, FOLDER / f"{scene}.png", colours=256)  # greys and two colours
