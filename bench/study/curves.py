"""The plots of error against rays."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from . import style
from .cases import EXPONENTS, TILT
from .convergence import FIT_FROM, RAYS, Curve
from .figures import Figures

NOTE = "dashed: independent random numbers; solid: the shipped set; grey: the range of the fit"

PLACES = {"wall": "beside the wall", "open": "in the open"}


def draw(curves: Sequence[Curve], folder: Path) -> None:
    """convergence_ao.png, convergence_ro_wall.png, convergence_ro_open.png."""
    found = Figures(curves)
    _draw_ao(found, folder / "convergence_ao.png")
    for point in ("wall", "open"):
        _draw_ro(found, point, folder / f"convergence_ro_{point}.png")


def _draw_ao(found: Figures, path: Path) -> None:
    figure, axes = style.panels(1, 2, "AO: the cosine's rays err least, and the shipped set gains more from each", 4.8)
    for axis, point in zip(axes, ("wall", "open"), strict=True):
        here = found.of(point, 1.0, 0.0)
        finding = "one cosine ray is exact" if point == "open" else _steepest(here)
        _panel(axis, here, f"{PLACES[point].capitalize()}, AO = {here[0].case.exact:.3f}:\n{finding}")
    style.save(figure, path, NOTE)


def _draw_ro(found: Figures, point: str, path: Path) -> None:
    title = {
        "wall": "RO beside the wall: sphere rays waste themselves, the more the narrower the lobe",
        "open": "RO in the open: a lobe ray is exact only where the floor does not cut the lobe",
    }[point]
    figure, axes = style.panels(2, 2, title, 4.3)
    places = [(exponent, tilt) for exponent in EXPONENTS for tilt in (0.0, TILT[point])]
    for axis, (exponent, tilt) in zip(axes, places, strict=True):
        here = found.of(point, exponent, tilt)
        where = "R = N" if tilt == 0 else f"R leans {tilt:g}°"
        sphere, lobe = (found.one(point, exponent, tilt, name, "random") for name in ("uniform sphere", "lobe"))
        gain = sphere.case.sigma / lobe.case.sigma if lobe.case.sigma else 0.0
        finding = (
            "one lobe ray is exact" if lobe.is_exact else f"a lobe ray errs {gain:.2g} times less than a sphere ray"
        )
        _panel(axis, here, f"Exponent {exponent:g}, {where}, RO = {here[0].case.exact:.3f}:\n{finding}")
    style.save(figure, path, NOTE)


def _steepest(here: Sequence[Curve]) -> str:
    slopes = {kind: np.mean([c.slope for c in here if c.set == kind]) for kind in ("random", "shipped")}
    return signed(f"slopes near {slopes['random']:.2f} random, {slopes['shipped']:.2f} shipped")


def signed(text: str) -> str:
    """With a real minus sign."""
    return text.replace("-", "\N{MINUS SIGN}")


def _panel(axis: Axes, here: Sequence[Curve], title: str) -> None:
    axis.set(xscale="log", yscale="log", xlabel="rays N", ylabel="RMSE", title=title, xlim=(0.8, 1.25 * RAYS[-1]))
    axis.axvspan(FIT_FROM, RAYS[-1], color="#f6f6f6", zorder=0)
    lowest = min(float(c.rmse.min()) for c in here if not c.is_exact)
    highest = max(float(c.rmse.max()) for c in here)
    floor = 10.0 ** np.floor(np.log10(lowest * 0.6))
    axis.set_ylim(floor, 2.0 * highest)
    exact = [c for c in here if c.is_exact]
    for curve in here:
        if not curve.is_exact:
            _line(axis, curve)
    if exact:
        _exact(axis, exact[0], floor)
    style.rays_on(axis)
    axis.legend(loc="lower left", handlelength=2.6, title="slope", title_fontsize=8.5, alignment="left")


def _line(axis: Axes, curve: Curve) -> None:
    label = signed(f"{curve.case.name}, {curve.set}: {curve.slope:.2f}")
    axis.plot(
        curve.rays,
        curve.rmse,
        style.LINES[curve.set],
        color=style.COLOURS[curve.case.name],
        marker=style.MARKS[curve.set],
        markersize=3.2,
        markerfacecolor="white" if curve.set == "random" else None,
        linewidth=1.4,
        label=label,
    )


def _exact(axis: Axes, curve: Curve, floor: float) -> None:
    colour = style.COLOURS[curve.case.name]
    axis.plot(curve.rays, np.full(len(curve.rays), floor), "v", color=colour, markersize=7, clip_on=False, zorder=5)
    axis.plot([], [], "v", color=colour, label=f"{curve.case.name}, both sets: exact")
    axis.annotate(
        "exact", (curve.rays[-2], floor), (0, 9), textcoords="offset points", color=colour, ha="center", weight="bold"
    )
