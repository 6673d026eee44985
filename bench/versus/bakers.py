"""The bakers, each with its settings from coarse to fine."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ...addon.compare.cycles import CyclesBake, CyclesSettings, bake_ao
from ...core.base.arrays import Floats
from ...core.settings import Settings
from ...tests.oracles.settings import flat_settings
from ..ours import bake_here
from .cycles import bake_at_defaults
from .naive import MOST_TRIANGLES, Open, bake_naive, embreex_query, open3d_query, threads_of
from .subject import Subject

OURS_ERROR, OURS_RAYS = "ours to an error", "ours plain"
CYCLES, CYCLES_DEFAULT, EMBREEX, OPEN3D = "Cycles", "Cycles at its defaults", "embreex", "Open3D"
OURS, PEERS = (OURS_ERROR, OURS_RAYS), (CYCLES, EMBREEX, OPEN3D)
DEFAULTS = "adaptive"  # the one setting of Cycles at its defaults


@dataclass(frozen=True, eq=False)
class Shot:
    """One bake. values: (H, W) float32. covered: (H, W) bool, the texels to compare. error, p99: what it says of
    itself. rays: of all texels."""

    seconds: float
    values: Floats
    covered: NDArray[np.bool_]
    error: float | None = None
    p99: float | None = None
    rays: int | None = None


@dataclass(frozen=True)
class Baker:
    """bake: subject, setting, seed → a shot. cost: how much work a setting is, to others of the same baker."""

    name: str
    settings: tuple[str, ...]
    bake: Callable[[Subject, str, int], Shot]
    cost: Callable[[str], float]


def bakers(quick: bool) -> list[Baker]:
    """All, or with fewer settings each for a quick run."""
    fours = [str(4**power) for power in range(6)]
    errors = ("1/50", "1/100", "1/255", "1/510")
    cycles, plain, naive = (fours[:4], fours[:5], fours[:4]) if quick else (fours, fours, fours[:5])
    made = [
        Baker(OURS_ERROR, errors, _ours_error, lambda setting: float(Fraction(setting)) ** -1.5),
        Baker(OURS_RAYS, tuple(plain), _ours_rays, float),
        Baker(CYCLES, tuple(cycles), _cycles, float),
        Baker(EMBREEX, tuple(naive), _naive("embreex", embreex_query), float),
        Baker(OPEN3D, tuple(naive), _naive("open3d", open3d_query), float),
    ]
    return made if quick else [*made, Baker(CYCLES_DEFAULT, (DEFAULTS,), _defaults, lambda _: 1.0)]


def refusal(baker: Baker, subject: Subject) -> str | None:
    """Why a baker cannot bake a subject."""
    module = {EMBREEX: "embreex", OPEN3D: "open3d"}.get(baker.name)
    if module is None:
        return None
    if find_spec(module) is None:
        return f"{module} is not installed"
    try:
        import_module(module)
    except ImportError as problem:  # a library of the system's that it wants
        return f"{module} cannot be loaded: {problem}"
    if subject.triangles > MOST_TRIANGLES:
        return f"it knows no instances, and flat the scene has {subject.triangles:,} triangles"
    return None


def _ours_error(subject: Subject, setting: str, seed: int) -> Shot:
    error = float(Fraction(setting))
    return _ours(subject, flat_settings(width=subject.size, height=subject.size, error=error, margin=0, seed=seed))


def _ours_rays(subject: Subject, setting: str, seed: int) -> Shot:
    size = subject.size
    return _ours(
        subject, flat_settings(width=size, height=size, rays=int(setting), filtered=False, margin=0, seed=seed)
    )


def _ours(subject: Subject, settings: Settings) -> Shot:
    with tempfile.TemporaryDirectory() as folder:
        seconds, results, _ = bake_here([subject.name], settings, Path(folder))
    baked = results[0][1]
    each = baked.maps["ao"]
    return Shot(seconds, each.values, each.covered & subject.covered, each.error, each.p99, baked.rays)


def _cycles(subject: Subject, setting: str, seed: int) -> Shot:
    how = CyclesSettings((subject.size, subject.size), int(setting), None, os.cpu_count() or 1, seed)
    return _of_cycles(subject, bake_ao(bpy.context, subject.name, how))


def _defaults(subject: Subject, setting: str, seed: int) -> Shot:
    return _of_cycles(subject, bake_at_defaults(subject.name, subject.size, seed))


def _of_cycles(subject: Subject, baked: CyclesBake) -> Shot:
    return Shot(baked.seconds, baked.values, baked.coverage & subject.same)


def _naive(binding: str, query: Open) -> Callable[[Subject, str, int], Shot]:
    def bake(subject: Subject, setting: str, seed: int) -> Shot:
        rays = int(setting)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "ao.png"
            seconds, values, covered = bake_naive(
                subject.name, subject.size, rays, seed, path, query, threads_of(binding)
            )
        return Shot(seconds, values, covered & subject.covered, rays=rays * int(np.count_nonzero(covered)))

    return bake
