"""The filter that knows the surface, written down plainly: every point asks every other one, in float64.

Where the kernel takes clusters and quads for their points, and sums up moments, here each neighbour has a row of its
own and what a fit leaves over is looked at point by point. The constants are the kernel's, read from its sources: what
is checked is what it makes of them.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from ...core.base.arrays import Doubles, Ints

_SOURCES = Path(__file__).resolve().parents[2] / "core" / "kernel" / "src"
_FILES = ("packets.h", "filter_fit_code.h", "filter_frames_code.h", "filter_samples_code.h", "surface_filter_code.h")


@cache
def constants() -> dict[str, float]:
    """Every `constexpr float` of the filter by its name."""
    text = "".join((_SOURCES / name).read_text() for name in _FILES)
    return {name: float(value) for name, value in re.findall(r"constexpr float (k\w+) = ([0-9.e+-]+)F", text)}


@dataclass(frozen=True, eq=False)
class Points:
    """positions, normals, shading: (N, 3), of the mesh and those that texels are shaded by. spacing: (N,)."""

    positions: Doubles
    normals: Doubles
    shading: Doubles
    spacing: Doubles

    def axes(self, i: int) -> Doubles:
        """(2 or 3, 3): along what turns of the normals are told; of the mesh's alone not along the point's own."""
        tangents, along = _tangents(self.shading[i]), self.shading[i : i + 1]
        made: Doubles = tangents if np.array_equal(self.shading, self.normals) else np.concatenate([tangents, along])
        return made


@dataclass(frozen=True, eq=False)
class Samples:
    """What is known of a map at the points, each (N,)."""

    value: Doubles
    noise: Doubles
    precision: Doubles

    @property
    def variance(self) -> Doubles:
        """Of each value; that of one without rays is of no use."""
        made: Doubles = self.noise / np.maximum(self.precision, 1e-30)
        return made


@dataclass(frozen=True)
class _Fit:
    """Of one point. value: there; slope: of the plane, by place and by normal; error: variance of value; residual: mean
    square left over; noise: the part that rays explain; own: weight of this point; squares: sum of squared shares."""

    value: float
    slope: Doubles
    error: float
    residual: float
    noise: float
    per_weight: float
    squares: float


def apply(points: Points, samples: Samples, sharpness: float, slope: float) -> tuple[Doubles, Doubles]:
    """(N,) filtered values, not clipped, and the squared errors that are expected of them."""
    sampled = samples.precision > 0.0
    firsts = [_first(points, samples, i, sharpness, slope, bool(sampled[i])) for i in range(len(sampled))]
    guide, guide_error, variance, residual = (np.array([first[k] for first in firsts]) for k in range(4))
    slopes = np.array([first[4] for first in firsts])
    guides = _Guides(guide, guide_error, variance, residual, slopes)
    found = [_second(points, samples, guides, i, sharpness, slope, bool(sampled[i])) for i in range(len(sampled))]
    values, errors = np.array(found).T
    return values, errors


@dataclass(frozen=True, eq=False)
class _Guides:
    value: Doubles
    error: Doubles
    variance: Doubles
    residual: Doubles
    slope: Doubles


def _first(
    points: Points, samples: Samples, i: int, sharpness: float, slope: float, sampled: bool
) -> tuple[float, float, float, float, Doubles]:
    k = constants()
    near, at, inside, distance = _near(points, samples, i, sharpness, k["kGuideRadius"])
    weight = inside * _falloff(distance)
    total = max(float(weight.sum()), 1e-20)
    noise = float(weight @ samples.noise[near]) / total  # the noise of one is crude: that of all stands for it
    fit = _fit(at, samples.value[near], weight, noise / samples.precision[near], slope)
    residual = max(fit.residual - k["kDetailThreshold"] * fit.noise, 0.0)
    own = noise / samples.precision[i] if sampled else noise
    share, error = _shrinkage(fit, 1.0, own, k["kDetailThreshold"], sampled)
    value = (1.0 - share) * fit.value + share * (samples.value[i] if sampled else 0.0)
    return value, error, noise, residual, fit.slope[2:]


def _second(
    points: Points, samples: Samples, guides: _Guides, i: int, sharpness: float, slope: float, sampled: bool
) -> tuple[float, float]:
    k = constants()
    near, at, inside, distance = _near(points, samples, i, sharpness, k["kFilterRadius"])
    apart = guides.value[near] - guides.value[i] - at[:, 2:] @ guides.slope[i]
    allowed = k["kTolerance"] * (guides.error[i] + k["kLeastVariance"] + guides.error[near])
    # A neighbour with more rays weighs more, as far as it is noise that parts it from the plane.
    known = guides.variance[i] / samples.precision[near]
    scatter = guides.residual[i] + 1e-9
    weight = inside * _falloff(distance + apart**2 / allowed) * (guides.variance[i] + scatter) / (known + scatter)
    if not weight.sum() > 0.0:
        return float(guides.value[i]), 1.0
    fit = _fit(at, samples.value[near], weight, known, slope)
    own = float(guides.variance[i] / samples.precision[i]) if sampled else float(guides.variance[i])
    own_weight = float((guides.variance[i] + scatter) / (own + scatter))
    share, error = _shrinkage(fit, own_weight, own, k["kLikelyDetailThreshold"], sampled)
    return (1.0 - share) * fit.value + share * float(samples.value[i] if sampled else 0.0), error


def _near(
    points: Points, samples: Samples, i: int, sharpness: float, radius: float
) -> tuple[Ints, Doubles, Doubles, Doubles]:
    """Who is asked; what they are fitted by; how far inside the radius they are; how far off in place and normal."""
    apart = points.positions - points.positions[i]
    normal = points.normals[i]
    off = (apart @ normal) ** 2 + np.einsum("ij,ij->i", apart, points.normals) ** 2
    distance = constants()["kFlatness"] * off / points.spacing[i] ** 2
    distance = distance + sharpness * np.maximum(1.0 - points.normals @ normal, 0.0)
    place = apart @ _tangents(normal).T / points.spacing[i]
    turn = (points.shading - points.shading[i]) @ points.axes(i).T
    inside = np.maximum(1.0 - (place**2).sum(axis=1) / radius**2, 0.0)
    near: Ints = np.flatnonzero((inside > 0.0) & (distance < 8.0) & (samples.precision > 0.0)).astype(np.int32)
    return near, np.column_stack([place, turn])[near], inside[near], distance[near]


def _tangents(normal: Doubles) -> Doubles:
    """(2, 3): two directions at right angles to it and to one another."""
    across: Doubles = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
    across = across / np.linalg.norm(across)
    tangents: Doubles = np.stack([across, np.cross(normal, across)])
    return tangents


def _falloff(x: Doubles) -> Doubles:
    """Nearly exp(-x)."""
    fallen: Doubles = np.maximum(1.0 - x / 8.0, 0.0) ** 8.0
    return fallen


def _fit(at: Doubles, value: Doubles, weight: Doubles, variance: Doubles, slope: float) -> _Fit:
    """A plane through weighted values, its slopes drawn to 0 by a ridge (Hoerl & Kennard 1970): places by one that is
    fixed, normals by what the noise of the values would make of them beside the slope that is likely."""
    k = constants()
    total = max(float(weight.sum()), 1e-20)
    mean, middle = weight @ at / total, float(weight @ value) / total
    spread = float(weight**2 @ variance) / total**2
    ridge = np.array([k["kRidge"]] * 2 + [spread / slope**2 + k["kNormalRidge"]] * (at.shape[1] - 2))
    centred = at - mean
    matrix = centred.T @ (weight[:, None] * centred) / total + np.diag(ridge)
    slopes = np.linalg.solve(matrix, centred.T @ (weight * (value - middle)) / total)
    leverage = 1.0 + float(mean @ np.linalg.solve(matrix, mean))
    left = value - middle - centred @ slopes
    return _Fit(
        value=middle - float(slopes @ mean),
        slope=slopes,
        error=spread * leverage,
        residual=float(weight @ left**2) / total,
        noise=float(weight @ variance) / total,
        per_weight=leverage / total,
        squares=float(weight @ weight) / total**2 * leverage,
    )


def _shrinkage(fit: _Fit, weight: float, variance: float, likely: float, sampled: bool) -> tuple[float, float]:
    """How much of the outcome the point's own value is, and the outcome's squared error (James & Stein 1961)."""
    detail = max(fit.residual - constants()["kDetailThreshold"] * fit.noise, 0.0)
    share = detail / (detail + variance + 1e-12) if sampled else 0.0
    own = weight * fit.per_weight if sampled else 0.0
    missed = max(fit.residual - likely * fit.noise, 0.0) * (max(fit.squares - own**2, 0.0) + (1.0 - own) ** 2)
    random = (1.0 - share) ** 2 * fit.error + share * (share + 2.0 * (1.0 - share) * own) * (
        variance if sampled else 0.0
    )
    return share, random + (1.0 - share) ** 2 * missed
