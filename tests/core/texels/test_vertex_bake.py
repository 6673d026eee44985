"""Maps at the corners of faces."""

from __future__ import annotations

import numpy as np
import pytest
from occlusion_bake.core.bake import Baker
from occlusion_bake.core.scene.scene import Mesh, Scene
from occlusion_bake.core.texels.rasterize import owners_by_centre, rasterize
from occlusion_bake.core.texels.vertex_bake import FineCells, corner_image, corner_values, with_corner_cells
from occlusion_bake.tests.oracles import shapes
from occlusion_bake.tests.oracles.settings import flat_settings

pytestmark = pytest.mark.usefixtures("unmeasured")


def baked_corners(scene: Scene, rays: int = 256) -> np.ndarray:
    apart = with_corner_cells(scene)
    (target,) = apart.targets
    made = Baker(apart, flat_settings(rays=rays, margin=0)).bake(target, size=corner_image(len(target.mesh.triangles)))
    values: np.ndarray = corner_values(made.maps["ao"].values, target.mesh)
    return values


@pytest.mark.parametrize("count", [1, 2, 3, 5, 16, 17, 1000])
def test_three_texels_of_a_cell_belong_to_its_triangle(count: int) -> None:
    ball = shapes.sphere(segments=48)
    mesh = Mesh("some", ball.vertices, ball.triangles[:count], None, None)
    apart, (width, height) = with_corner_cells(shapes.scene(mesh)), corner_image(count)
    assert width * height >= 4 * count
    owner = rasterize("some", apart.targets[0].mesh.uv, width, height).owner
    assert np.array_equal(np.bincount(owner[owner >= 0], minlength=count), np.full(count, 3, dtype=np.int64))
    assert np.all(owner[1::2, 1::2] == -1)


def test_an_open_and_a_closed_surface_are_1_and_0() -> None:
    for mesh, value in ((shapes.plane(1.0), 1.0), (shapes.room(), 0.0)):
        assert np.all(baked_corners(shapes.scene(mesh), rays=16) == value)


def test_values_are_right_to_the_size_of_a_face() -> None:
    """A fine floor under a sphere that rests on it: visibility is 1 - R^3 / (R^2 + d^2)^1.5."""
    radius, cells = 0.6, 64
    knots = np.linspace(-2.0, 2.0, cells + 1)
    x, y = np.meshgrid(knots, knots)
    vertices = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1).astype(np.float32)
    corner = (np.arange(cells, dtype=np.int64)[:, None] * (cells + 1) + np.arange(cells, dtype=np.int64)).ravel()
    quads = np.stack([corner, corner + 1, corner + cells + 2, corner + cells + 1], axis=1)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]).astype(np.int32)
    floor = Mesh("floor", vertices, triangles)
    values = baked_corners(shapes.scene(floor, shapes.sphere((0, 0, radius), radius, 128)))
    exact = 1 - radius**3 / (radius**2 + (vertices[triangles] ** 2).sum(axis=-1)) ** 1.5
    assert np.sqrt(np.mean((values - exact) ** 2)) < 0.005
    for vertex in (0, 100, 2112):  # all corners of a flat floor's vertex agree
        assert np.ptp(values[triangles == vertex]) == 0.0


def test_hard_edges_keep_a_value_a_side() -> None:
    """A floor and a wall of one mesh, under a roof: where they meet, each has its own value."""
    vertices = np.float32([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [0, 1, 1]])
    triangles = np.int32([[0, 1, 2], [0, 2, 3], [0, 3, 5], [0, 5, 4]])
    mesh = Mesh("step", vertices, triangles)
    values = baked_corners(shapes.scene(mesh, shapes.quad((-1, -1, 0.99), (0, 3, 0), (3, 0, 0), name="roof")))
    floor, wall = values[:2][triangles[:2] == 0], values[2:][triangles[2:] == 0]
    assert np.ptp(floor) == 0.0 and np.ptp(wall) == 0.0 and abs(floor[0] - wall[0]) > 0.01


@pytest.mark.parametrize("side", [4, 8])
def test_fine_cells_have_the_same_parts(side: int) -> None:
    """Of a function that rises from the first corner to the second: 1/4 in the square of the first corner's part, the
    middle third beyond a half in the second's, 1/6 in the third's. Texels are no points."""
    cells = FineCells(5, side)
    width, height = cells.size
    rising = np.tile((np.arange(width, dtype=np.int64) % side + 0.5) / side, (height, 1)).astype(np.float32)
    parts = cells.parts(rising, np.ones_like(rising, dtype=np.bool_))
    assert parts.shape == (5, 3)
    np.testing.assert_allclose(parts, [[1 / 4, 2 / 3, 1 / 6]] * 5, atol=0.5 / side**2)
    nothing = cells.parts(rising, np.zeros_like(rising, dtype=np.bool_))
    assert np.isnan(nothing).all()


def test_fine_cells_own_the_texels_that_are_counted() -> None:
    """By their middles, those on the triangles' long sides too, and each only those of its own cell."""
    cells = FineCells(3, 8)
    owner = owners_by_centre(cells.uv, *cells.size)
    y, x = np.mgrid[: cells.size[1], : cells.size[0]]
    number = x // 8 + y // 8 * (cells.size[0] // 8)
    counted = (x % 8 + y % 8 < 8) & (number < 3)
    np.testing.assert_array_equal(owner, np.where(counted, number, -1))
