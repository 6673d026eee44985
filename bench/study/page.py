"""README.md of the study, with its numbers taken from study.csv."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from textwrap import fill

import numpy as np

from ...core.base.errors import InputError
from ...tests.oracles.wall_and_open import DISTANCE, EDGE, HEIGHT, TILT, Case
from ..pages import filled
from .convergence import FIT_FROM, RANDOM_RAYS, RAYS, SETS, Curve, curve_of, curves_of, read

SPHERE, HEMISPHERE = "uniform sphere", "uniform hemisphere"
TARGET = 0.01
WALL = {"height": HEIGHT, "distance": DISTANCE, "edge": np.degrees(EDGE["wall"]), "tilt": TILT}
CONSTANTS = {**WALL, "target": TARGET, "random_rays": RANDOM_RAYS, "fit": (FIT_FROM, RAYS[-1])}


def write(folder: Path) -> None:
    """README.md from study.csv."""
    table = folder / "study.csv"
    if not table.exists():
        raise InputError(f"{table}: not there; run the part convergence first")
    (folder / "README.md").write_text(page(read(table)), encoding="utf-8")


def page(curves: Sequence[Curve]) -> str:
    """The whole page, Markdown."""
    lines = filled(
        __file__,
        **CONSTANTS,
        runs={kind: next((c.runs[0], c.runs[-1]) for c in curves if c.set == kind) for kind in SETS},
        **{point: list(_rows(curves, point)) for point in EDGE},
        **_one_ray(curves),
        **_ao(curves),
        **_ro(curves),
    )
    return _wrapped("\n".join(lines)) + "\n"


def _wrapped(text: str) -> str:
    """Plain paragraphs broken into lines anew, now that the numbers are in."""
    blocks = text.split("\n\n")
    plain = [not block.startswith(("#", "|", "-", "!", " ")) for block in blocks]
    return "\n\n".join(
        fill(block, 118, break_long_words=False, break_on_hyphens=False) if flows else block
        for block, flows in zip(blocks, plain, strict=True)
    )


def _one_ray(curves: Sequence[Curve]) -> dict[str, object]:
    """How far one ray's measured spread is from theory, in standard errors."""
    measured = [c for c in curves if c.set == "random" and not c.is_exact]
    away = [float(abs(c.rmse[0] - c.case.sigma) / c.uncertainty[0]) for c in measured]
    return {"agreeing": len(away), "farthest": max(away)}


def _ao(curves: Sequence[Curve]) -> dict[str, object]:
    sphere, cosine = (curve_of(curves, "wall", 1.0, 0.0, name, "random") for name in (SPHERE, "cosine"))
    shipped = curve_of(curves, "wall", 1.0, 0.0, "cosine", "shipped")
    smooth = curve_of(curves, "open", 1.0, 0.0, HEMISPHERE, "shipped")
    times = sphere.case.sigma / cosine.case.sigma
    return {
        "ao_slopes": ", ".join(_signed(c.slope) for c in curves_of(curves, "wall", 1.0, 0.0) if c.set == "random"),
        "sphere_to_cosine": times,
        "sphere_to_cosine_rays": times**2,
        "cosine_slope": _with_error(shipped),
        "smooth_slope": _with_error(smooth),
        "rays_needed": tuple(_rays_for(curve) for curve in (sphere, cosine, shipped)),
    }


def _ro(curves: Sequence[Curve]) -> dict[str, object]:
    sphere = {kind: curve_of(curves, "wall", 100.0, 0.0, SPHERE, kind) for kind in SETS}
    lobe = curve_of(curves, "wall", 100.0, 0.0, "lobe", "random")
    low = [curve_of(curves, "open", 100.0, TILT["open"], name, "random").case.sigma for name in (SPHERE, "lobe")]
    slopes = [c.slope for c in curves if c.case.name == "lobe" and c.set == "shipped" and not c.is_exact]
    times = sphere["random"].case.sigma / lobe.case.sigma
    return {
        "sphere_to_lobe": times,
        "sphere_to_lobe_rays": times**2,
        "leaning_rays": (low[0] / low[1]) ** 2,
        "lobe_slopes": (_signed(max(slopes)), _signed(min(slopes))),
        "lobe_cases": len(slopes),
        "sphere_at_64": {kind: curve.at(64) for kind, curve in sphere.items()},
        "sphere_at_128": sphere["shipped"].at(128),
        "sphere_slope": _signed(sphere["shipped"].slope),
        "lobe": lobe.case,
        "lobe_at_64": lobe.at(64),
    }


def _rows(curves: Sequence[Curve], point: str) -> Iterator[tuple[Case, str, str]]:
    """The case, R, and what was measured of it."""
    for random in (c for c in curves if c.case.point == point and c.set == "random"):
        case = random.case
        shipped = curve_of(curves, point, case.exponent, case.tilt, case.name, "shipped")
        cells = ["0", "exact", "exact", "0", "0"]
        if not (random.is_exact and shipped.is_exact):
            cells = [f"{random.rmse[0]:.5f} ± {random.uncertainty[0]:.5f}", _with_error(random), _with_error(shipped)]
            cells += [f"{random.at(64):.4f}", f"{shipped.at(64):.4f}"]
        yield case, "" if case.map == "AO" else f"{case.tilt:g}°" if case.tilt else "N", " | ".join(cells)


def _rays_for(curve: Curve) -> str:
    """How many rays bring the error to TARGET: random ones by theory, the shipped set between measured numbers."""
    if curve.set == "random":
        return f"{(curve.case.sigma / TARGET) ** 2:,.0f}"
    return f"{np.exp(np.interp(-np.log(TARGET), -np.log(curve.rmse), np.log(curve.rays))):,.0f}"


def _with_error(curve: Curve) -> str:
    return f"{curve.slope:.3f} ± {curve.slope_uncertainty:.3f}".replace("-", "\N{MINUS SIGN}")


def _signed(value: float) -> str:
    return f"{value:.2f}".replace("-", "\N{MINUS SIGN}")
