"""Bent normals where the mean open direction is known: beside a wall, in a trench, under a cap."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from occlusion_bake.core.base.errors import InputError
from occlusion_bake.core.maps.bent_normals import BentNormalMap, Space
from occlusion_bake.tests.oracles import shapes
from occlusion_bake.tests.oracles.bakes import bake_one

PATCH = shapes.with_tangents(shapes.patch())
WALL = np.array([2 / np.pi, 0.0, 1.0]) / np.hypot(2 / np.pi, 1.0)  # beside a wall without end: 32.5 degrees off


def decoded(baked: Any) -> NDArray[np.float64]:
    """The mean direction of the covered texels."""
    result = baked.maps["bent"]
    directions = 2.0 * result.values[result.covered][:, :3].astype(np.float64) - 1.0
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0, atol=1e-6)
    mean: NDArray[np.float64] = directions.mean(axis=0)
    return mean / np.linalg.norm(mean)


@pytest.mark.parametrize("space", Space)
@pytest.mark.parametrize("effort", [{"rays": 256}, {"error": 0.004}])
def test_beside_a_wall_it_leans_away(space: Space, effort: dict[str, float]) -> None:
    """(∫ ω cos) over half of the hemisphere: 2/(3π) across, 1/3 up."""
    baked = bake_one(shapes.beside_a_wall(PATCH), size=16, bent=BentNormalMap(space), **effort)
    np.testing.assert_allclose(decoded(baked), WALL, atol=4e-3)
    assert baked.maps["ao"].mean == pytest.approx(0.5, abs=5e-3)


@pytest.mark.parametrize("scale", [(1, 1, 1), (2, 2, 2), (1, -1, 1), (-1, 1, 1)])
@pytest.mark.parametrize("turned", [False, True])
def test_spaces_under_a_matrix(scale: Any, turned: bool) -> None:
    """Told by the object it is as before; in the world it turns with it."""
    matrix = shapes.matrix((5, -3, 2), scale, turned)
    scene = shapes.beside_a_wall(PATCH, matrix)
    linear = matrix[:3, :3] / np.cbrt(abs(np.linalg.det(matrix[:3, :3])))
    for space, expected in ((Space.OBJECT, WALL), (Space.TANGENT, WALL), (Space.WORLD, linear @ WALL)):
        np.testing.assert_allclose(decoded(bake_one(scene, rays=256, bent=BentNormalMap(space))), expected, atol=4e-3)


def test_the_tangent_frame_is_the_meshs() -> None:
    x, _, z = WALL
    for frame, expected in (
        ({"tangent": (0, 1, 0)}, (0, -x, z)),
        ({"tangent": (0, 1, 0), "sign": -1.0}, (0, x, z)),
        ({"tangent": (-1, 0, 0)}, (-x, 0, z)),
        ({"tangent": (3, 0, 0)}, (x / 3 / np.hypot(x / 3, z), 0, z / np.hypot(x / 3, z))),  # not made a unit vector
    ):
        foot = shapes.with_tangents(shapes.patch(), **frame)
        baked = bake_one(shapes.beside_a_wall(foot), rays=256, bent=BentNormalMap())
        np.testing.assert_allclose(decoded(baked), expected, atol=4e-3)
    foot = shapes.with_tangents(shapes.patch(), tangent=(0, 1, 0))
    down = bake_one(shapes.beside_a_wall(foot), rays=256, bent=BentNormalMap(y_down=True))
    np.testing.assert_allclose(decoded(down), (0, x, z), atol=4e-3)


def test_in_a_trench() -> None:
    """Open from -α to β across it: x to z as (sin²β - sin²α) / 2 to the integral of cos²."""
    left, right = np.radians(20.0), np.radians(60.0)
    far = 64.0
    sides = [
        shapes.quad((-np.tan(left), -far, 0), (0, 2 * far, 0), (0, 0, 1), name="left"),
        shapes.quad((np.tan(right), -far, 0), (0, 2 * far, 0), (0, 0, 1), name="right"),
    ]
    scene = shapes.scene(shapes.patch(), *sides)
    across = 0.5 * (np.sin(right) ** 2 - np.sin(left) ** 2)
    up = 0.5 * (left + right) + 0.25 * (np.sin(2 * left) + np.sin(2 * right))
    baked = bake_one(scene, rays=1024, size=8, bent=BentNormalMap(Space.WORLD))
    np.testing.assert_allclose(decoded(baked), np.array([across, 0, up]) / np.hypot(across, up), atol=4e-3)
    assert baked.maps["ao"].mean == pytest.approx(0.5 * (np.sin(left) + np.sin(right)), abs=3e-3)


def test_in_a_bowl() -> None:
    """From anywhere in a hemispherical bowl the open part is the disc of its rim: by Stokes' theorem the mean of ω cos
    over what lies beyond a plane curve leans as the curve is seen; on the axis it is the axis."""
    bowl = shapes.sphere(segments=128, smooth=True)
    keep = bowl.vertices[bowl.triangles][:, :, 2].max(axis=1) <= 1e-6
    inward = replace(
        bowl,
        triangles=np.ascontiguousarray(bowl.triangles[keep][:, [0, 2, 1]]),
        uv=np.ascontiguousarray(bowl.uv[keep][:, [0, 2, 1]]),
        normals=np.ascontiguousarray(-bowl.normals[keep][:, [0, 2, 1]]),
    )
    baked = bake_one(shapes.scene(inward), rays=256, size=64, bent=BentNormalMap(Space.WORLD))
    result = baked.maps["bent"]
    lowest = result.covered.copy()
    lowest[:-4] = False  # the last rows of the image lie about the pole
    mean = (2.0 * result.values[lowest] - 1.0).mean(axis=0)
    np.testing.assert_allclose(mean / np.linalg.norm(mean), (0, 0, 1), atol=0.01)
    assert baked.maps["ao"].mean == pytest.approx(0.5, abs=0.01)


def test_in_the_open_and_where_all_is_closed_it_is_the_normal() -> None:
    for mesh in (shapes.plane(1.0), shapes.room()):
        for space in (Space.TANGENT, Space.OBJECT, Space.WORLD):
            scene = shapes.scene(shapes.with_tangents(mesh))
            if space is Space.TANGENT and mesh.name == "room":
                continue  # its sides have frames of their own
            values = bake_one(scene, rays=256, size=48, bent=BentNormalMap(space)).maps["bent"]
            if mesh.name == "plane":
                mean = 2.0 * values.values[values.covered].mean(axis=0) - 1.0
                np.testing.assert_allclose(mean, (0, 0, 1), atol=2e-3)
            else:
                directions = 2.0 * values.values[values.covered] - 1.0
                assert np.all(np.isclose(np.abs(directions).max(axis=1), 1.0))  # along an axis, as the sides are


def test_alpha_is_ao_and_the_error_is_told() -> None:
    scene = shapes.scene(shapes.with_tangents(shapes.plane(2.0, name="floor")), shapes.sphere((0, 0, 0.5), 0.5, 32))
    baked = bake_one(scene, size=64, rays=64, bent=BentNormalMap(with_ao=True))
    bent = baked.maps["bent"]
    np.testing.assert_array_equal(bent.values[..., 3], baked.maps["ao"].values)
    truth = bake_one(scene, size=64, rays=8192, seed=9, bent=BentNormalMap()).maps["bent"]
    apart = np.linalg.norm(2 * (bent.values[..., :3] - truth.values)[bent.covered], axis=1)
    true = float(np.sqrt(np.average(apart**2, weights=baked.maps["ao"].values[bent.covered])))
    assert 0.005 < true < 0.1 and 0.75 < bent.error / true < 1.33


def test_ao_is_what_it_is_without_bent_normals() -> None:
    scene = shapes.beside_a_wall(PATCH)
    alone = bake_one(scene, rays=64).maps["ao"].values
    np.testing.assert_array_equal(bake_one(scene, rays=64, bent=BentNormalMap()).maps["ao"].values, alone)
    only = bake_one(scene, rays=64, bent=BentNormalMap(), maps=())
    assert list(only.maps) == ["bent"]


def test_tangent_space_needs_tangents() -> None:
    with pytest.raises(InputError, match=r"patch: it has no tangents.*nor bent normals in tangent space"):
        bake_one(shapes.scene(shapes.patch()), bent=BentNormalMap())
    assert BentNormalMap() == BentNormalMap(Space.TANGENT, False, False)
