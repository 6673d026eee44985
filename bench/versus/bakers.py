"""The bakers, each with its settings from coarse to fine."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from importlib import import_module

import numpy as np

from ...core.base.arrays import Flags, Floats
from ..cycles import bake_at_defaults, bake_cycles
from ..subject import Subject
from .script_baker import MOST_TRIANGLES, Open, bake_by_script, embreex_query, open3d_query

OURS_ERROR, OURS_RAYS = "ours to an error", "ours plain"
CYCLES, CYCLES_DEFAULT, EMBREEX, OPEN3D = "Cycles", "Cycles at its defaults", "embreex", "Open3D"
OURS, PEERS = (OURS_ERROR, OURS_RAYS), (CYCLES, EMBREEX, OPEN3D)
DEFAULTS = "adaptive"  # the one setting of Cycles at its defaults


@dataclass(frozen=True, eq=False)
class Outcome:
    """One bake. values: (H, W) float32. covered: (H, W) bool, the texels to compare. error, p99: what it says of
    itself. rays: of all texels."""

    seconds: float
    values: Floats
    covered: Flags
    error: float | None = None
    p99: float | None = None
    rays: int | None = None


@dataclass(frozen=True)
class Baker:
    """bake: subject, setting, seed → outcome. cost: how much work a setting is, to others of the same baker."""

    name: str
    settings: tuple[str, ...]
    bake: Callable[[Subject, str, int], Outcome]
    cost: Callable[[str], float] = float


def bakers(quick: bool) -> list[Baker]:
    """All, or with fewer settings each for a quick run."""
    fours = tuple(str(4**power) for power in range(6))
    errors = ("1/50", "1/100", "1/255", "1/510")
    made = [
        Baker(OURS_ERROR, errors, _ours, lambda setting: float(Fraction(setting)) ** -1.5),
        Baker(OURS_RAYS, fours[:5] if quick else fours, _ours),
        Baker(CYCLES, fours[:4] if quick else fours, _cycles),
        Baker(EMBREEX, fours[: 4 if quick else 5], partial(_script, embreex_query, None)),
        Baker(OPEN3D, fours[: 4 if quick else 5], partial(_script, open3d_query, 1)),  # it has threads of its own
    ]
    return made if quick else [*made, Baker(CYCLES_DEFAULT, (DEFAULTS,), _cycles, lambda _: 1.0)]


def refusal(baker: Baker, subject: Subject) -> str | None:
    """Why a baker cannot bake a subject."""
    module = {EMBREEX: "embreex", OPEN3D: "open3d"}.get(baker.name)
    if module is None:
        return None
    try:
        import_module(module)
    except ImportError as problem:  # it, or a library of the system's that it wants
        return f"{module} cannot be loaded: {problem}"
    if subject.triangles > MOST_TRIANGLES:
        return f"it knows no instances, and flat the scene has {subject.triangles:,} triangles"
    return None


def _ours(subject: Subject, setting: str, seed: int) -> Outcome:
    """To an error, as 1/255, or plain with so many rays."""
    goal = {"error": float(Fraction(setting))} if "/" in setting else {"rays": int(setting), "filtered": False}
    made = subject.bake(with_files=True, seed=seed, **goal)
    ao = made.baked.maps["ao"]
    return Outcome(made.seconds, ao.values, ao.covered & subject.covered, ao.error, ao.p99, made.baked.rays)


def _cycles(subject: Subject, setting: str, seed: int) -> Outcome:
    if setting == DEFAULTS:
        baked = bake_at_defaults(subject.name, subject.size, seed)
    else:
        baked = bake_cycles(subject.name, subject.size, int(setting), seed)
    return Outcome(baked.seconds, baked.values, baked.coverage & subject.same)


def _script(query: Open, threads: int | None, subject: Subject, setting: str, seed: int) -> Outcome:
    rays = int(setting)
    seconds, values, covered = bake_by_script(subject.name, subject.size, rays, seed, query, threads)
    return Outcome(seconds, values, covered & subject.covered, rays=rays * int(np.count_nonzero(covered)))
