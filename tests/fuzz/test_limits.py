"""How large and how small a scene may be, and that within these bounds its size does not matter."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from occlusion_bake.core.bake import bake
from occlusion_bake.core.base.errors import InputError
from occlusion_bake.core.scene.checks import LARGEST, SMALLEST
from occlusion_bake.core.scene.scene import Instance, Scene
from occlusion_bake.core.scene.world_mesh import bounds_of, world_mesh
from occlusion_bake.tests.oracles.properties import moved
from occlusion_bake.tests.oracles.wild_bakes import WildBake, WildMap, WildMesh, WildObject

TERRAIN = WildBake(
    WildObject(WildMesh("grid", 200, 3, normals="tilted")),
    (WildObject(WildMesh("soup", 10, 4)),),
    (WildMap(None), WildMap(40.0, "importance", True), WildMap(3.0, "uniform_sphere")),
    width=16,
    height=16,
)


def values(scene: Scene) -> np.ndarray:
    (baked,) = bake(scene, TERRAIN.settings())
    return np.stack([result.values for result in baked.maps.values()])


def grown(factor: float) -> Scene:
    return moved(TERRAIN.scene(), np.diag([factor, factor, factor, 1.0]))


def size_of(scene: Scene) -> float:
    low, high = bounds_of(scene.targets[0])
    return float((high - low).max())


def test_from_the_smallest_size_to_the_largest_not_a_bit_changes() -> None:
    here = values(TERRAIN.scene())
    size = size_of(TERRAIN.scene())
    assert 0.05 < here[0].mean() < 0.99
    for factor in (2.0 ** np.ceil(np.log2(SMALLEST / size)), 2.0 ** np.floor(np.log2(LARGEST / size)), 2.0**-9):
        assert_array_equal(values(grown(factor)), here)


@pytest.mark.parametrize("factor", [0.9 * SMALLEST, 1.1 * LARGEST, 1e-40, 1e30, 1e200, 1e300])
def test_what_cannot_be_traced_is_refused(factor: float) -> None:
    with pytest.raises(InputError, match=r"^target: it is \S+ units across, .*; scale.*$|^the scene's camera: "):
        values(grown(factor / size_of(TERRAIN.scene())))


@pytest.mark.parametrize("far", [1e4, 1e6, 1e30])
def test_a_loose_vertex_far_off_costs_no_precision(far: float) -> None:
    """It would move the middle of the box, which the rays are traced about."""
    scene = TERRAIN.scene()
    target = scene.targets[0]
    stray = np.concatenate([target.mesh.vertices, np.full((1, 3), far, np.float32)])
    strewn = Instance("target", replace(target.mesh, vertices=stray), target.matrix)
    assert_array_equal(values(Scene([strewn], [strewn, *scene.occluders[1:]], scene.camera)), values(scene))


@pytest.mark.parametrize("factor", [1e-25, 1e25])
def test_normals_survive_a_change_of_units(factor: float) -> None:
    """A mesh far too small or large under a matrix that makes up for it, whose inverse leaves float32's range."""
    target = TERRAIN.scene().targets[0]
    matrix = np.diag([factor, factor, 2.0 * factor, 1.0])
    mesh = replace(target.mesh, vertices=(target.mesh.vertices / factor).astype(np.float32))
    plain = world_mesh(Instance("plain", target.mesh, np.diag([1.0, 1.0, 2.0, 1.0])), np.zeros(3))
    other = world_mesh(Instance("other", mesh, matrix), np.zeros(3))
    assert plain.normals is not None and other.normals is not None
    assert_allclose(other.normals, plain.normals, atol=1e-6)
    assert_allclose(np.linalg.norm(other.normals, axis=-1), 1.0, atol=1e-6)


@pytest.mark.parametrize("factor", [1e13, 1e30, 1e300, 1e308])
def test_an_occluder_without_measure_is_left_out_with_a_word(factor: float) -> None:
    scene = TERRAIN.scene()
    vast = Instance("vast", scene.targets[0].mesh, np.diag([factor, factor, factor, 1.0]) + np.eye(4, k=3))
    (baked,) = bake(Scene(scene.targets, [*scene.occluders, vast], scene.camera), TERRAIN.settings())
    assert baked.warnings == ["vast: it is more than 1e+12 units across; it does not occlude"]
    assert_array_equal(np.stack([result.values for result in baked.maps.values()]), values(scene))


@pytest.mark.parametrize(
    ("break_it", "cause"),
    [
        (lambda mesh: replace(mesh, uv=mesh.uv[:-1]), "UVs"),
        (lambda mesh: replace(mesh, uv=np.concatenate([mesh.uv, mesh.uv])), "UVs"),
        (lambda mesh: replace(mesh, normals=mesh.normals[:-1]), "normals"),
        (lambda mesh: replace(mesh, vertices=mesh.vertices[:-1]), "vertex that does not exist"),
        (lambda mesh: replace(mesh, triangles=mesh.triangles - 1), "vertex that does not exist"),
    ],
)
def test_arrays_that_do_not_fit_are_refused(break_it: Any, cause: str) -> None:
    """The kernel would read beyond them."""
    scene = TERRAIN.scene()
    broken = replace(scene.targets[0], mesh=break_it(scene.targets[0].mesh))
    with pytest.raises(InputError, match=f"^target: .*{cause}.*; make the mesh again$"):
        values(Scene([broken], scene.occluders[1:], scene.camera))
