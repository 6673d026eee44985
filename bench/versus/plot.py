"""RMSE against seconds, a picture a scene and size."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

from matplotlib.figure import Figure

from ..pages import ROOT
from .bakers import CYCLES, CYCLES_DEFAULT, EMBREEX, ERRORS, OPEN3D, OURS_ERROR, OURS_RAYS
from .record import Record

FOLDER = ROOT / "docs" / "pictures" / "versus"
GOALS = {name: float(Fraction(name)) for name in ERRORS}
# Colours of Okabe and Ito, which stay apart in every common colour blindness; ours are full lines.
_LOOKS = {
    OURS_ERROR: ("#D55E00", "o-"),
    OURS_RAYS: ("#E69F00", "s-"),
    CYCLES: ("#0072B2", "^--"),
    CYCLES_DEFAULT: ("#0072B2", "*"),
    EMBREEX: ("#009E73", "v--"),
    OPEN3D: ("#CC79A7", "D--"),
}


def draw(record: Record) -> Path:
    """Both axes logarithmic; the RMSE without the reference's noise, which a dotted line shows."""
    figure = Figure(figsize=(7.0, 4.6), dpi=110, layout="constrained")
    axes = figure.add_subplot()
    for baker, (colour, look) in _LOOKS.items():
        if curve := record.curve(baker):
            axes.loglog(*zip(*curve, strict=True), look, color=colour, label=baker, markersize=5, linewidth=1.4)
    for name, goal in GOALS.items():
        axes.axhline(goal, color="0.85", linewidth=0.8, zorder=0)
        axes.annotate(name, (1.0, goal), xycoords=("axes fraction", "data"), fontsize=7, color="0.45", ha="right")
    axes.axhline(record.noise, color="0.6", linewidth=0.8, linestyle=":", zorder=0, label="noise of the reference")
    axes.set_xlabel("seconds")
    axes.set_ylabel("RMSE of the AO")
    axes.set_title(f"{record.scene}, {record.about['object']}, {record.size}x{record.size}", fontsize=10)
    axes.legend(fontsize=8, frameon=False)
    axes.spines[["top", "right"]].set_visible(False)
    FOLDER.mkdir(parents=True, exist_ok=True)
    path = FOLDER / f"{record.name}.png"
    figure.savefig(path)
    return path
