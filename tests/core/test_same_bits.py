"""A bake gives the same bits on every processor: whatever numpy and its libraries have for it."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest
from occlusion_bake.core import part_bake
from occlusion_bake.core.rays.tracer import TraceOptions
from occlusion_bake.tests.oracles import hashed_maps

try:
    from numpy._core import _multiarray_umath as numpy_core
except ImportError:  # numpy 1
    from numpy.core import _multiarray_umath as numpy_core  # type: ignore[no-redef]

# Kernels of OpenBLAS from old to new, and what a processor needs for each.
CORES = {"Prescott": "SSE3", "Haswell": "AVX2", "SkylakeX": "AVX512VL"}


def maps_of(scene: Path, **environment: str) -> list[str]:
    command = [sys.executable, "-m", "occlusion_bake.tests.oracles.hashed_maps", "hash", str(scene)]
    plain = {name: value for name, value in os.environ.items() if not name.startswith(("OPENBLAS", "NPY"))}
    ran = subprocess.run(command, env={**plain, **environment}, capture_output=True, text=True, check=True)
    return ran.stdout.splitlines()


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path: Path = tmp_path_factory.mktemp("scene") / "scene.pickle"
    hashed_maps.main("make", path)
    return path


def test_maps_have_the_same_bits_whatever_numpy_runs_on(scene: Path) -> None:
    as_it_is = maps_of(scene)
    assert len(as_it_is) >= 20
    present = [name for name in numpy_core.__cpu_dispatch__ if numpy_core.__cpu_features__.get(name)]
    without = {"NPY_DISABLE_CPU_FEATURES": " ".join(present)} if present else {}
    cores = [core for core, needs in CORES.items() if numpy_core.__cpu_features__.get(needs)]
    if not cores:
        pytest.skip("OpenBLAS has the same kernels for every processor of this kind")
    for core in cores:
        assert maps_of(scene, OPENBLAS_CORETYPE=core, **without) == as_it_is


def test_packets_of_every_width_give_the_same_bits(scene: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No ray of this scene grazes an edge; such a one Embree's traversals may answer differently."""
    read = pickle.loads(scene.read_bytes())

    def of_width(width: int) -> list[str]:
        monkeypatch.setattr(part_bake, "TraceOptions", partial(TraceOptions, packet_width=width))
        return list(hashed_maps.hashes(read))

    widest = of_width(16)
    assert len(widest) >= 20
    assert all(of_width(width) == widest for width in (8, 4, 1))


def test_other_rays_have_other_bits(scene: Path) -> None:
    """The hashes tell maps apart."""
    lines = maps_of(scene)
    assert len({line.rsplit(" ", 1)[1] for line in lines}) == len(lines)
