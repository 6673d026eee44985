"""The shader that rebuilds reflection occlusion: its very text, compiled as C++ behind a few types and functions of
GLSL's, and run beside what numpy rebuilds."""

from __future__ import annotations

import ctypes
import os
import shlex
import shutil
import subprocess
from collections.abc import Callable
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from occlusion_bake.core.spherical import spherical_harmonics, visibility_mask
from occlusion_bake.core.spherical.hemisphere_cells import coarser, directions, subcells
from occlusion_bake.core.spherical.lobe import open_horizon
from occlusion_bake.core.spherical.lobe_lut import SIDE, TILES, lobe_lut

HERE = Path(__file__).resolve().parent
SHADER = HERE.parents[2] / "docs" / "engines" / "rebuild.glsl"
COUNT = 1000
Array = np.ndarray[Any, Any]
Run = Callable[..., Array]

_PROGRAM = """
#include "glsl_shim.h"
namespace glsl {
#include "rebuild.glsl"
}
using namespace glsl;
extern "C" void run(int which, int count, const float *code, const unsigned *mask, const float *r,
                    const float *exponent, const float *image, int width, int height, float *result) {
  const sampler2D lobes{image, width, height};
  for (int i = 0; i < count; ++i) {
    const vec3 way(r[3 * i], r[3 * i + 1], r[3 * i + 2]);
    float numbers[16];
    for (int k = 0; k < 16; ++k) numbers[k] = code[16 * i + k];
    const uvec2 bits{mask[2 * i], mask[2 * i + 1]};
    result[i] = which == 0   ? occlusion_from_harmonics(numbers, way, exponent[i], lobes)
                : which == 1 ? occlusion_from_mask(bits, way, exponent[i], lobes)
                             : occlusion_open(way, exponent[i], lobes);
  }
}
extern "C" void cells(float *result) {
  for (int k = 0; k < 64; ++k) {
    const vec3 way = occlusion_cell(k & 7, k >> 3);
    result[3 * k] = way.x, result[3 * k + 1] = way.y, result[3 * k + 2] = way.z;
  }
}
"""


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    compiler = shlex.split(os.environ.get("CXX", "")) or [shutil.which("c++") or "g++"]
    if shutil.which(compiler[0]) is None:
        pytest.skip("no C++ compiler")
    folder = tmp_path_factory.mktemp("shader")
    source, library = folder / "shader.cpp", folder / "shader.so"
    source.write_text(_PROGRAM, encoding="utf-8")
    flags = ["-std=c++17", "-O1", "-shared", "-fPIC", f"-I{HERE.parent}", f"-I{SHADER.parent}"]
    subprocess.run([*compiler, *flags, str(source), "-o", str(library)], check=True)
    return ctypes.CDLL(str(library))


@pytest.fixture(scope="module")
def run(library: ctypes.CDLL) -> Run:
    image = lobe_lut()

    def run_it(which: int, code: Array, mask: Array, r: Array, exponent: Array) -> Array:
        result = np.empty(len(r), np.float32)
        kinds = ((code, np.float32), (mask, np.uint32), (r, np.float32), (exponent, np.float32), (image, np.float32))
        given = [np.ascontiguousarray(each, dtype=kind) for each, kind in kinds]
        places = [ctypes.c_void_p(each.ctypes.data) for each in (*given, result)]
        library.run(which, len(r), *places[:5], image.shape[1], image.shape[0], places[5])
        return result

    return run_it


class Drawn:
    """Texels that half-spaces of all kinds hide parts of, views and exponents."""

    def __init__(self, count: int = COUNT) -> None:
        rng = np.random.default_rng(3)
        ways = subcells(16, 1)[:, 0]
        hidden = ways @ rng.normal(size=(3, count)) > 0.7 * rng.normal(size=count)
        self.cells = np.ascontiguousarray(~hidden.T).reshape(count, 16, 16).astype(np.float32)
        self.code = spherical_harmonics.fit(self.cells, 3)
        self.coarse = (coarser(self.cells) >= 0.5).astype(np.float32)
        self.mask = visibility_mask.pack(self.coarse).view("<u4")
        self.r = directions(*rng.random((2, count)))
        self.exponent = rng.choice(np.exp(rng.uniform(0, np.log(300), 16)).round(1), count)

    def each(self, rebuild: Callable[[int, float], Array]) -> Array:
        """A value a texel, of an array of one."""
        return np.array([rebuild(i, float(self.exponent[i]))[0] for i in range(len(self.r))])


@pytest.fixture(scope="module")
def drawn() -> Drawn:
    return Drawn()


