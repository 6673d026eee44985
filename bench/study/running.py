"""The estimate itself while rays come in: how it settles on the exact value."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from ...core.base.arrays import Doubles
from . import style
from .cases import Case, cases
from .convergence import RAYS, shipped_estimates
from .naive import one_ray_estimates

RUNS = 12
NOTE = (
    "dashed: the exact value; grey: ±σ/√N, what is expected of random numbers; "
    "shipped: each marked N is a bake of its own"
)


def draw(folder: Path) -> None:
    """running_ao.png and running_ro.png, beside the wall."""
    at_wall = [case for case in cases("wall") if case.tilt == 0.0]
    shipped = {n: shipped_estimates(at_wall, n, range(RUNS))[:, :, 0] for n in RAYS}
    settled = {case: np.array([shipped[n][:, m] for n in RAYS]) for m, case in enumerate(at_wall)}
    groups = {"ao": [c for c in at_wall if c.map == "AO"], "ro": [c for c in at_wall if c.map != "AO"]}
    titles = {
        "ao": f"AO beside the wall, {RUNS} runs: all settle on the same value, at different speeds",
        "ro": f"RO beside the wall (R = N), {RUNS} runs: what is rare but heavy settles last",
    }
    for name, group in groups.items():
        _draw(group, settled, titles[name], folder / f"running_{name}.png")


def _draw(group: list[Case], settled: dict[Case, Doubles], title: str, path: Path) -> None:
    figure, axes = style.panels(2, len(group), title, 3.3)
    for column, case in enumerate(group):
        walk = one_ray_estimates(case, RUNS * RAYS[-1], seed=100 + column).reshape(RUNS, -1)
        sums = np.cumsum(walk, axis=1).T / np.arange(1, RAYS[-1] + 1)[:, None]
        _panel(axes[column], case, np.arange(1, RAYS[-1] + 1), sums, "random")
        _panel(axes[column + len(group)], case, np.array(RAYS), settled[case], "shipped")
    style.save(figure, path, NOTE)


def _panel(axis: Axes, case: Case, rays: Doubles, estimates: Doubles, kind: str) -> None:
    """estimates: (rays, runs)."""
    colour = style.COLOURS[case.name]
    smooth = np.geomspace(1, RAYS[-1], 200)
    band = case.sigma / np.sqrt(smooth)
    axis.fill_between(smooth, case.exact - band, case.exact + band, color="#ececec", zorder=0, linewidth=0)
    axis.plot(
        rays,
        estimates,
        color=colour,
        linewidth=0.7,
        alpha=0.75,
        marker="s" if kind == "shipped" else None,
        markersize=1.8,
    )
    for edge in (case.exact - band, case.exact + band):
        axis.plot(smooth, edge, color="#777777", linewidth=0.8)
    axis.axhline(case.exact, color=style.INK, linestyle="--", linewidth=1.0)
    reach = {"AO": 0.6, "RO 10": 0.9, "RO 100": 1.6}[case.map]
    axis.set(xscale="log", xlim=(1, RAYS[-1]), ylim=(max(case.exact - reach, -0.05), case.exact + reach))
    axis.set_title(f"{'' if case.map == 'AO' else case.map + ', '}{case.name}, {kind}")
    axis.set_xlabel("rays N")
    style.rays_on(axis)
