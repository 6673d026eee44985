"""The error against the number of rays, over many independent runs, by random numbers and by the shipped set."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...core.base.arrays import Doubles
from ...core.rays.map_spec import Sampler
from ...core.scene.scene import Instance
from ...tests.oracles.naive_estimators import one_ray_estimates
from ...tests.oracles.point import TEXELS, Point
from ...tests.oracles.shapes import patch
from ...tests.oracles.wall_and_open import SAMPLERS, Case, blockers, camera, cases

RAYS = [2**k for k in range(13)]
FIT_FROM = 64  # rays: below, most runs of the sphere have no ray at all inside the lobe of exponent 100
GROUPS = 8  # of runs, fitted apart: their spread is the slope's uncertainty
RANDOM_RAYS = 1 << 21  # of each case, cut into runs: 512 of 4096 rays, 2 million of one
SEEDS = 16  # of the shipped set; the texels of one are its runs
TILES = {n: 4 if n <= 256 else 1 for n in RAYS}  # along a side, of 8 x 8 texels: rare events need many short runs
SIDE = 2.0**-14  # of the shipped set's receiver: over it nothing changes
SETS = ("random", "shipped")


@dataclass(frozen=True, eq=False)
class Curve:
    """One estimator's measured error, arrays over `rays`. uncertainty: standard error of the rmse."""

    case: Case
    set: str
    rays: Doubles
    runs: Doubles
    rmse: Doubles
    uncertainty: Doubles
    slope: float
    slope_uncertainty: float

    @property
    def is_exact(self) -> bool:
        """Every run of every length gave the answer to the last bit."""
        return not self.rmse.any()

    def at(self, rays: int) -> float:
        """The rmse with so many rays."""
        return float(self.rmse[np.flatnonzero(self.rays == rays)[0]])


def measure() -> list[Curve]:
    """Both points, all cases, both sets."""
    curves = []
    for point in ("wall", "open"):
        curves += [random_curve(case, RANDOM_RAYS, seed) for seed, case in enumerate(cases(point))]
        curves += shipped_curves(cases(point), RAYS, range(SEEDS))
    return curves


def random_curve(case: Case, count: int, seed: int) -> Curve:
    """From `count` rays, cut into runs of every length."""
    estimates = one_ray_estimates(case, count, seed)
    return fitted(case, "random", RAYS, [estimates.reshape(-1, n).mean(axis=1)[:, None] for n in RAYS])


def shipped_curves(studied: Sequence[Case], rays: Sequence[int], seeds: Sequence[int]) -> list[Curve]:
    """From the bake's kernel: each texel is a run of its own, seeds are independent. studied: of one point."""
    estimates = [shipped_estimates(studied, n, seeds) for n in rays]
    return [fitted(case, "shipped", rays, [each[:, m] for each in estimates]) for m, case in enumerate(studied)]


def shipped_estimates(studied: Sequence[Case], rays: int, seeds: Iterable[int]) -> Doubles:
    """(seeds, cases, texels): the estimates of all texels on the floor, which is itself an occluder."""
    (point,) = {case.point for case in studied}
    floor = Instance("floor", patch(SIDE), np.eye(4))
    place = Point(floor, [floor, *blockers(point)], camera=camera(point), texels=TEXELS * TILES[rays])
    estimators = [case.estimator for case in studied]
    return np.array([place.values(estimators, rays, seed).reshape(len(studied), -1) for seed in seeds])


def fitted(case: Case, kind: str, rays: Sequence[int], estimates: Sequence[Doubles]) -> Curve:
    """estimates: for each number of rays (units, runs); units are independent of one another."""
    squared = [(each - case.exact) ** 2 for each in estimates]
    rmse = np.sqrt([each.mean() for each in squared])
    spread = [each.mean(axis=1).std(ddof=1) / np.sqrt(len(each)) for each in squared]
    uncertainty = np.divide(spread, 2 * rmse, out=np.zeros_like(rmse), where=rmse > 0)
    runs = np.array([each.size for each in squared])
    groups = [[np.sqrt(part.mean()) for part in np.array_split(each, GROUPS)] for each in squared]
    slopes = [slope_of(rays, group) for group in np.array(groups).T] if rmse.all() else [np.nan] * GROUPS
    slope = slope_of(rays, rmse) if rmse.all() else np.nan
    spread_of_slopes = float(np.std(slopes, ddof=1) / GROUPS**0.5)
    return Curve(case, kind, np.array(rays), runs, rmse, uncertainty, slope, spread_of_slopes)


def slope_of(rays: Sequence[int], rmse: Doubles | Sequence[float]) -> float:
    """Of a straight line through log rmse against log rays, by least squares from FIT_FROM rays on."""
    used = np.asarray(rays) >= FIT_FROM
    return float(np.polyfit(np.log(np.asarray(rays)[used]), np.log(np.asarray(rmse)[used]), 1)[0])


def curves_of(curves: Iterable[Curve], point: str, exponent: float, tilt: float) -> list[Curve]:
    """All estimators and both sets of one map at one point."""
    return [c for c in curves if (c.case.point, c.case.exponent, c.case.tilt) == (point, exponent, tilt)]


def curve_of(curves: Iterable[Curve], point: str, exponent: float, tilt: float, name: str, kind: str) -> Curve:
    """A single one."""
    return next(c for c in curves_of(curves, point, exponent, tilt) if c.case.name == name and c.set == kind)


# study.csv

COLUMNS = (
    *("point", "map", "exponent", "tilt_degrees", "estimator", "set", "rays", "runs", "exact", "sigma_of_one_ray"),
    *("rmse", "rmse_standard_error", "slope", "slope_standard_error"),
)


def write(curves: Iterable[Curve], path: Path) -> None:
    """A row for each number of rays; exact and sigma are computed, not measured."""
    with path.open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(COLUMNS)
        for curve in curves:
            case = curve.case
            head = (case.point, case.map, f"{case.exponent:g}", f"{case.tilt:g}", case.name, curve.set)
            slope = ("", "") if curve.is_exact else (f"{curve.slope:.4f}", f"{curve.slope_uncertainty:.4f}")
            for n, runs, rmse, spread in zip(curve.rays, curve.runs, curve.rmse, curve.uncertainty, strict=True):
                known = (f"{case.exact:.8f}", f"{case.sigma:.8f}")
                table.writerow((*head, n, runs, *known, f"{rmse:.6g}", f"{spread:.3g}", *slope))


def read(path: Path) -> list[Curve]:
    """The curves of a study.csv."""
    found: dict[tuple[Case, str], list[dict[str, str]]] = {}
    with path.open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            sampler = SAMPLERS.get(row["estimator"], Sampler.LOBE)
            case = Case(row["point"], float(row["exponent"]), float(row["tilt_degrees"]), sampler)
            found.setdefault((case, row["set"]), []).append(row)
    return [_curve(case, kind, rows) for (case, kind), rows in found.items()]


def _curve(case: Case, kind: str, rows: list[dict[str, str]]) -> Curve:
    over_rays = ("rays", "runs", "rmse", "rmse_standard_error")
    rays, runs, rmse, uncertainty = (np.array([float(row[name]) for row in rows]) for name in over_rays)
    slope, spread = (float(rows[0][name] or np.nan) for name in ("slope", "slope_standard_error"))
    return Curve(case, kind, rays, runs, rmse, uncertainty, slope, spread)
