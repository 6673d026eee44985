"""Error figures with known answers, and a picture whose colours mean what it says."""

from __future__ import annotations

import numpy as np
import pytest
from occlusion_bake.core.base.errors import InputError
from occlusion_bake.core.finish.compare import Comparison, compare, comparison_image, noise

NOWHERE = np.zeros((4, 5), dtype=bool)


def flat(level: float, shape: tuple[int, int] = (4, 5)) -> np.ndarray:
    return np.full(shape, level, dtype=np.float32)


def test_a_constant_offset_is_all_bias() -> None:
    found = compare(flat(0.75), flat(0.5), ~NOWHERE)
    assert found == Comparison(texels=20, rmse=0.25, bias=0.25, p99=0.25, worst=0.25)
    assert compare(flat(0.5), flat(0.75), ~NOWHERE).bias == -0.25


def test_figures_by_hand() -> None:
    ours = np.arange(101, dtype=np.float32)[None] / 128
    ours[0, 1::2] *= -1
    found = compare(ours, np.zeros_like(ours), np.ones_like(ours, dtype=bool))
    assert found.texels == 101
    assert found.rmse == pytest.approx(np.sqrt(sum(k * k for k in range(101)) / 101) / 128, rel=1e-12)
    assert found.bias == pytest.approx(50 / 101 / 128, rel=1e-12)
    assert found.p99 == 99 / 128
    assert found.worst == 100 / 128


def test_only_the_mask_counts() -> None:
    ours, mask = flat(0.5), NOWHERE.copy()
    mask[1, 2] = True
    ours[1, 2] = 1.0
    ours[0, 0] = np.nan
    assert compare(ours, flat(0.5), mask) == Comparison(texels=1, rmse=0.5, bias=0.5, p99=0.5, worst=0.5)


def test_sums_are_taken_in_double_precision() -> None:
    shape = (2048, 2048)
    step = np.float32(2.0**-20)
    found = compare(flat(0.5, shape) + step, flat(0.5, shape), np.ones(shape, dtype=bool))
    assert found.bias == found.rmse == found.worst == 2.0**-20


def test_noise_is_that_of_one_bake_and_ignores_bias() -> None:
    random, sigma, shape = np.random.default_rng(0), 0.02, (300, 400)
    ground = random.random(shape) + 0.3
    a, b = ((ground + sigma * random.standard_normal(shape)).astype(np.float32) for _ in range(2))
    # The variance of n squared normals has a relative spread of sqrt(2 / n); five of them, halved by the root.
    assert noise(a, b, np.ones(shape, dtype=bool)) == pytest.approx(sigma, rel=2.5 * np.sqrt(2.0 / a.size))
    assert noise(a, a, np.ones(shape, dtype=bool)) == 0.0


@pytest.mark.parametrize("judge", [compare, noise, comparison_image])
def test_what_cannot_be_compared_is_refused(judge) -> None:
    spoiled = flat(0.5)
    spoiled[2, 2] = np.nan
    cases = [
        (flat(0.5), flat(0.5), NOWHERE, "no texel"),
        (spoiled, flat(0.5), ~NOWHERE, "1 texels are not finite"),
        (flat(0.5), spoiled, ~NOWHERE, "1 texels are not finite"),
        (flat(0.5), flat(0.5, (5, 4)), ~NOWHERE, "one size"),
    ]
    for ours, reference, mask, cause in cases:
        with pytest.raises(InputError, match=cause) as refusal:
            judge(ours, reference, mask)
        assert "\n" not in str(refusal.value)


@pytest.fixture
def panels():
    """Three panels cut from a picture of a 400 x 400 comparison: grey, steps of difference, an uncovered strip."""
    pytest.importorskip("OpenImageIO", reason="OpenImageIO is not installed")
    reference = flat(0.25, (400, 400))
    ours = reference.copy()
    ours[:, 100:200] += np.float32(0.125)
    ours[:, 200:300] -= np.float32(0.125)
    mask = np.ones((400, 400), dtype=bool)
    mask[:, 300:] = False
    shown = comparison_image(ours, reference, mask, ("Ours", "Theirs"))
    top = next(y for y in range(shown.shape[0]) if np.all(shown[y, 416:716] == np.float32(0.25)))
    return shown, [shown[top : top + 400, left : left + 400] for left in (8, 416, 824)]


def test_panels_show_raw_values_and_uncovered_grey(panels) -> None:
    shown, (ours, reference, difference) = panels
    assert shown.dtype == np.float32
    assert shown.shape[2] == 3
    assert shown.min() >= 0.0
    assert shown.max() <= 1.0
    assert np.all(reference[:, :300] == np.float32(0.25))
    assert np.all(ours[:, 100:200] == np.float32(0.375))
    assert np.all(ours[:, 200:300] == np.float32(0.125))
    for panel in (ours, reference, difference):
        assert np.all(panel[:, 300:] == panel[0, 350, 0])


def test_blue_is_darker_red_is_brighter_white_agrees(panels) -> None:
    _, (_, _, difference) = panels
    agrees, brighter, darker, uncovered = (difference[200, x] for x in (50, 150, 250, 350))
    assert agrees.min() > 0.9
    assert brighter[0] > 1.5 * brighter[2]
    assert darker[2] > 1.5 * darker[0]
    assert np.ptp(uncovered) == 0.0
    assert agrees.min() - uncovered.max() > 0.3


def test_captions_are_drawn(panels) -> None:
    shown, _ = panels
    for left in (8, 416, 824):
        for strip in (shown[: -400 - 8], shown[-60:]):
            assert strip[:, left : left + 400].min() < 0.5


def test_images_that_agree_are_white_and_small_ones_are_enlarged() -> None:
    pytest.importorskip("OpenImageIO", reason="OpenImageIO is not installed")
    shown = comparison_image(flat(0.5), flat(0.5), ~NOWHERE)
    assert shown.shape[1] > 3 * 384
    assert np.all(np.isfinite(shown))
    middle = shown[shown.shape[0] // 2, -100]
    assert middle.min() > 0.9


def test_a_tall_narrow_image_keeps_its_shape() -> None:
    pytest.importorskip("OpenImageIO", reason="OpenImageIO is not installed")
    shown = comparison_image(flat(0.5, (40, 16)), flat(0.4, (40, 16)), np.ones((40, 16), dtype=bool))
    assert shown.shape[0] > 24 * 40
