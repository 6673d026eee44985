"""How plots look: little ink (plots.mplstyle), titles that say what is found, few colours in the file."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator
from PIL import Image

INK = "#333333"
COLOURS = {"uniform sphere": "#d95f02", "uniform hemisphere": "#7570b3", "cosine": "#1b9e77", "lobe": "#1b9e77"}
plt.style.use(Path(__file__).with_suffix(".mplstyle"))


def panels(rows: int, columns: int, title: str, height: float) -> tuple[Figure, list[Axes]]:
    """A figure of equal panels, row by row, under a title that says what is found."""
    size = (4.9 * columns if columns < 3 else 3.6 * columns, height * rows)
    figure, axes = plt.subplots(rows, columns, figsize=size, layout="constrained", squeeze=False)
    figure.suptitle(title, x=0.01, ha="left")
    return figure, list(axes.ravel())


def save(figure: Figure, path: Path, note: str = "", colours: int = 64) -> None:
    """As a PNG of a few colours, a quarter of the size, with a note at its foot."""
    if note:
        figure.supxlabel(note, x=0.01, ha="left", fontsize=9, color=INK)
    buffer = BytesIO()
    figure.savefig(buffer, format="png")
    plt.close(figure)
    Image.open(buffer).convert("RGB").quantize(colours, dither=Image.Dither.NONE).save(path, optimize=True)


def rays_on(axis: Axes) -> None:
    """Powers of two as plain numbers along x."""
    axis.xaxis.set_major_locator(LogLocator(4.0, numticks=20))
    axis.xaxis.set_minor_locator(NullLocator())
    axis.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
