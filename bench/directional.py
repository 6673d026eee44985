"""RO of any view from what a bake can keep of a texel: codes beside what engines make of AO and bent normals.

python -m occlusion_bake.bench.directional [SCENE...] [--points N] [--models DIR]

Truth is the sum over 16,384 rays of a point, one in each of 128 x 128 cells of equal solid angle, weighted by the lobe;
the cells that codes are made of hold 64 of the same rays each, so that there is next to no noise in the errors. Views
have n·v from 0.15 to 1. Prints RMSE of each scene by exponent, and of all of them by exponent, by view and by scene.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from ..addon.cli.hard_exit import run_and_exit
from ..core.base.arrays import Doubles, Floats
from ..core.spherical.directional_format import DirectionalFormat, encode, from_images, named_format, rebuild, to_images
from ..core.spherical.hemisphere_cells import check_cells, integrals
from ..samples.bench_scenes import of_one_surface
from ..tests.oracles.engine_formulas import FORMULAS, Formula
from ..tests.oracles.seen_rays import seen_by
from .pages import MODELS
from .subject import prepare
from .tables import table

EXPONENTS = (2.0, 10.0, 32.0, 100.0)
CODES = tuple(map(named_format, ("sh_2", "sh_3", "sh_4", "sh_6", "mask_8", "mask_16", "cells_8", "cells_16")))
IN_BYTES = named_format("sh_3")  # also as RGBA images of 8 bits
POINTS, VIEWS = 300, 48
EDGES = (0.15, 0.35, 0.55, 0.75, 1.0)  # of the bands of n·v
CLOSER = (10.0, 32.0)  # exponents of the tables by view and by scene
BY_VIEW = ("AO as it is", "AO by Lagarde's formula", "AO and bent normal, cones (Jimenez et al.)", "sh_3", "mask_16")
BY_SCENE = ("sh_3", "mask_16")
_SIZE = 256  # texels a side of the image whose texels are drawn

RO = Callable[[Doubles, float], Doubles]  # (V, 3) views in the texels' frames and an exponent → (N, V) RO
Errors = dict[str, Doubles]  # mean squared errors by what is kept, each (E, V) by exponent and view


def views(count: int = VIEWS) -> Doubles:
    """(count, 3) reflected directions, n·R = n·v evenly from 0.15 to 1, by the golden angle about the normal."""
    cosines = np.linspace(0.15, 1.0, count)
    turns = np.arange(count) * np.pi * (3.0 - np.sqrt(5.0))
    sines = np.sqrt(1.0 - cosines**2)
    return np.stack([sines * np.cos(turns), sines * np.sin(turns), cosines], axis=1)


def errors(cells: Floats, truth: RO) -> Errors:
    """Means over N texels. cells: (N, 16, 16) mean visibilities, which may be noisy; truth: theirs."""
    check_cells(cells)
    looked = views()
    true = [(exponent, truth(looked, exponent)) for exponent in EXPONENTS]
    return {
        name: np.stack([np.mean((estimate(looked, each) - ro) ** 2, axis=0) for each, ro in true])
        for name, estimate in _estimates(cells)
    }


def _estimates(cells: Floats) -> Iterator[tuple[str, RO]]:
    for name, formula in FORMULAS.items():
        yield name, _from_means(cells, formula)
    for code in CODES:
        values = encode(cells, code)
        yield code.name, _from_code(values, code)
        if code == IN_BYTES:
            stored = from_images(to_images(values[None], code, 8), code)[0]
            yield f"{code.name}, RGBA images of 8 bits", _from_code(stored, code)


def _from_code(values: Floats, code: DirectionalFormat) -> RO:
    def estimate(looked: Doubles, exponent: float) -> Doubles:
        repeated = (np.repeat(view[None], len(values), axis=0) for view in looked)
        return np.stack([rebuild(values, code, each, exponent) for each in repeated], axis=1).astype(np.float64)

    return estimate


def _from_means(cells: Floats, formula: Formula) -> RO:
    """A formula of AO and the bent normal: V cos θ over π, and the mean of V times the direction, at unit length."""
    vectors = cells.reshape(len(cells), -1) @ integrals(lambda ways: ways, cells.shape[1])
    ao = vectors[:, 2:] / np.pi
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    bent = np.where(length > 0.0, vectors / np.maximum(length, 1e-12), (0.0, 0.0, 1.0))
    return lambda looked, exponent: formula(ao, bent, looked, exponent)


def pooled(found: Sequence[Errors]) -> Errors:
    """Means over several sets of as many texels."""
    return {name: np.mean([one[name] for one in found], axis=0) for name in found[0]}


def rmse(squares: Doubles, exponent: float, band: int | None = None) -> float:
    """Over all views, or those of one band of n·v, the lowest first."""
    of_view = squares[EXPONENTS.index(exponent)]
    if band is not None:
        of_view = of_view[np.digitize(views(len(of_view))[:, 2], EDGES[1:-1]) == band]
    return float(np.sqrt(of_view.mean()))


def by_exponent(found: Errors) -> list[str]:
    """Lines of a page: RMSE over all views."""
    rows = [(name, *(f"{rmse(squares, each):.4f}" for each in EXPONENTS)) for name, squares in found.items()]
    return table(["kept of a texel", *(f"exponent {each:g}" for each in EXPONENTS)], rows)


def by_view(found: Errors) -> list[str]:
    """Lines of a page: RMSE at CLOSER's exponents, in each band of n·v."""
    bands = range(len(EDGES) - 1)
    rows = [(name, *(_closer(found[name], band) for band in bands)) for name in BY_VIEW]
    return table(["kept of a texel", *(f"n·v {EDGES[each]:g} to {EDGES[each + 1]:g}" for each in bands)], rows)


def by_scene(found: Mapping[str, Errors]) -> list[str]:
    """Lines of a page: RMSE at CLOSER's exponents, of each scene."""
    rows = [(f"`{scene}`", *(_closer(one[name]) for name in BY_SCENE)) for scene, one in found.items()]
    return table(["scene", *BY_SCENE], rows)


def _closer(squares: Doubles, band: int | None = None) -> str:
    return ", ".join(f"{rmse(squares, each, band):.4f}" for each in CLOSER)


def main(arguments: Sequence[str]) -> int:
    """The command."""
    parser = argparse.ArgumentParser("python -m occlusion_bake.bench.directional", description="RO of any view.")
    parser.add_argument("scenes", nargs="*", metavar="SCENE", help="which (all that are there)")
    parser.add_argument("--points", type=int, default=POINTS, help=f"texels of each scene ({POINTS})")
    parser.add_argument("--models", type=Path, default=MODELS, help="folder of .obj models")
    chosen = parser.parse_args(arguments)
    found, known = {}, of_one_surface(chosen.models)
    for unknown in (name for name in chosen.scenes if name not in known):
        parser.error(f"{unknown}: no such scene; there are {', '.join(known)}")
    for name in chosen.scenes or known:
        subject = prepare(name, _SIZE, chosen.models)
        seen = seen_by(subject.scene, subject.owner, chosen.points)
        found[name] = errors(seen.cells, seen.truth)
        _say(name, by_exponent(found[name]))
    everything = pooled(list(found.values()))
    at = f"at exponents {' and '.join(f'{each:g}' for each in CLOSER)}"
    _say("All", by_exponent(everything))
    _say(f"By view, {at}", by_view(everything))
    _say(f"By scene, {at}", by_scene(found))
    return 0


def _say(title: str, lines: Sequence[str]) -> None:
    print("\n".join([f"## {title}", "", *lines, ""]), flush=True)


if __name__ == "__main__":
    run_and_exit(main)
