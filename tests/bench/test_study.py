"""The study: its exact answers, its estimators against them, and a page that says what was measured."""

from __future__ import annotations

import math
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from occlusion_bake.bench.study import convergence, light
from occlusion_bake.bench.study.page import page
from occlusion_bake.core.rays.map_spec import Sampler
from occlusion_bake.tests.oracles.formulas import open_horizon
from occlusion_bake.tests.oracles.naive_estimators import one_ray_estimates
from occlusion_bake.tests.oracles.wall_and_open import DISTANCE, EDGE, EXPONENTS, HEIGHT, TILT, Case, cases, lobe_seen

FOLDER = Path(convergence.__file__).parent
BOUND = 5.0  # standard errors: exceeded by chance with p = 6e-7
ALL = [case for point in EDGE for case in cases(point)]


def _id(case: Case) -> str:
    return f"{case.point}-{case.map}-{case.tilt:g}-{case.name}"


def test_exact_answers_are_the_known_formulas() -> None:
    wall = 1.0 - (1.0 - DISTANCE / math.hypot(DISTANCE, HEIGHT)) / 2.0
    assert lobe_seen(1.0, 0.0, EDGE["wall"]) == pytest.approx(wall, abs=1e-12)
    for exponent in EXPONENTS:
        horizon = open_horizon(exponent, math.radians(TILT["open"]))
        assert lobe_seen(exponent, TILT["open"], EDGE["open"]) == pytest.approx(horizon, abs=1e-9)


def test_sigma_of_ao_in_the_open() -> None:
    sigma = {case.sampler: case.sigma for case in cases("open") if case.map == "AO"}
    assert sigma[Sampler.UNIFORM_SPHERE] ** 2 == pytest.approx(5.0 / 3.0, abs=1e-12)
    assert sigma[Sampler.UNIFORM_HEMISPHERE] ** 2 == pytest.approx(1.0 / 3.0, abs=1e-12)
    assert sigma[Sampler.LOBE] == 0.0


@pytest.mark.parametrize("case", ALL, ids=_id)
def test_one_random_ray_has_the_exact_mean_and_spread(case: Case) -> None:
    count = 1 << 16
    estimates = one_ray_estimates(case, count, seed=7)
    squared = (estimates - case.exact) ** 2
    assert abs(estimates.mean() - case.exact) <= BOUND * case.sigma / math.sqrt(count)
    assert abs(squared.mean() - case.sigma**2) <= BOUND * squared.std() / math.sqrt(count)


@pytest.mark.parametrize("case", [case for case in cases("wall") if case.map == "AO"], ids=_id)
def test_random_numbers_converge_as_the_square_root(case: Case) -> None:
    curve = convergence.random_curve(case, 1 << 17, seed=3)
    assert abs(curve.slope + 0.5) <= BOUND * curve.slope_uncertainty


def test_the_shipped_set_converges_faster_beside_the_wall() -> None:
    lobes = [case for case in cases("wall") if case.sampler is Sampler.LOBE]
    for curve in convergence.shipped_curves(lobes, [64, 256], range(convergence.GROUPS)):
        assert curve.slope < -0.6, curve.case
        assert curve.at(256) < 0.4 * curve.case.sigma / math.sqrt(256), curve.case


def test_one_ray_is_exact_in_the_open_where_theory_says_so() -> None:
    studied = cases("open")
    estimates = convergence.shipped_estimates(studied, 1, range(2))
    for number, case in enumerate(studied):
        assert bool((estimates[:, number] == 1.0).all()) == (case.sigma == 0.0), case


def test_the_table_keeps_the_curves(tmp_path: Path) -> None:
    curves = convergence.read(FOLDER / "study.csv")
    convergence.write(curves, tmp_path / "again.csv")
    for old, new in zip(curves, convergence.read(tmp_path / "again.csv"), strict=True):
        assert (old.case, old.set) == (new.case, new.set)
        assert np.array_equal(old.rmse, new.rmse)
        assert np.array_equal(old.slope, new.slope, equal_nan=True)


def test_the_page_says_what_the_table_says() -> None:
    text = (FOLDER / "README.md").read_text(encoding="utf-8")
    assert text == page(convergence.read(FOLDER / "study.csv")), "run `make study`, or its part `page`"
    named = set(re.findall(r"\(([\w./]+\.(?:png|csv|py))\)", text))
    naive = "../../tests/oracles/naive_estimators.py"
    assert named >= {"convergence_ao.png", "running_ao.png", "reflections.png", "study.csv", naive}
    assert not [name for name in named if not (FOLDER / name).exists()]


def test_measuring_needs_no_blender() -> None:
    code = "import sys, occlusion_bake.bench.study.__main__; sys.exit('bpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_rays_from_both_light_and_lobe_fail_in_no_case(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where one of the two is useless, half of each stays near the other."""
    monkeypatch.setattr(light, "RAYS", (64,))
    monkeypatch.setattr(light, "TRUTH_RAYS", 1 << 10)  # of 1024 texels: to 1e-4, a hundredth of the least error here
    for case in light.cases()[:2]:
        found = {way: values[0] for way, values in light.errors(case).items()}
        best, worst = min(found.values()), max(found.values())
        assert worst > 30 * best and found["half of each"] < 3 * best
