"""What a bake by others, or from Blender's file, has other than what is right: for the page of hard cases."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ....core.bake import bake
from ....core.base.arrays import Doubles, Flags, Floats
from ....core.finish.baked import BakedMap
from ....core.solve.goal import Goal
from .case import SIGMAS, TWIN_SEED, Case, Judged, settings_of, speckles


def converged_twin(case: Case, rays: int) -> Doubles:
    """The clean twin with many rays, carried to the case: the judgement's has as few as the case."""
    assert case.twin is not None
    settings = replace(settings_of(case, TWIN_SEED, case.twin_distance), goal=Goal(rays))
    (baked,) = bake(case.twin(), settings)
    return case.from_twin(baked.maps["ao"].values.astype(np.float64))


def against(right: Doubles, values: Floats, covered: Flags, owned: Flags, rays: int) -> dict[str, Any]:
    """Mean, bias and RMSE against what is right, where it is known; texels without a value; dark speckles."""
    known = covered & owned & np.isfinite(right)
    row: dict[str, Any] = {
        "missing": int(np.count_nonzero(owned & ~covered)),
        "speckles": int(np.count_nonzero(speckles(values.astype(np.float64), covered & owned, rays))),
    }
    if known.any():
        difference = values[known].astype(np.float64) - right[known]
        row["mean"] = float(values[known].mean(dtype=np.float64))
        row["bias"] = float(difference.mean())
        row["rmse"] = float(np.sqrt(np.mean(difference**2)))
    return row


def from_blender(judged: Judged, made: BakedMap, rays: int) -> list[str]:
    """What the bake of Blender's file has other than the bakes of the arrays, beyond noise.

    made: by so many rays.
    """
    if not np.array_equal(made.covered, judged.view.covered):
        return [f"from Blender {np.count_nonzero(made.covered)} texels"]
    sure = judged.ours[made.covered]
    share = (sure * judged.rays + 1.0) / (judged.rays + 2.0)
    bound = SIGMAS * np.sqrt(share * (1.0 - share) * (1.0 / rays + 1.0 / judged.rays)) + 0.01
    beyond = np.count_nonzero(np.abs(made.values[made.covered] - sure) > bound)
    return [f"from Blender {beyond} texels differ"] if beyond else []
