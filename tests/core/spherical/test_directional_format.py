"""Codes as channels and images: names, ranges, there and back; and how near RO comes to the truth."""

from __future__ import annotations

import re
from collections.abc import Callable
from itertools import pairwise
from math import sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from occlusion_bake.core.base.errors import InputError
from occlusion_bake.core.spherical import directional_format, spherical_harmonics, visibility_mask
from occlusion_bake.core.spherical.directional_format import (
    DirectionalFormat,
    channel_names,
    encode,
    from_images,
    ranges,
    rebuild,
    to_images,
)
from occlusion_bake.core.spherical.hemisphere_cells import coarser, directions, subcells
from occlusion_bake.core.spherical.lobe import open_horizon

EVERY = [
    *(DirectionalFormat("sh", degree) for degree in range(1, 7)),
    *(DirectionalFormat(k, s) for k in ("mask", "cells") for s in (8, 16)),
]
NAMES = [code.name for code in EVERY]
FINE = 64  # directions along a side of the square


@pytest.fixture(scope="module")
def drawn() -> np.ndarray[Any, Any]:
    return np.random.default_rng(0).random((30, 16, 16)).astype(np.float32)


def occluded(count: int) -> np.ndarray[Any, Any]:
    """V of texels among walls and balls, (count, FINE, FINE): a few of each that no surface of theirs would hide."""
    ways = subcells(1, FINE)[0]
    rng = np.random.default_rng(11)
    seen = np.ones((count, len(ways)), dtype=bool)
    for texel in range(count):
        for _ in range(rng.integers(1, 3)):
            across = rng.normal(size=3) * (1, 1, 0.2)
            towards = ways @ (across / np.linalg.norm(across))
            rise = np.divide(ways[:, 2], towards, out=np.full(len(ways), np.inf), where=towards > 0)
            seen[texel] &= rise > rng.uniform(0.1, 1.5)
        for _ in range(rng.integers(0, 3)):
            towards = ways @ directions(rng.random(), rng.random())
            seen[texel] &= towards < np.cos(rng.uniform(0.1, 0.7))
    return seen.reshape(count, FINE, FINE)


@pytest.mark.parametrize("code", EVERY, ids=NAMES)
def test_a_name_for_every_channel(code: DirectionalFormat, drawn: np.ndarray[Any, Any]) -> None:
    names = channel_names(code)
    assert len(names) == code.count == encode(drawn, code).shape[1] and len(set(names)) == len(names)
    assert names == sorted(names)  # programs list them so
    assert {name.partition(".")[0] for name in names} == {code.kind}


def test_names_and_counts() -> None:
    assert channel_names(DirectionalFormat("sh", 1)) == ["sh.00", "sh.01", "sh.02", "sh.03"]
    assert (
        channel_names(DirectionalFormat("mask", 16))[-1] == "mask.31"
        and channel_names(DirectionalFormat("cells", 16))[7] == "cells.007"
    )
    assert [code.count for code in EVERY] == [4, 9, 16, 25, 36, 49, 8, 32, 64, 256]
    assert (DirectionalFormat("sh", 3).name, DirectionalFormat("mask", 8).name) == ("sh_3", "mask_8")


def test_codes_are_those_of_their_modules(drawn: np.ndarray[Any, Any]) -> None:
    assert_array_equal(encode(drawn, DirectionalFormat("sh", 3)), spherical_harmonics.fit(drawn, 3))
    assert_array_equal(encode(drawn, DirectionalFormat("mask", 8)), visibility_mask.pack(coarser(drawn)))
    assert_array_equal(encode(drawn, DirectionalFormat("mask", 16)), visibility_mask.pack(drawn))
    assert_array_equal(encode(drawn, DirectionalFormat("cells", 16)).reshape(drawn.shape), drawn)
    assert_array_equal(
        encode(coarser(drawn), DirectionalFormat("cells", 8)), encode(drawn, DirectionalFormat("cells", 8))
    )
    assert all(encode(drawn, code).dtype == np.float32 for code in EVERY)


