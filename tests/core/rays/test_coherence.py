"""When rays side by side are taken to meet the same triangles."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from occlusion_bake.core.rays.coherence import MOST_SPREAD, are_coherent, spread_of_faces
from occlusion_bake.core.rays.texel_surface import TexelSurface
from occlusion_bake.core.scene.scene import Mesh
from occlusion_bake.tests.oracles import shapes
from occlusion_bake.tests.oracles.sheet import Sheet

SIDE = 128


def rough(height: float) -> Mesh:
    mesh: Mesh = shapes.grid(1.0, 100)
    mesh.vertices[:, 2] = height * np.random.default_rng(0).random(len(mesh.vertices))
    return mesh


def test_faces_of_a_plane_are_not_spread_and_those_of_a_rough_field_are() -> None:
    assert spread_of_faces(Sheet(shapes.plane(1.0), SIDE).surface) == pytest.approx(0.0, abs=1e-12)
    smooth, steep = (spread_of_faces(Sheet(rough(height), SIDE).surface) for height in (0.001, 0.02))
    assert 0.0 < smooth < MOST_SPREAD < steep < 1.0


def test_rays_are_coherent_where_triangles_are_few_and_faces_alike() -> None:
    plane, relief = (Sheet(mesh, SIDE).surface for mesh in (shapes.plane(1.0), rough(0.02)))
    assert are_coherent(plane, 1000, SIDE**2)
    assert not are_coherent(plane, SIDE**2 + 1, SIDE**2)
    assert not are_coherent(relief, 1000, SIDE**2)


@pytest.mark.parametrize("size", [(1, 1), (3, 9), (5, 4)])
def test_images_smaller_than_blocks_have_no_spread_or_that_of_a_block(size: tuple[int, int]) -> None:
    surface = Sheet(rough(0.02), SIDE).surface
    part = TexelSurface(surface.mesh, np.ascontiguousarray(surface.owner[: size[0], : size[1]]))
    assert (spread_of_faces(part) > MOST_SPREAD) == (min(size) >= 4)


def test_points_without_a_triangle_are_told_by_their_faces() -> None:
    """As those that a low mesh sees of a high one."""
    surface = Sheet(shapes.plane(1.0), SIDE).surface
    mesh = surface.mesh
    points = replace(mesh, vertices=0.0 * mesh.vertices, faces=np.float32([[0, 0, 1]] * len(mesh.triangles)))
    assert spread_of_faces(replace(surface, mesh=points)) == 0.0
