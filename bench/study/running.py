"""The estimate itself while rays come in: how it settles on the exact value."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from ...core.base.arrays import Doubles
from ...tests.oracles.naive_estimators import one_ray_estimates
from ...tests.oracles.wall_and_open import Case, cases
from ..plots import COLOURS, INK, panels, rays_on, save
from .convergence import RAYS, shipped_estimates

RUNS = 12
NOTE = (
    "dashed: the exact value; grey: ±σ/√N, what is expected of random numbers; "
    "shipped: each marked N is a bake of its own"
)
TITLES = {
    "AO": f"AO beside the wall, {RUNS} runs: all settle on the same value, at different speeds",
    "RO": f"RO beside the wall (R = N), {RUNS} runs: what is rare but heavy settles last",
}


def draw(folder: Path) -> None:
    """running_ao.png and running_ro.png, beside the wall."""
    at_wall = [case for case in cases("wall") if case.tilt == 0.0]
    shipped = np.array([shipped_estimates(at_wall, n, range(RUNS))[:, :, 0] for n in RAYS])
    settled = {case: shipped[:, :, m] for m, case in enumerate(at_wall)}
    for name, title in TITLES.items():
        group = {case: each for case, each in settled.items() if case.map[:2] == name}
        _draw(group, title, folder / f"running_{name.lower()}.png")


def _draw(settled: dict[Case, Doubles], title: str, path: Path) -> None:
    figure, axes = panels(2, len(settled), title, 3.3)
    every = np.arange(1, RAYS[-1] + 1)
    for column, (case, estimates) in enumerate(settled.items()):
        walk = one_ray_estimates(case, RUNS * RAYS[-1], seed=100 + column).reshape(RUNS, -1)
        _panel(axes[column], case, every, np.cumsum(walk, axis=1).T / every[:, None], "random")
        _panel(axes[column + len(settled)], case, np.array(RAYS), estimates, "shipped")
    save(figure, path, NOTE)


def _panel(axis: Axes, case: Case, rays: Doubles, estimates: Doubles, kind: str) -> None:
    """estimates: (rays, runs)."""
    smooth = np.geomspace(1, RAYS[-1], 200)
    band = case.sigma / np.sqrt(smooth)
    axis.fill_between(smooth, case.exact - band, case.exact + band, color="#ececec", zorder=0, linewidth=0)
    marker = "s" if kind == "shipped" else None
    axis.plot(rays, estimates, color=COLOURS[case.name], linewidth=0.7, alpha=0.75, marker=marker, markersize=1.8)
    for edge in (case.exact - band, case.exact + band):
        axis.plot(smooth, edge, color="#777777", linewidth=0.8)
    axis.axhline(case.exact, color=INK, linestyle="--", linewidth=1.0)
    reach = {"AO": 0.6, "RO 10": 0.9, "RO 100": 1.6}[case.map]
    axis.set(xscale="log", xlim=(1, RAYS[-1]), ylim=(max(case.exact - reach, -0.05), case.exact + reach))
    axis.set_title(f"{'' if case.map == 'AO' else case.map + ', '}{case.name}, {kind}")
    axis.set_xlabel("rays N")
    rays_on(axis)
