"""The ground lies under all that stands in the scene, as near as to touch it, whatever else strays about."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from occlusion_bake.core.bake import bake
from occlusion_bake.core.base.arrays import Doubles
from occlusion_bake.core.scene.ground_plane import ground_below
from occlusion_bake.core.scene.scene import Instance, Mesh, Scene
from occlusion_bake.core.scene.world_mesh import bounds_of
from occlusion_bake.tests.oracles import shapes
from occlusion_bake.tests.oracles.settings import flat_settings

BLOCK = shapes.instance(shapes.block(), shapes.matrix((3.0, 4.0, 2.0)), "block")  # from z = 1 up
STRAY = np.array([[1e6, 0, 5], [1e6, 1, 5], [1e6, 0, 6]], dtype=np.float32)


def strewn(instance: Instance) -> Instance:
    mesh = instance.mesh
    stray = Mesh("stray", STRAY, np.arange(3, dtype=np.int32).reshape(1, 3), np.zeros((1, 3, 2), dtype=np.float32))
    return replace(instance, mesh=shapes.joined([replace(mesh, normals=None), stray]))


@pytest.mark.parametrize(
    "standing",
    [
        [BLOCK],
        [strewn(BLOCK)],
        [BLOCK, shapes.instance(shapes.sphere(), shapes.matrix((0, 0, 5e4), 1e4), "moon")],
        [shapes.instance(Mesh("none", STRAY, np.zeros((0, 3), dtype=np.int32))), BLOCK],
    ],
    ids=["alone", "with a stray part", "with a moon", "with an empty mesh"],
)
def test_it_lies_a_hair_below_the_lowest(standing: list[Instance]) -> None:
    low, high = bounds_of(ground_below(standing))
    assert 0.9995 < low[2] == high[2] < 1.0
    reach: Doubles = np.max([np.abs(each) for box in map(bounds_of, standing[-1:]) for each in box], axis=0)
    assert np.all(low[:2] < -100 * reach[:2]) and np.all(high[:2] > 100 * reach[:2])


def test_a_stray_part_leaves_what_stands_on_it_as_it_was() -> None:
    """A lid of the block's own, half its height above the ground, sees as much of it with a stray part as without."""
    values = []
    for target in (BLOCK, strewn(BLOCK)):
        scene = Scene([target], [target, ground_below([target])])
        (baked,) = bake(scene, flat_settings(width=32, height=32, rays=64))
        values.append(baked.maps["ao"].values)
    assert 0.3 < values[0].mean() < 0.7
    assert np.abs(values[0] - values[1]).max() <= 2 / 64


def test_it_stays_where_something_moves_a_little() -> None:
    """Else whatever stands on it would have to be baked again."""
    there = [shapes.instance(shapes.block(name=f"{x}"), shapes.matrix((3.0 * x, 0.3, 1.0))) for x in range(4)]
    before = ground_below(there)
    moved = [*there[:-1], shapes.instance(shapes.block(name="3"), shapes.matrix((9.2, 0.4, 1.3)))]
    assert np.array_equal(ground_below(moved).matrix, before.matrix)
    lower = [*there[:-1], shapes.instance(shapes.block(name="3"), shapes.matrix((9.0, 0.3, 0.9)))]
    assert ground_below(lower).matrix[2, 3] < before.matrix[2, 3]
