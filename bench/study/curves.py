"""The plots of error against rays."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from ...tests.oracles.wall_and_open import EXPONENTS, TILT
from ..plots import COLOURS, panels, rays_on, save
from .convergence import FIT_FROM, RAYS, Curve, curve_of, curves_of, measure, read, write

NOTE = "dashed: independent random numbers; solid: the shipped set; grey: the range of the fit"
PLACES = {"wall": "Beside the wall", "open": "In the open"}
TITLES = {
    "ao": "AO: the cosine's rays err least, and the shipped set gains more from each",
    "wall": "RO beside the wall: sphere rays waste themselves, the more the narrower the lobe",
    "open": "RO in the open: a lobe ray is exact only where the floor does not cut the lobe",
}


def draw(folder: Path) -> None:
    """Measure study.csv; convergence_ao.png, convergence_ro_wall.png, convergence_ro_open.png."""
    write(measure(), folder / "study.csv")
    draw_curves(read(folder / "study.csv"), folder)


def draw_curves(curves: Sequence[Curve], folder: Path) -> None:
    """The plots alone."""
    figure, axes = panels(1, 2, TITLES["ao"], 4.8)
    for axis, point in zip(axes, PLACES, strict=True):
        here = curves_of(curves, point, 1.0, 0.0)
        finding = "one cosine ray is exact" if point == "open" else _steepest(here)
        _panel(axis, here, f"{PLACES[point]}, AO = {here[0].case.exact:.3f}:\n{finding}")
    save(figure, folder / "convergence_ao.png", NOTE)
    for point in PLACES:
        _draw_ro(curves, point, folder / f"convergence_ro_{point}.png")


def _draw_ro(curves: Sequence[Curve], point: str, path: Path) -> None:
    figure, axes = panels(2, 2, TITLES[point], 4.3)
    places = [(exponent, tilt) for exponent in EXPONENTS for tilt in (0.0, TILT[point])]
    for axis, (exponent, tilt) in zip(axes, places, strict=True):
        here = curves_of(curves, point, exponent, tilt)
        where = "R = N" if tilt == 0 else f"R leans {tilt:g}°"
        sphere, lobe = (curve_of(here, point, exponent, tilt, name, "random") for name in ("uniform sphere", "lobe"))
        finding = "one lobe ray is exact"
        if not lobe.is_exact:
            finding = f"a lobe ray errs {sphere.case.sigma / lobe.case.sigma:.2g} times less than a sphere ray"
        _panel(axis, here, f"Exponent {exponent:g}, {where}, RO = {here[0].case.exact:.3f}:\n{finding}")
    save(figure, path, NOTE)


def _steepest(here: Sequence[Curve]) -> str:
    slopes = {kind: np.mean([c.slope for c in here if c.set == kind]) for kind in ("random", "shipped")}
    return _signed(f"slopes near {slopes['random']:.2f} random, {slopes['shipped']:.2f} shipped")


def _signed(text: str) -> str:
    return text.replace("-", "\N{MINUS SIGN}")


def _panel(axis: Axes, here: Sequence[Curve], title: str) -> None:
    axis.set(xscale="log", yscale="log", xlabel="rays N", ylabel="RMSE", title=title, xlim=(0.8, 1.25 * RAYS[-1]))
    axis.axvspan(FIT_FROM, RAYS[-1], color="#f6f6f6", zorder=0)
    drawn = [curve for curve in here if not curve.is_exact]
    floor = 10.0 ** np.floor(np.log10(0.6 * min(float(curve.rmse.min()) for curve in drawn)))
    axis.set_ylim(floor, 2.0 * max(float(curve.rmse.max()) for curve in here))
    for curve in drawn:
        _line(axis, curve)
    for curve in [curve for curve in here if curve.is_exact][:1]:
        _exact(axis, curve, floor)
    rays_on(axis)
    axis.legend(loc="lower left", handlelength=2.6, title="slope", title_fontsize=8.5, alignment="left")


def _line(axis: Axes, curve: Curve) -> None:
    look: dict[str, Any] = {"marker": "s"}
    if curve.set == "random":
        look = {"linestyle": "--", "marker": "o", "markerfacecolor": "white"}
    label = _signed(f"{curve.case.name}, {curve.set}: {curve.slope:.2f}")
    colour = COLOURS[curve.case.name]
    axis.plot(curve.rays, curve.rmse, color=colour, markersize=3.2, linewidth=1.4, label=label, **look)


def _exact(axis: Axes, curve: Curve, floor: float) -> None:
    colour = COLOURS[curve.case.name]
    axis.plot(curve.rays, np.full(len(curve.rays), floor), "v", color=colour, markersize=7, clip_on=False, zorder=5)
    axis.plot([], [], "v", color=colour, label=f"{curve.case.name}, both sets: exact")
    axis.annotate(
        "exact", (curve.rays[-2], floor), (0, 9), textcoords="offset points", color=colour, ha="center", weight="bold"
    )
