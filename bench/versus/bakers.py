"""The bakers, each with its settings from coarse to fine."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from importlib import import_module

import numpy as np

from ...core.base.arrays import Flags, Floats
from ...core.rays.map_spec import AO, MapSpec
from ..cycles import DEFAULT_SAMPLES, at_defaults, bake_cycles, bake_cycles_from
from ..subject import Subject, textures_of
from .script_baker import MOST_TRIANGLES, Open, bake_by_script, embreex_query, open3d_query

OURS_ERROR, OURS_RAYS = "ours to an error", "ours plain"
CYCLES, CYCLES_DEFAULT, EMBREEX, OPEN3D = "Cycles", "Cycles at its defaults", "embreex", "Open3D"
OURS, PEERS = (OURS_ERROR, OURS_RAYS), (CYCLES, EMBREEX, OPEN3D)
DEFAULTS = "adaptive"  # the one setting of Cycles at its defaults
# As the command calls them.
WORDS = {
    "ours": OURS_ERROR,
    "plain": OURS_RAYS,
    "cycles": CYCLES,
    "defaults": CYCLES_DEFAULT,
    "embreex": EMBREEX,
    "open3d": OPEN3D,
}
_FOURS = tuple(str(4**power) for power in range(6))


@dataclass(frozen=True, eq=False)
class Outcome:
    """One bake. values: (N * size, size) float32. covered: of the same shape, bool, the texels to compare. error, p99:
    what it says of itself. rays: of all texels."""

    seconds: float
    values: Floats
    covered: Flags
    error: float | None = None
    p99: float | None = None
    rays: int | None = None


@dataclass(frozen=True)
class Baker:
    """bake: subject, setting, seed → outcome. cost: how much work a setting is, to others of the same baker. further:
    settings that are gone on with, finer and finer, until an RMSE is at most `until`."""

    name: str
    settings: tuple[str, ...]
    bake: Callable[[Subject, str, int], Outcome]
    cost: Callable[[str], float] = float
    further: tuple[str, ...] = ()
    until: float = 0.0


ERRORS = ("1/50", "1/100", "1/255", "1/510")
FURTHER = ("512", "1024", "2048", "4096")


def bakers(spec: MapSpec, settings: Callable[[str], tuple[str, ...]]) -> list[Baker]:
    """All that have the map. settings: of a baker, by its name."""
    ours = [
        Baker(OURS_ERROR, settings(OURS_ERROR), partial(_ours, spec), lambda setting: float(Fraction(setting)) ** -1.5),
        Baker(OURS_RAYS, settings(OURS_RAYS), partial(_ours, spec)),
    ]
    if spec != AO:
        return ours
    return [
        *ours,
        Baker(CYCLES, settings(CYCLES), _cycles),
        Baker(EMBREEX, settings(EMBREEX), partial(_script, embreex_query, None)),
        Baker(OPEN3D, settings(OPEN3D), partial(_script, open3d_query, 1)),  # it has threads of its own
        Baker(CYCLES_DEFAULT, settings(CYCLES_DEFAULT), _cycles, lambda _: 1.0),
    ]


def settings_of(baker: str) -> tuple[str, ...]:
    """Those of the page."""
    return {OURS_ERROR: ERRORS, CYCLES_DEFAULT: (DEFAULTS,), EMBREEX: _FOURS[:5], OPEN3D: _FOURS[:5]}.get(baker, _FOURS)


def quick_settings_of(baker: str) -> tuple[str, ...]:
    """Fewer, for a quick run."""
    return {OURS_ERROR: ERRORS, CYCLES_DEFAULT: (), OURS_RAYS: _FOURS[:5]}.get(baker, _FOURS[:4])


def refusal(baker: Baker, subject: Subject) -> str | None:
    """Why a baker cannot bake a subject."""
    module = {EMBREEX: "embreex", OPEN3D: "open3d"}.get(baker.name)
    if module is None:
        return None
    if subject.highs:
        return "a script that bakes a low mesh from a high one would first have to find the points"
    try:
        import_module(module)
    except ImportError as problem:  # it, or a library of the system's that it wants
        return f"{module} cannot be loaded: {problem}"
    if subject.triangles > MOST_TRIANGLES:
        return f"it knows no instances, and flat the scene has {subject.triangles:,} triangles"
    return None


def _ours(spec: MapSpec, subject: Subject, setting: str, seed: int) -> Outcome:
    """To an error, as 1/255, or plain with so many rays."""
    goal = {"error": float(Fraction(setting))} if "/" in setting else {"rays": int(setting), "filtered": False}
    made = subject.bake(spec, with_files=True, seed=seed, **goal)
    found = textures_of(made, spec)
    return Outcome(made.seconds, found.values, found.covered & subject.covered, found.error, found.p99, found.rays)


def _cycles(subject: Subject, setting: str, seed: int) -> Outcome:
    """Object by object, as a script of an artist's goes through them; the seconds of all."""
    samples, size = DEFAULT_SAMPLES if setting == DEFAULTS else int(setting), subject.size
    with at_defaults() if setting == DEFAULTS else nullcontext():
        if subject.highs:
            bakes = [bake_cycles_from(subject.highs, subject.scene, size, samples, seed)]
        else:
            bakes = [bake_cycles(name, size, samples, seed) for name in subject.names]
    values = np.concatenate([each.values for each in bakes])
    covered = np.concatenate([each.coverage for each in bakes]) & subject.same
    return Outcome(sum(each.seconds for each in bakes), values, covered)


def _script(query: Open, threads: int | None, subject: Subject, setting: str, seed: int) -> Outcome:
    rays = int(setting)
    seconds, values, covered = bake_by_script(subject.names, subject.size, rays, seed, query, threads)
    return Outcome(seconds, values, covered & subject.covered, rays=rays * int(np.count_nonzero(covered)))
