"""Exact answers: every case in every frame, the texels that must be 1 or 0 to the last bit, and the bowl.

Each reading is the mean over a patch's texels and 16 seeds, whose rays are independent of one another; Student's t then
tells it from the exact value. A reading holds where it is no farther off than the slack and 6.5 standard errors
(p = 1e-5). Means over all frames are the converged answers: they must lie within 1e-4.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import inf, radians, sqrt
from typing import Any

import numpy as np

from .cases import FRAMES, Answer, Case, Frame, cases, stage
from .whole import SPLIT, astray, bowl_texels, globe, leak_frames, plane, room, wedge

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


def measure(chosen: argparse.Namespace) -> dict[str, Any]:
    """Everything; prints a line a case. chosen is not used: the length of this run is fixed."""
    rows = []
    for case in cases():
        start = time.perf_counter()
        readings = [
            reading
            for place, frame in enumerate(FRAMES)
            for reading in read(case, frame, chosen_answers(case, place), first_seed=SEEDS * place)
        ]
        rows += [_row(case, answer, [each for each in readings if each.answer is answer]) for answer in case.answers]
        ours = rows[-len(case.answers) :]
        worst, wrong = max(row["worst_bias"] for row in ours), sum(len(row["wrong"]) for row in ours)
        print(f"{case.name}: worst |bias| {worst:.1e}, wrong {wrong}, {time.perf_counter() - start:.1f} s", flush=True)
    result: dict[str, Any] = {"cases": rows, "constant": _constant(), "bowl": _bowl()}
    result["failures"] = failures(result)
    print("\n".join(result["failures"]) or "all hold", flush=True)
    return result


def _row(case: Case, answer: Answer, readings: Sequence[Reading]) -> dict[str, Any]:
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


def _constant() -> list[dict[str, Any]]:
    """Texels of closed things and of planes: how many differ from the one right value, over all frames."""
    rows = []
    for name, mesh, exact, frames in (
        ("closed box", room(), 0.0, leak_frames()),
        ("closed sphere", globe(), 0.0, leak_frames()),
        ("closed wedge of 20°", wedge(radians(20)), 0.0, leak_frames()),
        ("closed box, cut into needles", room(SPLIT), 0.0, leak_frames()),
        ("open plane", plane(), 1.0, leak_frames()),
        ("open plane, cut into needles", plane(SPLIT), 1.0, leak_frames()),
    ):
        found = [astray(mesh, frame, exact, rays=128) for frame in frames]
        wrong = [f"{frame.name}: {bad}" for frame, (bad, _) in zip(frames, found, strict=True) if bad]
        rays = sum(rays for _, rays in found)
        off = sum(bad for bad, _ in found)
        rows.append({"mesh": name, "exact": exact, "frames": len(frames), "rays": rays, "texels": off, "wrong": wrong})
        print(f"{name}: {off} texels off, {rays} rays", flush=True)
    return rows


def _bowl() -> list[dict[str, Any]]:
    frames = (FRAMES[0], Frame("offset 1e5, scale 1e-2, turned", scale=1e-2, offset=1e5, turned=True))
    rows: list[dict[str, Any]] = [
        {"frame": frame.name, **bowl_texels(frame, 32, 256, range(SEEDS * i, SEEDS * (i + 1)))}
        for i, frame in enumerate(frames)
    ]
    print("bowl:", rows, flush=True)
    return rows


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


def page(result: dict[str, Any]) -> list[str]:
    """The section of the page."""
    return [
        "## Exact answers",
        "",
        "Scenes whose occlusion is known in closed form, and what the bake finds. Bias: the mean over all frames less "
        "the exact value, beside its standard error. Worst: the largest of one frame, beside its own. t: how many "
        f"standard errors a frame lies off at most, beyond the slack; {T_BOUND:g} is allowed (p = 1e-5, 16 independent "
        "seeds). Slack: what the scene itself may be off, by its polygons, its length or the rounding of its corners "
        "to float32. RO without an R in the case's name is about the normal.",
        "",
        f"Frames: {'; '.join(frame.name for frame in FRAMES)}. Every case is in every frame; where a case has several "
        "maps they take turns.",
        "",
        "| case | map | exact | bias | ± | worst frame | ± | t | slack |",
        "|---|---|---|---|---|---|---|---|---|",
        *(
            f"| {row['case']} | {row['map']} | {row['exact']:.6f} | {row['bias']:+.1e} | {row['error']:.0e} "
            f"| {row['worst_bias']:.1e} | {row['worst_error']:.0e} | {row['worst_t']:.1f} | {row['slack']:.0e} |"
            for row in result["cases"]
        ),
        "",
        _resolved(result["cases"]),
        "",
        "### Texels that must be exact",
        "",
        "Nothing may leave a closed mesh, and nothing of a plane may block its own sky: every texel is 0, or 1, to the "
        "last bit. By AO, RO 10 and, in closed meshes, AO from rays to all sides; with every offset and scale, turned "
        "and not. Needles: a millionth as wide as the mesh.",
        "",
        "| mesh | value | frames | rays | texels off |",
        "|---|---|---|---|---|",
        *(
            f"| {row['mesh']} | {row['exact']:g} | {row['frames']} | {row['rays']:,} | {row['texels']} |"
            for row in result["constant"]
        ),
        "",
        *_bowl_page(result["bowl"]),
        *(["", "### Does not hold", "", *(f"- {line}" for line in result["failures"])] if result["failures"] else []),
    ]


def _resolved(rows: Sequence[dict[str, Any]]) -> str:
    count = sum(RESOLVED * row["error"] <= CONVERGED for row in rows)
    return (
        f"In {count} of {len(rows)} rows the noise is low enough, {RESOLVED:g} standard errors within {CONVERGED:g}, "
        f"to ask for a bias of at most {CONVERGED:g}, and it is; the others rest on t alone."
    )


def _bowl_page(rows: Iterable[dict[str, Any]]) -> list[str]:
    return [
        "### A bowl: the seam test",
        "",
        "Every point inside a spherical bowl sees the same share of the sky, across the seams of its four charts too.",
        "",
        "| frame | exact | mean | ± | texels | farthest texel | its noise |",
        "|---|---|---|---|---|---|---|",
        *(
            f"| {row['frame']} | {row['exact']:.6f} | {row['mean']:.6f} | {row['error']:.0e} | {row['texels']} "
            f"| {row['farthest']:.4f} | {row['texel_error']:.4f} |"
            for row in rows
        ),
    ]