@pytest.mark.parametrize("code", EVERY, ids=NAMES)
def test_open_is_the_open_horizon(code: DirectionalFormat) -> None:
    reflected = directions(*np.random.default_rng(1).random((2, 20)))
    values = encode(np.ones((20, 16, 16), np.float32), code)
    assert_allclose(rebuild(values, code, reflected, 10), open_horizon(10, reflected[:, 2]), atol=2e-5)


@pytest.mark.parametrize("depth", [8, 16])
@pytest.mark.parametrize("code", EVERY, ids=NAMES)
def test_images_there_and_back(code: DirectionalFormat, depth: int, drawn: np.ndarray[Any, Any]) -> None:
    values = encode(drawn, code).reshape(5, 6, -1)
    images = to_images(values, code, depth)
    channels = code.count // 2 if code.kind == "mask" and depth == 16 else code.count
    assert len(images) == -(-channels // 4)
    assert all(each.shape == (5, 6, 4) and each.dtype == np.dtype(f"uint{depth}") for each in images)
    back = from_images(images, code)
    assert back.shape == values.shape and back.dtype == np.float32
    if code.kind == "mask":
        assert_array_equal(back, values)
        return
    low, high = ranges(code)
    half = 0.5 * (high - low) / (2**depth - 1)
    assert np.all(np.abs(back - values) <= half * 1.01 + 1e-6)
    assert np.abs(back - values).max() > 0.2 * half.max()
    for again, image in zip(to_images(back, code, depth), images, strict=True):
        assert_array_equal(again, image)


def test_where_channels_lie() -> None:
    values = np.arange(8, dtype=np.float32).reshape(1, 1, 8) * 30
    (first, second) = to_images(values, DirectionalFormat("mask", 8), 8)
    assert first.tolist() == [[[0, 30, 60, 90]]] and second.tolist() == [[[120, 150, 180, 210]]]
    (both,) = to_images(values, DirectionalFormat("mask", 8), 16)
    assert both.tolist() == [[[0 + 256 * 30, 60 + 256 * 90, 120 + 256 * 150, 180 + 256 * 210]]]
    nine = to_images(np.zeros((1, 1, 9), np.float32), DirectionalFormat("sh", 2), 8)
    assert nine[2][0, 0, 1:].tolist() == [255, 255, 255]
    low, high = ranges(DirectionalFormat("sh", 2))
    ends = [to_images(each.reshape(1, 1, 9), DirectionalFormat("sh", 2), 16)[0][0, 0].tolist() for each in (low, high)]
    assert ends == [[0] * 4, [65535] * 4]


@pytest.mark.parametrize("code", EVERY, ids=NAMES)
def test_all_codes_lie_in_their_ranges(code: DirectionalFormat) -> None:
    rng = np.random.default_rng(3)
    values = encode((rng.random((500, 16, 16)) < rng.random((500, 1, 1))).astype(np.float32), code)
    low, high = ranges(code)
    assert low.shape == high.shape == (code.count,)
    assert np.all(values >= low - 1e-5) and np.all(values <= high + 1e-5)


def errors(code: DirectionalFormat, depth: int | None = None) -> dict[float, float]:
    """RMSE of RO over texels and views of n·v from 0.15 to 1, by exponent. depth: through images of so many bits."""
    seen = occluded(200)
    cells = seen.reshape(-1, 16, FINE // 16, 16, FINE // 16).mean(axis=(2, 4)).astype(np.float32)
    values = encode(cells, code)
    if depth:
        values = from_images(to_images(values[None], code, depth), code)[0]
    cosines = np.linspace(0.15, 1.0, 18)
    turns = np.arange(18, dtype=np.int64) * 2.4
    views = np.stack([*(np.sqrt(1 - cosines**2) * each(turns) for each in (np.cos, np.sin)), cosines], axis=1)
    found = {}
    for exponent in (10.0, 32.0):
        lobes = np.maximum(views @ subcells(1, FINE)[0].T, 0) ** exponent
        lobes *= (open_horizon(exponent, cosines) / lobes.sum(axis=1))[:, None]
        rebuilt = [rebuild(values, code, np.repeat(view[None], len(cells), axis=0), exponent) for view in views]
        found[exponent] = float(np.sqrt(np.mean((np.array(rebuilt) - lobes @ seen.reshape(len(seen), -1).T) ** 2)))
    return found


def test_sixteen_numbers_tell_a_lobe_of_exponent_10() -> None:
    assert errors(DirectionalFormat("sh", 3))[10] <= 0.025
    assert errors(DirectionalFormat("sh", 3), depth=8)[10] <= 0.027


def test_thirty_two_bytes_tell_a_lobe_of_exponent_32() -> None:
    assert errors(DirectionalFormat("mask", 16))[32] <= 0.04


def test_more_numbers_are_nearer() -> None:
    found = [errors(DirectionalFormat("sh", degree))[10] for degree in (1, 2, 3, 4, 6)]
    assert all(more < 0.6 * fewer for fewer, more in pairwise(found))
    assert errors(DirectionalFormat("cells", 8))[32] < errors(DirectionalFormat("mask", 8))[32]


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: DirectionalFormat("sh", 0), "degree 0"),
        (lambda: DirectionalFormat("sh", 7), "degree 7"),
        (lambda: DirectionalFormat("mask", 12), "12 x 12"),
        (lambda: DirectionalFormat("cells", 32), "32 x 32"),
        (lambda: DirectionalFormat("cone", 8), "'cone'"),  # type: ignore[arg-type]
        (lambda: encode(np.ones((1, 8, 8), np.float32), DirectionalFormat("mask", 16)), "mask_16: the bake has 8 x 8"),
        (lambda: to_images(np.ones((1, 1, 16), np.float32), DirectionalFormat("sh", 3), 32), "32 bits"),
        (lambda: to_images(np.ones((1, 1, 15), np.float32), DirectionalFormat("sh", 3), 8), "15 values"),
        (lambda: from_images([np.zeros((1, 1, 4), np.uint8)] * 3, DirectionalFormat("sh", 3)), "3 images; give 4"),
        (lambda: from_images([], DirectionalFormat("sh", 3)), "sh_3"),
        (lambda: from_images([np.zeros((1, 1, 4), np.float32)] * 4, DirectionalFormat("sh", 3)), "32 bits"),
        (
            lambda: directional_format.rebuild(
                np.ones((1, 4), np.float32), DirectionalFormat("sh", 3), np.float64([[0, 0, 1]]), 1
            ),
            "4 values",
        ),
    ],
)
def test_what_cannot_be_is_refused_in_a_line(call: Callable[[], object], said: str) -> None:
    with pytest.raises(InputError, match=said) as refusal:
        call()
    assert "\n" not in str(refusal.value)


def test_the_page_has_the_ranges_of_degree_3() -> None:
    page = Path(__file__).resolve().parents[3] / "docs" / "directional.md"
    rows = re.findall(r"^\| [0-3] \|(.*)\|$", page.read_text(encoding="utf-8"), flags=re.MULTILINE)
    told = [float(number) for row in rows for number in row.split("|") if number.strip()]
    low, high = ranges(DirectionalFormat("sh", 3))
    assert_allclose(told, (high - low) / 2, atol=2e-6)


def test_one_step_of_8_bits_is_small() -> None:
    """Of degree 3 all steps together move RO of exponent 10 by less than 0.0125: they are independent, to a step's
    twelfth, and the lobe's terms weigh them."""
    low, high = ranges(DirectionalFormat("sh", 3))
    steps = (high - low) / 255 / sqrt(12)
    terms = spherical_harmonics.lobe_terms(10.0, np.linspace(0.15, 1, 20), 3)
    weights = [abs(terms[:, l * (l + 1) // 2 + abs(m)]) for l in range(4) for m in range(-l, l + 1)]  # noqa: E741
    assert np.sqrt(sum((step * weight) ** 2 for step, weight in zip(steps, weights, strict=True))).max() < 0.0125
