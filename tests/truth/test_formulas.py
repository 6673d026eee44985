"""The closed forms against sums over directions, which share nothing with them, and against one another."""

from __future__ import annotations

from collections.abc import Callable
from math import acos, asin, atan, cos, inf, pi, radians, sin, sqrt

import numpy as np
import pytest
from numpy.testing import assert_allclose
from occlusion_bake.tests.oracles import formulas
from occlusion_bake.tests.oracles.formulas import open_horizon

Directions = np.ndarray  # (3, N): x, y, z
Blocked = Callable[[Directions], np.ndarray]
FIBONACCI = (196418, 121393)  # a lattice whose sums over steps are good to 2e-4
EXPONENTS = (1.0, 2.5, 10.0, 64.0, 1000.0)


def summed(blocked: Blocked, exponent: float = 1.0, tilt: float = 0.0) -> float:
    """The lobe about R, which leans towards +x, over what is above the horizon and not blocked."""
    count, step = FIBONACCI
    i = np.arange(count, dtype=np.int64)
    turn = 2 * pi * (i * step % count) / count
    up = ((i + 0.5) / count) ** (1 / (exponent + 1))
    across = np.sqrt(np.maximum(0.0, 1 - up**2))
    a, y = across * np.cos(turn), across * np.sin(turn)
    d = np.stack([a * cos(tilt) + up * sin(tilt), y, up * cos(tilt) - a * sin(tilt)])
    return float(np.mean((d[2] > 0) & ~blocked(d)))


def by_sphere(radius: float, centre: tuple[float, float, float]) -> Blocked:
    def blocked(d: Directions) -> np.ndarray:
        along = np.tensordot(centre, d, 1)
        return (along > 0) & (along**2 > np.dot(centre, centre) - radius**2)

    return blocked


def by_wall(x: float, y: tuple[float, float], top: float) -> Blocked:
    def blocked(d: Directions) -> np.ndarray:
        facing = d[0] * x > 0
        reach = x / np.where(facing, d[0], 1.0)
        return facing & (reach * d[1] > y[0]) & (reach * d[1] < y[1]) & (reach * d[2] < top)

    return blocked


