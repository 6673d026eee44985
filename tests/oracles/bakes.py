"""Bakes of one target, and the test that a mean of many seeds agrees with an exact answer."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...core.bake import bake
from ...core.finish.baked import Baked
from ...core.scene.scene import Instance, Scene
from ...core.settings import Settings
from .settings import flat_settings

SEEDS = 16  # rays of one seed complete one another, so that only whole seeds are independent
T_BOUND = 6.5  # Student's t, 15 degrees of freedom: exceeded by chance with p = 1e-5


def bake_one(scene: Scene, *, size: int = 16, **settings: Any) -> Baked:
    """Bake a scene of one target without margins; keywords are those of Settings, size stands for both sides."""
    (baked,) = bake(scene, flat_settings(**{"width": size, "height": size, "margin": 0, **settings}))
    return baked


def bake_among(settings: Settings, target: Instance, *others: Instance) -> Baked:
    """Bake an object among others, itself an occluder."""
    (baked,) = bake(Scene([target], [target, *others]), settings)
    return baked


def means_of(scene: Scene, **settings: Any) -> dict[str, list[float]]:
    """The mean of each map, by every seed."""
    bakes = [bake_one(scene, seed=seed, **settings) for seed in range(SEEDS)]
    return {name: [baked.maps[name].mean for baked in bakes] for name in bakes[0].maps}


def assert_mean(samples: Sequence[float], exact: float, *, slack: float = 0.0) -> None:
    """Student's t-test of one number a seed against an exact answer.

    slack: what tessellation or truncation may add. The mean must also be so certain that the test means something.
    """
    assert len(samples) >= SEEDS
    mean, spread = np.mean(samples), np.std(samples, ddof=1) / np.sqrt(len(samples))
    assert spread < 1e-3, f"too few rays to tell: {mean:.5f} ± {spread:.5f}"
    bound = T_BOUND * spread + slack + 1e-6  # the last for rounding, where every seed agrees
    assert abs(mean - exact) <= bound, f"{mean:.6f} ± {spread:.6f}, exactly {exact:.6f}"
