"""Large images, most of which a coarser one tells: as good as asked for, and no less is seen."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from occlusion_bake.core.bake import Baked
from occlusion_bake.core.rays.map_spec import AO, bent, reflection
from occlusion_bake.core.scene.scene import Scene
from occlusion_bake.tests.oracles import shapes
from occlusion_bake.tests.oracles.bakes import bake_one

SIZE = 256
WANTED = 1 / 255


@pytest.fixture(autouse=True)
def small_images_are_halved(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("occlusion_bake.core.coarse_first.LEAST_TEXELS", 1 << 10)


@pytest.fixture(scope="module")
def scene() -> Scene:
    """A floor with a ball on it, a wall, and a small box whose contact is a few texels wide."""
    ball = shapes.sphere((0.5, 0.4, 0.6), 0.6, 48)
    wall = shapes.quad((1, -2, 0), (0, 4, 0), (0, 0, 1.5), name="wall")
    crate = shapes.moved(shapes.block(0.06, name="crate"), (-1.0, -1.0, 0.062))
    made: Scene = shapes.scene(shapes.plane(2.0, name="floor"), ball, wall, crate)
    return made


def rmse(baked: Baked, reference: Baked, name: str = "ao") -> float:
    difference = baked.maps[name].values.astype(np.float64) - reference.maps[name].values
    return float(np.sqrt(np.mean(difference**2)))


@pytest.fixture(scope="module")
def reference(scene: Scene) -> Baked:
    made: Baked = bake_one(scene, size=SIZE, rays=1024, seed=77, maps=(AO, reflection(10)))
    return made


def test_the_error_is_the_one_asked_for_and_told(scene: Scene, reference: Baked) -> None:
    for seed in range(3):
        baked = bake_one(scene, size=SIZE, error=WANTED, seed=seed)
        made = rmse(baked, reference)
        assert made < 1.1 * WANTED and 0.75 < baked.maps["ao"].error / made < 1.33


def test_what_is_smooth_takes_fewer_rays(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = shapes.scene(shapes.plane(2.0, name="floor"), shapes.sphere((0.0, 0.0, 0.8), 0.6, 48))
    halved = bake_one(scene, size=2 * SIZE, error=WANTED).maps["ao"].rays
    monkeypatch.setattr("occlusion_bake.core.coarse_first.LEAST_TEXELS", 1 << 30)
    assert halved < 0.5 * bake_one(scene, size=2 * SIZE, error=WANTED).maps["ao"].rays


def test_a_contact_shadow_of_a_few_texels_is_not_lost(scene: Scene, reference: Baked) -> None:
    """Under a crate of eight texels, and right beside it."""
    baked = bake_one(scene, size=SIZE, error=WANTED)
    right = reference.maps["ao"].values
    y, x = (int(SIZE * (0.5 + along / 4.0)) for along in (1.0, -1.0))  # rows go down as y goes up
    here = np.s_[y - 12 : y + 12, x - 12 : x + 12]
    assert right[here].min() < 0.05 and right[here].max() > 0.9
    assert np.abs(baked.maps["ao"].values[here] - right[here]).max() < 0.12
    assert np.sqrt(np.mean((baked.maps["ao"].values[here] - right[here]) ** 2)) < 4 * WANTED


@pytest.mark.parametrize("size", [(256, 128), (250, 252), (129, 256)])
def test_images_of_any_size_are_as_good(scene: Scene, size: tuple[int, int]) -> None:
    """Halved as often as their sides are even."""
    settings = {"width": size[0], "height": size[1]}
    right = bake_one(scene, rays=1024, seed=77, **settings)
    assert rmse(bake_one(scene, error=2 * WANTED, **settings), right) < 2.2 * WANTED


def test_a_chart_of_a_few_texels_has_values_of_its_own() -> None:
    """One in the dark, beside a large one in the open; its texels are fewer than what coarse ones could tell."""
    large = shapes.quad((-2, -2, 0), (4, 0, 0), (0, 4, 0), cell=(0.0, 0.0, 1.0, 0.96))
    small = shapes.quad((8, 0, 0), (0.06, 0, 0), (0, 0.06, 0), cell=(0.98, 0.98, 0.992, 0.992))
    lid = shapes.moved(shapes.block((0.5, 0.5, 0.01), name="lid"), (8, 0, 0.03))
    baked = bake_one(shapes.scene(shapes.joined([large, small]), lid), size=SIZE, error=4 * WANTED).maps["ao"]
    corner = np.s_[:8, -8:]
    dark = baked.values[corner][baked.covered[corner]]
    assert len(dark) >= 4 and dark.max() < 0.2


@pytest.mark.parametrize("error", [1e-5, 0.5])
def test_the_least_and_the_largest_error_may_be_asked_for(error: float, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("occlusion_bake.core.solve.adaptive_sampler.MOST_ROUNDS", 1)
    assert bake_one(shapes.scene(shapes.plane(1.0)), size=SIZE, error=error).maps["ao"].error == 0.0


def test_several_maps_come_from_the_same_halving(scene: Scene, reference: Baked) -> None:
    baked = bake_one(scene, size=SIZE, error=2 * WANTED, maps=(bent(), reflection(10)))
    assert rmse(baked, reference, "ro_10") < 2.2 * WANTED
    assert {"ao", "ro_10"} <= set(baked.maps)


@pytest.mark.parametrize("settings", [{"error": WANTED}, {"error": WANTED, "maps": (AO, reflection(10))}])
def test_the_bits_are_the_same_for_any_number_of_threads(scene: Scene, settings: dict[str, Any]) -> None:
    one, three = (bake_one(scene, size=SIZE, threads=threads, **settings) for threads in (1, 3))
    for name, each in one.maps.items():
        assert_array_equal(each.values, three.maps[name].values)


@pytest.mark.parametrize(("bound", "value"), [("MOST_MISSED", 0.0), ("MOST_GROWTH", -1.0)])
def test_where_too_much_is_missed_no_image_is_halved(
    bound: str, value: float, scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Or where the halved one asks for too many rays."""
    monkeypatch.setattr(f"occlusion_bake.core.coarse_first.{bound}", value)
    given_up = bake_one(scene, size=SIZE, error=WANTED).maps["ao"]
    monkeypatch.setattr("occlusion_bake.core.coarse_first.LEAST_TEXELS", 1 << 30)
    whole = bake_one(scene, size=SIZE, error=WANTED).maps["ao"]
    assert_array_equal(given_up.values, whole.values)
    assert given_up.rays == whole.rays


def test_a_comb_finer_than_texels_is_as_good_as_asked_for() -> None:
    """Its shadows are stripes of a texel or two."""
    places = np.linspace(-1.9, 1.9, 96)
    teeth = [shapes.moved(shapes.block((0.006, 2.0, 0.02), name=f"tooth {x}"), (x, 0, 0.03)) for x in places]
    scene = shapes.scene(shapes.plane(2.0, name="floor"), *teeth)
    right = bake_one(scene, size=SIZE, rays=1024, seed=77)
    assert rmse(bake_one(scene, size=SIZE, error=2 * WANTED), right) < 2.2 * WANTED
