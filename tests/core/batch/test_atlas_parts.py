"""A part of an atlas comes back as it was baked, and what is broken is known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from occlusion_bake.core.bake import Baker, Goal, Settings
from occlusion_bake.core.base.errors import InputError
from occlusion_bake.core.batch.atlas_parts import is_part, read_part, write_part
from occlusion_bake.core.finish.atlas import Atlas
from occlusion_bake.core.finish.baked import Baked
from occlusion_bake.core.maps.bent_normals import BentNormalMap
from occlusion_bake.core.maps.occlusion import OcclusionMap
from occlusion_bake.core.rays.map_spec import AO, reflection
from occlusion_bake.core.settings import ImageSettings
from occlusion_bake.tests.oracles import shapes

SETTINGS = Settings(
    (OcclusionMap(AO), OcclusionMap(reflection(10)), BentNormalMap()), ImageSettings(24, 16, 0), Goal(4)
)


@pytest.fixture
def baked() -> Baked:
    floor = shapes.quad((-1, -1, 0), (2, 0, 0), (0, 2, 0), cell=(0.3, 0.2, 0.6, 0.8), name="floor")
    floor = shapes.with_tangents(floor, (1, 0, 0))
    scene = shapes.scene(floor, shapes.block(0.3))
    return Baker(scene, SETTINGS).bake(scene.targets[0])


def test_it_comes_back(tmp_path: Path, baked: Baked) -> None:
    path = tmp_path / "a" / "part.npz"
    write_part(path, baked)
    assert is_part(path, baked.inputs) and not is_part(path, "other")
    read = read_part(path, SETTINGS.maps)
    assert (read.name, read.size, read.rays, read.inputs) == (baked.name, baked.size, baked.rays, baked.inputs)
    assert (read.seconds, read.warnings, read.surface) == (baked.seconds, baked.warnings, baked.surface)
    whole = []
    for each in (baked, read):
        atlas = Atlas("all")
        atlas.add(each)
        whole.append(atlas.finish(4))
    assert whole[0].inputs == whole[1].inputs != ""
    for name, map_ in whole[0].maps.items():
        other = whole[1].maps[name]
        assert np.array_equal(map_.values, other.values) and np.array_equal(map_.coverage, other.coverage)
        assert np.array_equal(map_.covered, other.covered)
        assert (map_.error, map_.p99, map_.mean, map_.rays) == (other.error, other.p99, other.mean, other.rays)


@pytest.mark.parametrize("kept", [0.0, 0.5, 0.99])
def test_what_is_not_whole_is_none(tmp_path: Path, baked: Baked, kept: float) -> None:
    path = tmp_path / "part.npz"
    write_part(path, baked)
    path.write_bytes(path.read_bytes()[: int(kept * path.stat().st_size)])
    assert not is_part(path, baked.inputs)
    with pytest.raises(InputError, match="bake its item again"):
        read_part(path, SETTINGS.maps)


def test_changed_bytes_are_seen(tmp_path: Path, baked: Baked) -> None:
    path = tmp_path / "part.npz"
    write_part(path, baked)
    data = bytearray(path.read_bytes())
    data[len(data) // 3] ^= 0xFF
    path.write_bytes(data)
    assert not is_part(path, baked.inputs)
