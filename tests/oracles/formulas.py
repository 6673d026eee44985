"""Visibility known in closed form: what a point sees past simple things, for AO and for lobes.

Visibility V is 1 in the open. AO is V weighted by cos θ / π; one minus it is the view factor from a small flat piece of
surface, and those are listed in J. R. Howell, A Catalog of Radiation Heat Transfer Configuration Factors (the numbers
B-3, B-4, ... below are its own). RO of exponent n is V weighted by (n+1)/(2π) cosⁿ of the angle to R; its formulas are
that lobe integrated over what is visible.

Lengths are in any one unit, angles in radians; every function takes and returns float64 and has no state. The only
numerical integration is that of a cap which lies off a lobe's axis.
"""

from __future__ import annotations

from math import acos, asin, atan, cos, exp, inf, lgamma, log, pi, sin, sqrt, tan
from math import pow as power

import numpy as np


def sphere_above(radius: float, distance: float, theta: float) -> float:
    """AO under a sphere that is wholly above the horizon: 1 − (r/l)² cos θ (Lambert; Howell B-42).

    distance: to its centre, above `radius`. theta: from the normal to it, with cos θ ≥ r/l.
    """
    return 1.0 - (radius / distance) ** 2 * cos(theta)


def sphere_resting(radius: float, offset: float) -> float:
    """AO of a plane at `offset` from the place where a sphere rests on it: 1 − r³ / (r² + a²)^(3/2)."""
    return 1.0 - power(1.0 + (offset / radius) ** 2, -1.5)


def sphere_cut(radius: float, distance: float, theta: float) -> float:
    """AO beside a sphere that the horizon cuts (Howell B-43).

    distance: l, to its centre. theta: from the normal to it, with |cos θ| < r/l; above π/2 the centre is below.
    """
    high = distance / radius
    q = sqrt(high**2 - 1.0)
    seen = cos(theta) * acos(-q / tan(theta)) - q * sqrt(1.0 - (high * cos(theta)) ** 2)
    return 1.0 - (0.5 - asin(q / (high * sin(theta))) / pi + seen / (pi * high**2))


def perpendicular_rectangle(distance: float, width: float, height: float) -> float:
    """AO before an upright rectangle whose lower corner stands square to the point (Howell B-4).

    distance: d, to that corner. width: along the foot, to one side alone. height: above the plane.
    """
    slant = sqrt(distance**2 + height**2)
    return 1.0 - (atan(width / distance) - distance / slant * atan(width / slant)) / (2.0 * pi)


def long_wall(distance: float, height: float) -> float:
    """AO before an endless wall: (1 + d/√(d²+h²))/2; ½ as its height grows."""
    return 0.5 * (1.0 + distance / sqrt(distance**2 + height**2)) if height < inf else 0.5


def trench(left: float, right: float, depth: float) -> float:
    """AO of an endless trench's floor, its walls at w1 and w2: ½ [w1/√(w1²+h²) + w2/√(w2²+h²)]."""
    return 0.5 * (left / sqrt(left**2 + depth**2) + right / sqrt(right**2 + depth**2))


def parallel_rectangle(a: float, b: float, height: float) -> float:
    """AO under a level a × b rectangle with one corner straight above (Howell B-3)."""
    x, y = a / height, b / height
    p, q = sqrt(1.0 + x**2), sqrt(1.0 + y**2)
    return 1.0 - (x / p * atan(y / p) + y / q * atan(x / q)) / (2.0 * pi)


def coaxial_disk(radius: float, height: float, exponent: float = 1.0) -> float:
    """AO, or RO with R = N, under a level disk: cosⁿ⁺¹ of its half-angle; for AO h²/(r²+h²) (Howell B-12)."""
    return cap(exponent, atan(radius / height))


def cylinder_floor(radius: float, depth: float, exponent: float = 1.0) -> float:
    """AO, or RO with R = N, at the centre of a round hole's floor; for AO r²/(r²+h²)."""
    return 1.0 - coaxial_disk(radius, depth, exponent)


def offset_disk(radius: float, offset: float, height: float) -> float:
    """AO under a level disk whose centre is aside by `offset` > 0 (Howell B-13)."""
    h, r = height / offset, radius / offset
    z = 1.0 + h**2 + r**2
    return 1.0 - 0.5 * (1.0 - (1.0 + h**2 - r**2) / sqrt(z**2 - 4.0 * r**2))


def ceiling_within(height: float, distance: float, exponent: float = 1.0) -> float:
    """AO, or RO with R = N, under an endless ceiling with rays of limited length D: (h/D)ⁿ⁺¹, 1 where it is beyond."""
    return power(min(height / distance, 1.0), exponent + 1.0)


def bowl(opening: float) -> float:
    """AO of every point inside a spherical bowl: (1 − cos θc)/2, θc the opening's half-angle at the sphere's centre."""
    return sin(0.5 * opening) ** 2


OCTANT_CORNER = 0.25
"""AO in the corner of three square endless walls; by symmetry also RO of any exponent with R = N."""

CLOSED_BOX = 0.0
"""AO and RO in anything closed."""

OPEN_PLANE = 1.0
"""AO with nothing about, and RO with R = N; a leaning R has `horizon`."""


def horizon(exponent: float, tilt: float) -> float:
    """RO of an open plane: H_n(α) = 1 − ∫₀^α sinⁿ / ∫₀^π sinⁿ, R leaning by `tilt`, 0 to π.

    What the lobe has below the horizon is lost; n = 1: (1 + cos α)/2.
    """
    return 1.0 - _share_of_sine_power(exponent, tilt)