def by_level(height: float, holds: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> Blocked:
    return lambda d: (
        (d[2] > 1e-9) & holds(height * d[0] / np.maximum(d[2], 1e-9), height * d[1] / np.maximum(d[2], 1e-9))
    )


def either(*parts: Blocked) -> Blocked:
    return lambda d: np.logical_or.reduce([part(d) for part in parts])


def nothing(d: Directions) -> np.ndarray:
    return np.zeros(d.shape[1], dtype=bool)


ENDLESS = (-inf, inf)
TRENCH = either(by_wall(1, ENDLESS, 1.5), by_wall(-0.5, ENDLESS, 1.5))
OCTANT = either(by_wall(1, ENDLESS, inf), lambda d: d[1] > 0)
AO_ROWS = {
    "sphere above": (formulas.sphere_above(0.9, 1.5, 0.7), by_sphere(0.9, (1.5 * sin(0.7), 0, 1.5 * cos(0.7)))),
    "sphere resting": (formulas.sphere_resting(0.5, 0.6), by_sphere(0.5, (0.6, 0, 0.5))),
    "sphere cut": (formulas.sphere_cut(0.5, sqrt(1.04), atan(5)), by_sphere(0.5, (1, 0, 0.2))),
    "sphere mostly below": (
        formulas.sphere_cut(0.8, sqrt(0.74), pi / 2 + atan(0.5 / 0.7)),
        by_sphere(0.8, (0.7, 0, -0.5)),
    ),
    "perpendicular rectangle": (formulas.perpendicular_rectangle(0.7, 1.2, 0.9), by_wall(0.7, (0, 1.2), 0.9)),
    "long wall": (formulas.long_wall(1, 1.5), by_wall(1, ENDLESS, 1.5)),
    "wall without end": (formulas.long_wall(1, inf), by_wall(1, ENDLESS, inf)),
    "parallel rectangle": (
        formulas.parallel_rectangle(0.8, 1.1, 0.6),
        by_level(0.6, lambda x, y: (x > 0) & (x < 0.8) & (y > 0) & (y < 1.1)),
    ),
    "coaxial disk": (formulas.coaxial_disk(0.25, 1), by_level(1, lambda x, y: x**2 + y**2 < 0.25**2)),
    "floor of a hole": (formulas.cylinder_floor(0.6, 1), by_level(1, lambda x, y: x**2 + y**2 > 0.6**2)),
    "offset disk": (formulas.offset_disk(0.7, 0.9, 0.8), by_level(0.8, lambda x, y: (x - 0.9) ** 2 + y**2 < 0.49)),
    "ceiling within reach": (
        formulas.ceiling_within(0.6, 1),
        by_level(0.6, lambda x, y: x**2 + y**2 + 0.36 < 1),
    ),
    "trench": (formulas.trench(0.5, 1, 1.5), TRENCH),
    "octant corner": (formulas.OCTANT_CORNER, OCTANT),
    "open plane": (formulas.OPEN_PLANE, nothing),
}


@pytest.mark.parametrize("name", AO_ROWS)
def test_ao_is_the_sum_over_directions(name: str) -> None:
    exact, blocked = AO_ROWS[name]
    assert_allclose(summed(blocked), exact, atol=2e-4)


@pytest.mark.parametrize("at", [75, 120, 180])
def test_a_bowl_is_the_same_from_everywhere_inside(at: int) -> None:
    """From a point of the unit sphere the opening is a disk: its normal leans, and it stands aside."""
    angle, opening = radians(at), radians(50)
    outward, aside = np.array([sin(angle), 0, cos(angle)]), np.array([cos(angle), 0, -sin(angle)])

    def blocked(d: Directions) -> np.ndarray:
        world = aside[:, None] * d[0] + np.array([0, 1, 0])[:, None] * d[1] - outward[:, None] * d[2]
        rises = world[2] > 1e-9
        reach = (cos(opening) - outward[2]) / np.where(rises, world[2], 1.0)
        x, y = outward[0] + reach * world[0], reach * world[1]
        return ~(rises & (reach > 0) & (x**2 + y**2 < sin(opening) ** 2))

    assert cos(opening) > outward[2]
    assert_allclose(summed(blocked), formulas.bowl(opening), atol=2e-4)


@pytest.mark.parametrize("degrees", [0, 30, 60, 85, -60])
@pytest.mark.parametrize("exponent", EXPONENTS)
def test_lobes_are_the_sum_over_directions(exponent: float, degrees: int) -> None:
    tilt = radians(degrees)
    for exact, blocked in (
        (formulas.horizon(exponent, abs(tilt)), nothing),
        (formulas.leaning_wall(exponent, 1, 1.5, tilt), by_wall(1, ENDLESS, 1.5)),
        (formulas.leaning_trench(exponent, 0.5, 1, 1.5, tilt), TRENCH),
    ):
        assert_allclose(summed(blocked, exponent, tilt), exact, atol=3e-4)


@pytest.mark.parametrize("exponent", EXPONENTS)
def test_caps_are_the_sum_over_directions(exponent: float) -> None:
    def along(polar: float) -> tuple[float, float, float]:
        return (2 * sin(polar), 0.0, 2 * cos(polar))

    for tilt, away, half in ((0.5, 0.0, 0.4), (0.2, 0.3, 0.5), (0.9, -0.5, 0.2), (0.3, 0.05, 0.06)):
        exact = formulas.cap_off_axis(exponent, half, abs(away), tilt) if away else formulas.cap(exponent, half, tilt)
        assert_allclose(summed(by_sphere(2 * sin(half), along(tilt + away)), exponent, tilt), exact, atol=3e-4)


def test_a_leaning_lobe_in_the_octant_corner() -> None:
    """R in the plane y = 0, and by symmetry along the diagonal."""
    assert_allclose(summed(OCTANT, 1.0, -0.6), formulas.octant_lobe(sin(0.6), 0, cos(0.6)), atol=2e-4)
    assert_allclose(formulas.octant_lobe(*[1 / sqrt(3)] * 3), sqrt(3) / 4)
    assert formulas.octant_lobe(0, 0, 1) == formulas.OCTANT_CORNER


def test_the_formulas_agree_where_they_meet() -> None:
    assert_allclose(formulas.sphere_cut(0.5, 2, acos(0.25)), formulas.sphere_above(0.5, 2, acos(0.25)), atol=1e-12)
    assert_allclose(
        formulas.sphere_cut(0.5, sqrt(0.61), atan(0.6 / 0.5)), formulas.sphere_resting(0.5, 0.6), atol=1e-12
    )
    assert_allclose(formulas.sphere_above(0.6, 1, 0), formulas.cap(1, asin(0.6)), atol=1e-12)
    assert_allclose(
        formulas.cap_off_axis(1, 0.3, 0.5, 0.5), 1 - (1 - cos(0.5)) / 2 - sin(0.3) ** 2 * cos(0.5), atol=1e-12
    )
    assert_allclose(formulas.cap_off_axis(100, 0.3, 1e-7), formulas.cap(100, 0.3), atol=1e-9)
    assert_allclose(formulas.offset_disk(0.7, 1e-6, 0.8), formulas.coaxial_disk(0.7, 0.8), atol=1e-9)
    assert_allclose(formulas.parallel_rectangle(1e9, 1e9, 1), 0.75, atol=1e-8)
    assert_allclose(2 * formulas.perpendicular_rectangle(1, 1e9, 1.5) - 1, formulas.long_wall(1, 1.5), atol=1e-9)
    assert_allclose(formulas.leaning_wall(1, 1, 1.5, 0), formulas.long_wall(1, 1.5), atol=1e-12)
    assert_allclose(formulas.leaning_trench(1, 0.5, 1, 1.5, 0), formulas.trench(0.5, 1, 1.5), atol=1e-12)
    assert_allclose(formulas.cylinder_floor(0.6, 1), 0.36 / 1.36, atol=1e-12)
    assert_allclose(formulas.cap_off_axis(1, asin(0.4), 0.6), 1 - 0.4**2 * cos(0.6), atol=1e-12)  # above the horizon
    assert_allclose(formulas.cap_off_axis(10, asin(0.4), 1e-4), (1 - 0.4**2) ** 5.5, atol=1e-6)  # overhead
    assert_allclose(formulas.sphere_cut(0.5, 2, acos(0.25)), 1 - 0.25**2 * 0.25, atol=1e-12)  # just touched by it


@pytest.mark.parametrize("degrees", [0, 10, 45, 80, 90, 135, 180])
def test_the_horizon_has_its_closed_forms(degrees: int) -> None:
    a = radians(degrees)
    assert_allclose(formulas.horizon(0, a), 1 - a / pi, atol=1e-12)
    assert_allclose(formulas.horizon(1, a), (1 + cos(a)) / 2, atol=1e-12)
    assert_allclose(formulas.horizon(2, a), 1 - (a - sin(a) * cos(a)) / pi, atol=1e-12)
    for exponent in EXPONENTS:
        assert_allclose(formulas.horizon(exponent, a), open_horizon(exponent, a), atol=1e-9)


@pytest.mark.parametrize("degrees", [0.0, 10.0, 45.0, 80.0, 90.0, 170.0])
def test_the_open_horizon_has_its_closed_forms(degrees: float) -> None:
    """By quadrature."""
    angle = radians(degrees)
    assert_allclose(open_horizon(0, angle), 1 - angle / pi, atol=1e-9)
    assert_allclose(open_horizon(1, angle), (1 + cos(angle)) / 2, atol=1e-9)
    assert_allclose(open_horizon(2, angle), 1 - (angle - sin(angle) * cos(angle)) / pi, atol=1e-9)
    assert_allclose(open_horizon(64, angle) + open_horizon(64, pi - angle), 1.0, atol=1e-9)


def test_a_narrow_leaning_lobe_is_not_1_in_the_open() -> None:
    for way in (formulas.horizon, open_horizon):
        assert_allclose(way(64, radians(85)), 0.758, atol=5e-4)
