"""How a bake's answer is told from the exact one.

Each reading is the mean over a patch's texels and 16 seeds, whose rays are independent of one another; Student's t then
tells it from the exact value. A reading holds where it is no farther off than the slack and 6.5 standard errors
(p = 1e-5). Means over all frames are the converged answers: they must lie within 1e-4.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, sqrt
from typing import Any

import numpy as np

from .exact_cases import FRAMES, Answer, Case, Frame, stage

SEEDS = 16
T_BOUND = 6.5  # 15 degrees of freedom: exceeded by chance with p = 1e-5
CONVERGED = 1e-4
TEXELS, RAYS = 32, 256  # along a side of the patch; a texel and seed
RESOLVED = 5.0  # standard errors that must fit into CONVERGED for it to be asked


@dataclass(frozen=True)
class Reading:
    """One answer in one frame. error: the standard error of the mean. slack: what the case itself may be off."""

    frame: str
    answer: Answer
    mean: float
    error: float
    slack: float

    @property
    def bias(self) -> float:
        return self.mean - self.answer.exact

    @property
    def t(self) -> float:
        """Standard errors beyond the slack; where there is no noise, 0 or infinity."""
        beyond = max(abs(self.bias) - self.slack, 0.0)
        return beyond / self.error if self.error > 0.0 else (inf if beyond else 0.0)

    @property
    def holds(self) -> bool:
        return self.t <= T_BOUND


def read(
    case: Case, frame: Frame, answers: Sequence[Answer], *, texels: int = TEXELS, rays: int = RAYS, first_seed: int = 0
) -> list[Reading]:
    """Some of the case's answers, in a frame."""
    seeds = range(first_seed, first_seed + SEEDS)
    means = stage(case, frame, texels).means([answer.estimator for answer in answers], rays, seeds)
    errors = means.std(axis=0, ddof=1) / sqrt(SEEDS)
    return [
        Reading(frame.name, answer, float(mean), float(error), frame.slack(case, answer))
        for answer, mean, error in zip(answers, means.mean(axis=0), errors, strict=True)
    ]


def chosen_answers(case: Case, place: int) -> list[Answer]:
    """All of them in the first frame, one in each other, by turns: tables of rays cost more than rays."""
    return list(case.answers) if place == 0 else [case.answers[place % len(case.answers)]]


def summaries(case: Case) -> list[dict[str, Any]]:
    """A case in all frames: a row for each of its answers, for a page and for `failures`."""
    readings = [
        reading
        for place, frame in enumerate(FRAMES)
        for reading in read(case, frame, chosen_answers(case, place), first_seed=SEEDS * place)
    ]
    return [_summary(case, each, [reading for reading in readings if reading.answer is each]) for each in case.answers]


def _summary(case: Case, answer: Answer, readings: Sequence[Reading]) -> dict[str, Any]:
    biases = np.array([reading.bias for reading in readings])
    errors = np.array([reading.error for reading in readings])
    return {
        "case": case.name,
        "map": _label(answer),
        "exact": answer.exact,
        "frames": len(readings),
        "bias": float(biases.mean()),
        "error": float(sqrt(np.sum(errors**2)) / len(errors)),
        "worst_bias": float(np.abs(biases).max()),
        "worst_error": float(errors[int(np.abs(biases).argmax())]),
        "worst_t": float(min(max(reading.t for reading in readings), 1e9)),
        "slack": max(reading.slack for reading in readings),
        "slack_from": case.slack_from,
        "wrong": [f"{each.frame}: {each.bias:+.1e} ± {each.error:.1e}" for each in readings if not each.holds],
    }


def _label(answer: Answer) -> str:
    estimator = answer.estimator
    sampler = "" if estimator.sampler == 0 else f", {estimator.sampler.name.lower().replace('_', ' ')}"
    return f"{estimator.name.replace('_', ' ').upper()}{sampler}"


def failures(result: dict[str, Any]) -> list[str]:
    """A line each for what does not hold."""
    lines = [f"{row['case']}, {row['map']}: {wrong}" for row in result["cases"] for wrong in row["wrong"]]
    for row in result["cases"]:
        if RESOLVED * row["error"] <= CONVERGED < abs(row["bias"]):
            lines.append(f"{row['case']}, {row['map']}: converged {row['bias']:+.1e}")
    lines += [
        f"{row['mesh']}, {wrong} texels are not {row['exact']:g}"
        for row in result["constant"]
        for wrong in row["wrong"]
    ]
    for row in result["bowl"]:
        if abs(row["mean"] - row["exact"]) > T_BOUND * row["error"] + row["slack"]:
            lines.append(f"bowl, {row['frame']}: mean {row['mean'] - row['exact']:+.1e} ± {row['error']:.1e}")
        if row["farthest_t"] > row["t_bound"]:
            lines.append(f"bowl, {row['frame']}: a texel is {row['farthest']:.1e} off")
    return lines