def cap(exponent: float, half_angle: float, tilt: float = 0.0) -> float:
    """RO past a cap about R that lies above the horizon: H_n(α) − (1 − cosⁿ⁺¹ β). A sphere: sin β = r/l."""
    return horizon(exponent, tilt) - (1.0 - power(cos(half_angle), exponent + 1.0))


def cap_off_axis(exponent: float, half_angle: float, away: float, tilt: float = 0.0) -> float:
    """RO past a cap whose middle is `away` from R, above the horizon and within π/2 of R.

    H_n(α) − ∫ (n+1) cosⁿθ sin θ · acos((cos β − cos θ cos δ)/(sin θ sin δ))/π dθ; near the kinks at |δ−β| and δ+β the
    integrand is a square root, which the substitution by a cosine makes smooth
    and periodic, so that the midpoint rule is exact to rounding.
    """
    inner, outer = abs(away - half_angle), away + half_angle
    whole = 1.0 - power(cos(inner), exponent + 1.0) if half_angle > away else 0.0
    turn = pi * (np.arange(2000, dtype=np.int64) + 0.5) / 2000
    theta = 0.5 * (inner + outer) - 0.5 * (outer - inner) * np.cos(turn)
    step = pi / 2000 * 0.5 * (outer - inner) * np.sin(turn)
    reach = (np.cos(half_angle) - np.cos(theta) * np.cos(away)) / (np.sin(theta) * np.sin(away))
    ring = (exponent + 1.0) * np.cos(theta) ** exponent * np.sin(theta) * np.arccos(np.clip(reach, -1.0, 1.0)) / pi
    return horizon(exponent, tilt) - whole - float(np.sum(step * ring))


def between_angles(exponent: float, start: float, end: float) -> float:
    """RO where all is endless along an axis square to R and visible from `start` to `end`, angles from R in its plane.

    ∫ cosⁿ from start to end over that from −π/2 to π/2; what lies outside these is cut off.
    """
    low, high = max(start, -0.5 * pi), min(end, 0.5 * pi)
    return _share_of_sine_power(exponent, high + 0.5 * pi) - _share_of_sine_power(exponent, low + 0.5 * pi)


def leaning_wall(exponent: float, distance: float, height: float, tilt: float) -> float:
    """RO before an endless wall at +x, R leaning towards it by `tilt` (negative: away from it)."""
    return between_angles(exponent, -0.5 * pi - tilt, 0.5 * pi - atan(height / distance) - tilt)


def leaning_trench(exponent: float, left: float, right: float, depth: float, tilt: float) -> float:
    """RO of an endless trench's floor, walls at −`left` and +`right`, R leaning towards +x by `tilt`."""
    return between_angles(exponent, -atan(left / depth) - tilt, atan(right / depth) - tilt)


def octant_lobe(x: float, y: float, z: float) -> float:
    """RO of exponent 1 in the octant corner, R = (x, y, z) of unit length with no part below 0: (x + y + z)/4.

    Along the diagonal √3/4.
    """
    return 0.25 * (x + y + z)


def _share_of_sine_power(exponent: float, end: float) -> float:
    """∫₀^end sinⁿ / ∫₀^π sinⁿ: up to π/2 half the regularised incomplete beta function I_{sin²}((n+1)/2, ½)."""
    if end > 0.5 * pi:
        return 1.0 - _share_of_sine_power(exponent, pi - end)
    return 0.5 * _incomplete_beta(0.5 * (exponent + 1.0), 0.5, sin(end) ** 2, cos(end) ** 2)


def _incomplete_beta(a: float, b: float, x: float, rest: float) -> float:
    """I_x(a, b), rest = 1 − x. Continued fraction (NIST Digital Library of Mathematical Functions, 8.17.22)."""
    if x <= 0.0 or rest <= 0.0:
        return 0.0 if x <= 0.0 else 1.0
    if x > (a + 1.0) / (a + b + 2.0):  # there the mirrored one converges fast
        return 1.0 - _incomplete_beta(b, a, rest, x)
    front = exp(a * log(x) + b * log(rest) + lgamma(a + b) - lgamma(a) - lgamma(b)) / a
    value = 1.0
    for m in range(200, 0, -1):  # from the tail, where nothing is left to add
        odd = -(a + m - 1) * (a + b + m - 1) * x / ((a + 2 * m - 2) * (a + 2 * m - 1))
        even = m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m))
        value = 1.0 + odd / (1.0 + even / value)
    return front / value


def open_horizon(exponent: float, angle: float) -> float:
    """The same as `horizon` by Simpson's rule, to test the one by the other; α is the angle between R and the normal.

    It is 1 at α = 0 and falls as R leans towards the horizon and part of the lobe goes below it.
    """
    steps = 4096
    reach = min(0.5 * pi, 9.0 / sqrt(exponent + 1.0))  # beyond it sinᵉ is below e⁻⁴⁰: narrow lobes need steps
    start = 0.5 * pi - reach

    def integral(end: float) -> float:  # Simpson's rule; the integrand is smooth and bounded
        width = (end - start) / steps
        ordinates: list[float] = [sin(start + width * i) ** exponent for i in range(steps + 1)]
        return (
            width / 3.0 * (ordinates[0] + ordinates[-1] + 4.0 * sum(ordinates[1:-1:2]) + 2.0 * sum(ordinates[2:-1:2]))
        )

    end = min(max(angle, start), start + 2.0 * reach)
    return float(1.0 - integral(end) / integral(start + 2.0 * reach))