def test_the_image_lies_as_it_is_said() -> None:
    image = lobe_lut()
    assert image.shape == (SIDE, TILES * SIDE, 3) and image.dtype == np.float32 and np.isfinite(image).all()
    column, row = 20, 30
    cosine, exponent = np.array([column / (SIDE - 1)]), 2 / (row / (SIDE - 1)) ** 2 - 2
    terms = spherical_harmonics.lobe_terms(exponent, cosine, 3)[0]
    smooth = [
        term / np.sqrt(1 - cosine[0] ** 2) ** m
        for term, (_, m) in zip(terms, spherical_harmonics.orders(3), strict=True)
    ]
    places = [(0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 1), (1, 0), (2, 0), (2, 2), (3, 0)]  # 00 10 11 20 21 22 30 …
    for (tile, channel), term in zip(places, smooth, strict=True):
        assert image[row, tile * SIDE + column, channel] == pytest.approx(term, abs=1e-5)
    assert not image[:, 3 * SIDE :, 1:].any()


def test_from_harmonics_it_is_what_numpy_rebuilds(run: Run, drawn: Drawn) -> None:
    expected = drawn.each(lambda i, e: spherical_harmonics.rebuild(drawn.code[i : i + 1], drawn.r[i : i + 1], e))
    found = run(0, drawn.code, drawn.mask, drawn.r, drawn.exponent)
    assert_allclose(found, expected, atol=2.5e-3)
    assert np.sqrt(np.mean((found - expected) ** 2)) < 3e-4
    assert expected.std() > 0.2


def test_every_coefficient_counts(run: Run, drawn: Drawn) -> None:
    """One at a time, about a texel that is half open."""
    r = drawn.r[:320]
    code = np.zeros((320, 16), np.float32)
    code[:, 0] = np.sqrt(pi)
    code[np.arange(320, dtype=np.int64), np.arange(320, dtype=np.int64) % 16] += 0.2
    found = run(0, code, drawn.mask[:320], r, np.full(320, 10.0))
    expected = spherical_harmonics.rebuild(code, r, 10.0)
    open_half = 0.5 * open_horizon(10.0, r[:, 2])
    assert_allclose(found, expected, atol=5e-4)
    assert np.abs(expected - open_half).reshape(20, 16).max(axis=0).min() > 0.02


def test_the_open_horizon(run: Run, drawn: Drawn) -> None:
    expected = drawn.each(lambda i, e: open_horizon(e, drawn.r[i : i + 1, 2]))
    assert_allclose(run(2, drawn.code, drawn.mask, drawn.r, drawn.exponent), expected, atol=2.5e-3)
    shut, whole = np.zeros((COUNT, 2), np.uint32), np.full((COUNT, 2), 0xFFFFFFFF, np.uint32)
    assert not run(1, drawn.code, shut, drawn.r, drawn.exponent).any()
    assert_allclose(run(1, drawn.code, whole, drawn.r, drawn.exponent), expected, atol=2.5e-3)


def test_a_mask_cell_by_cell(run: Run, library: ctypes.CDLL, drawn: Drawn) -> None:
    """The formula that the shader states, in numpy: the lobe, widened by a sixth of a cell, at the cells' middles."""
    middles = np.empty((64, 3), np.float32)
    library.cells(ctypes.c_void_p(middles.ctypes.data))
    assert_allclose(middles, subcells(8, 1)[:, 0], atol=1e-6)
    widened = drawn.exponent / (1 + drawn.exponent * 2 * pi / 64 / 6)
    lobe = np.maximum(drawn.r @ subcells(8, 1)[:, 0].T, 0) ** widened[:, None]
    share = (lobe * drawn.coarse.reshape(COUNT, 64)).sum(axis=1) / lobe.sum(axis=1)
    expected = share * drawn.each(lambda i, e: open_horizon(e, drawn.r[i : i + 1, 2]))
    assert_allclose(run(1, drawn.code, drawn.mask, drawn.r, drawn.exponent), expected, atol=2.5e-3)


def test_from_a_mask_it_is_near_what_numpy_integrates(run: Run, drawn: Drawn) -> None:
    """Where a lobe is no narrower than a cell; a narrow one sees the steps between cells softened."""
    expected = drawn.each(lambda i, e: visibility_mask.rebuild(drawn.coarse[i : i + 1], drawn.r[i : i + 1], e))
    off = np.abs(run(1, drawn.code, drawn.mask, drawn.r, drawn.exponent) - expected)
    wide = drawn.exponent < 10
    assert off[wide].max() < 0.04 and off[wide].mean() < 0.005
    assert np.sqrt(np.mean(off**2)) < 0.04
